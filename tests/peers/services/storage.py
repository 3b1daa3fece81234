"""What survives the power, and what `--state` keeps from one run to the next."""

import time

from ferrodrive import SimulatorError

from checks import check, equal, true
from drive import ALL, MJOINT, ZLIM42C

#: The contract: on disk within 1.5 s of the drive's store.
ON_DISK_S = 2.5


def expected(drive):
    return [value for _, _, value in drive.stored]


@check("nothing is kept without the command to store, all that is stored with it, and what commands the motor never", *ALL)
def on_command(bench):
    stored = bench.drive.stored
    delivered = bench.values(stored)
    bench.write_all(bench.drive.hold_store + stored)
    bench.sleep(0.6)
    bench.power_cycle()
    equal(bench.values(stored), delivered, "the objects after a power cycle without saving")
    bench.write_all(bench.drive.hold_store + stored + ((0x60FF, 0, 300),))
    bench.save()
    bench.power_cycle()
    equal(bench.values(stored), expected(bench.drive), "the objects after a power cycle with saving")
    equal(bench.read(0x6040), 0, "6040h")
    true(bench.drive is MJOINT or bench.read(0x6081) == 120, "6081h, which is not stored")


@check("--state keeps what was stored when the simulator ends, and when it is killed", *ALL, state=True)
def across_runs(bench):
    bench.write_all(bench.drive.stored)
    bench.save()
    for kill in (False, True):
        if kill:
            time.sleep(ON_DISK_S)
        bench.restart(kill=kill)
        equal(bench.values(bench.drive.stored), expected(bench.drive), f"the objects in the next run, killed: {kill}")


@check("a kill in the middle of storing leaves the old values or the new ones", ZLIM42C, state=True)
def kill_while_storing(bench):
    stored = bench.drive.stored
    for round_ in range(4):
        old = bench.values(stored)
        new = [value if round_ % 2 == 0 else 0 if index != 0x1017 else 50 for index, _, value in stored]
        bench.write_all(bench.drive.hold_store + tuple((index, sub, value) for (index, sub, _), value in zip(stored, new)))
        bench.write(0x2010, 2)
        time.sleep(0.05 * round_)
        bench.restart(kill=True)
        true(bench.values(stored) in (old, new), f"all old or all new, got {bench.values(stored)} of {old} and {new}")


@check("a damaged store is refused with a reason or taken as factory settings, never half", ZLIM42C, state=True)
def damaged(bench):
    delivered = bench.values(bench.drive.stored)
    bench.write_all(bench.drive.stored)
    time.sleep(ON_DISK_S)
    bench.stop()
    files = bench.state_files()
    true(files, "there is a file in the --state folder")
    for path in files:
        data = path.read_bytes()
        path.write_bytes(data[: len(data) // 2])
    try:
        bench.start()
    except SimulatorError as error:
        true("ended" in str(error) and bench.simulator.stderr(), f"a reason on stderr: {error}")
        for path in files:
            path.unlink()
        bench.start()
    true(bench.values(bench.drive.stored) in (delivered, expected(bench.drive)), "all or nothing")
