"""What survives a power cycle: 200Ch, 2010h, and the stores of `--state` (manual 5.4)."""

import time

from checks import check, equal, eventually, true
from zlim42c.axis import POSITION, go

RESTORE, SAVE = 1, 2
#: A stored object and a value that differs from its default: (index, sub, value).
STORED = ((0x1017, 0, 700), (0x2005, 0, 5), (0x2006, 0, 4), (0x2007, 0, 1), (0x200A, 0, 2), (0x2030, 2, 3), (0x2030, 0x0D, 4), (0x204B, 0, 33))


def command(bench, what):
    bench.write(0x2010, what)
    eventually(lambda: bench.read(0x2010), lambda value: value == 0, "2010h reads 0 again")
    bench.sleep(0.3)


def values(bench):
    return [bench.read(index, sub) for index, sub, _ in STORED]


@check("with 200Ch = 0, as delivered, each write of a stored object survives the power cycle")
def save_each(bench):
    for index, sub, value in STORED:
        bench.write(index, value, sub)
    bench.sleep(1.0)
    bench.power_cycle()
    equal(values(bench), [value for _, _, value in STORED], "the stored objects")


@check("with 200Ch = 1 nothing is stored without 2010h = 2, and everything with it")
def save_on_command(bench):
    delivered = values(bench)
    bench.write(0x200C, 1)
    for index, sub, value in STORED:
        bench.write(index, value, sub)
    bench.sleep(0.6)
    bench.power_cycle()
    equal(values(bench), delivered, "the objects after a power cycle without saving")
    equal(bench.read(0x200C), 0, "200Ch, which is not stored")
    bench.write(0x200C, 1)
    for index, sub, value in STORED:
        bench.write(index, value, sub)
    command(bench, SAVE)
    bench.power_cycle()
    equal(values(bench), [value for _, _, value in STORED], "the objects after a power cycle with saving")


@check("2010h = 1 brings the factory settings back")
def restore(bench):
    delivered = values(bench)
    for index, sub, value in STORED:
        bench.write(index, value, sub)
    command(bench, SAVE)
    command(bench, RESTORE)
    bench.power_cycle()
    equal(values(bench), delivered, "the objects after restoring")


@check("objects without the S of stored are as delivered after a power cycle: 200Eh, 6081h, 6098h")
def not_stored(bench):
    for index, value in ((0x200E, 50), (0x6081, 333), (0x6098, 17), (0x605A, 6)):
        bench.write(index, value)
    command(bench, SAVE)
    bench.power_cycle()
    equal([bench.read(index) for index in (0x200E, 0x6081, 0x6098, 0x605A)], [5, 120, 0, 5], "the objects")


@check("6064h and the power state begin anew with the power")
def position_is_lost(bench):
    bench.enable(POSITION)
    go(bench, 3000, relative=True)
    bench.power_cycle()
    equal(bench.read(0x6064), 0, "6064h")
    equal(bench.statusword(), 0x0270, "the statusword")


@check("a PDO mapping that was stored works after a power cycle")
def mapping(bench):
    bench.write(0x1A00, 0x60640020, sub=1)
    bench.write(0x1800, 1, sub=2)
    bench.write(0x1A00, 1, sub=0)
    command(bench, SAVE)
    bench.power_cycle()
    equal([bench.read(0x1A00, 0), bench.read(0x1A00, 1)], [1, 0x60640020], "1A00h")
    bench.nmt(0x01)
    time.sleep(0.1)
    mark = bench.trace.mark()
    bench.network.sync.transmit()
    equal(bench.trace.wait(0x181, mark, 3.0, "a PDO after SYNC").dlc, 4, "bytes of the PDO")


@check("--state keeps what was stored from one run to the next", state=True)
def across_runs(bench):
    for index, sub, value in STORED:
        bench.write(index, value, sub)
    bench.sleep(0.5)
    bench.restart()
    equal(values(bench), [value for _, _, value in STORED], "the stored objects in the next run")


@check("--state keeps what was stored when the simulator is killed", state=True)
def across_kill(bench):
    for round_ in range(3):
        bench.write(0x2005, round_ + 4)
        # The contract: on disk within 1.5 s of the drive's store.
        time.sleep(2.5)
        bench.restart(kill=True)
        equal(bench.read(0x2005), round_ + 4, f"2005h after kill {round_ + 1}")


@check("a kill in the middle of storing leaves the old values or the new ones", state=True)
def kill_while_storing(bench):
    bench.write(0x200C, 1)
    for round_ in range(4):
        old = values(bench)
        new = [value if round_ % 2 == 0 else 0 if index != 0x1017 else 50 for index, _, value in STORED]
        bench.write(0x200C, 1)
        for (index, sub, _), value in zip(STORED, new):
            bench.write(index, value, sub)
        bench.write(0x2010, SAVE)
        time.sleep(0.05 * round_)
        bench.restart(kill=True)
        true(values(bench) in (old, new), f"all old or all new, got {values(bench)} of {old} and {new}")


@check("a damaged store is refused with a reason or taken as factory settings, never half", state=True)
def damaged(bench):
    delivered = values(bench)
    for index, sub, value in STORED:
        bench.write(index, value, sub)
    time.sleep(2.5)
    bench.stop()
    files = bench.state_files()
    true(files, "there is a file in the --state folder")
    for path in files:
        data = path.read_bytes()
        path.write_bytes(data[: len(data) // 2])
    try:
        bench.start()
    except AssertionError as error:
        true("ended" in str(error) and bench.simulator.stderr(), f"a reason on stderr: {error}")
        for path in files:
            path.unlink()
        bench.start()
    true(values(bench) in (delivered, [value for _, _, value in STORED]), f"all or nothing, got {values(bench)}")
