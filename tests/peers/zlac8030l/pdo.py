"""PDOs, set up by canopen-python's own PDO classes and by the manual's bytes (manual 6; CiA 301, 7.2.2)."""

import statistics
import struct
import time

from checks import check, equal, eventually, near, true

CANNOT_BE_MAPPED, TOO_LONG = 0x06040041, 0x06040042
NO_OBJECT = 0x06020000


def set_up(bench, pdo, variables, **parameters):
    """Maps variables with the library: COB-ID off (bit 31), parameters, mapping, COB-ID on."""
    bench.node.tpdo.read()
    bench.node.rpdo.read()
    pdo.clear()
    for index in variables:
        pdo.add_variable(index)
    for name, value in parameters.items():
        setattr(pdo, name, value)
    pdo.enabled = True
    pdo.save()


def start(bench):
    bench.nmt(0x01)
    time.sleep(0.1)


@check("a transmit PDO of type 1 answers each SYNC once, with speed and position")
def synchronous(bench):
    set_up(bench, bench.node.tpdo[1], (0x606C, 0x6064), trans_type=1)
    equal(bench.read(0x1800, 1), 0x184, "1800h:01, switched on again")
    start(bench)
    mark = bench.trace.mark()
    for _ in range(10):
        bench.network.sync.transmit()
        time.sleep(0.02)
    frames = bench.trace.since(mark, 0x184)
    equal(len(frames), 10, "PDOs for 10 SYNCs")
    true(all(frame.dlc == 8 for frame in frames), "8 bytes each")


@check("type 3 answers every third SYNC")
def every_third(bench):
    set_up(bench, bench.node.tpdo[1], (0x6041,), trans_type=3)
    start(bench)
    mark = bench.trace.mark()
    for _ in range(9):
        bench.network.sync.transmit()
        time.sleep(0.02)
    equal(len(bench.trace.since(mark, 0x184)), 3, "PDOs for 9 SYNCs")


@check("canopen-python reads position and speed from the PDO as by SDO")
def by_library(bench):
    pdo = bench.node.tpdo[2]
    set_up(bench, pdo, (0x606C, 0x6064), trans_type=1)
    start(bench)
    bench.enable(3)
    bench.write(0x60FF, 100)
    eventually(lambda: bench.read(0x606C), lambda speed: abs(speed - 1000) <= 50, "606Ch")
    bench.network.sync.transmit()
    true(pdo.wait_for_reception(timeout=1), "a PDO after SYNC")
    near(pdo[0x606C].raw, 1000, 50, "606Ch in the PDO")
    near(pdo[0x6064].raw, bench.read(0x6064), 1000, "6064h in the PDO, a few ms earlier")


@check("the event timer counts half milliseconds: 200 gives 100 ms")
def event_timer(bench):
    set_up(bench, bench.node.tpdo[1], (0x606C,), trans_type=255, inhibit_time=0, event_timer=200)
    start(bench)
    mark = bench.trace.mark()
    time.sleep(1.55)
    times = [frame.timestamp for frame in bench.trace.since(mark, 0x184)]
    gaps = [later - earlier for earlier, later in zip(times, times[1:])]
    true(14 <= len(times) <= 17, f"14 to 17 PDOs in 1.55 s, got {len(times)}")
    near(statistics.mean(gaps), 0.100, 0.002, "mean time between PDOs in s")


@check("type 254 sends changes, no faster than the inhibit time of 200 half milliseconds")
def inhibit_time(bench):
    set_up(bench, bench.node.tpdo[1], (0x6064,), trans_type=254, inhibit_time=200, event_timer=0)
    start(bench)
    bench.enable(3)
    bench.write(0x60FF, 60)
    eventually(lambda: bench.read(0x606C), lambda speed: abs(speed - 600) <= 50, "606Ch")
    mark = bench.trace.mark()
    time.sleep(0.9)
    times = [frame.timestamp for frame in bench.trace.since(mark, 0x184)]
    gaps = [later - earlier for earlier, later in zip(times, times[1:])]
    true(8 <= len(times) <= 10, f"8 to 10 PDOs in 0.9 s, got {len(times)}")
    true(min(gaps) >= 0.098, f"at least 100 ms between PDOs, got {min(gaps):.4f} s")


@check("type 254 is silent while nothing changes, and sends once on entering operational")
def silent_without_change(bench):
    set_up(bench, bench.node.tpdo[1], (0x6040,), trans_type=254, inhibit_time=0, event_timer=0)
    mark = bench.trace.mark()
    start(bench)
    time.sleep(0.5)
    equal(len(bench.trace.since(mark, 0x184)), 1, "PDOs after NMT start")


@check("a receive PDO sets the target speed in operational only")
def receive(bench):
    pdo = bench.node.rpdo[2]
    set_up(bench, pdo, (0x60FF,), trans_type=255)
    pdo[0x60FF].raw = 77
    pdo.transmit()
    time.sleep(0.05)
    equal(bench.read(0x60FF), 0, "60FFh after a PDO in pre-operational")
    start(bench)
    pdo[0x60FF].raw = -88
    pdo.transmit()
    eventually(lambda: bench.read(0x60FF), lambda value: value == -88, "60FFh after a PDO in operational", 1)
    bench.send(0x304, struct.pack("<h", 55))
    time.sleep(0.05)
    equal(bench.read(0x60FF), -88, "60FFh after a PDO that is too short")


@check("transmission stops with pre-operational, and the SDO server does not")
def closing(bench):
    set_up(bench, bench.node.tpdo[1], (0x606C,), trans_type=255, event_timer=100)
    start(bench)
    bench.nmt(0x80)
    time.sleep(0.1)
    mark = bench.trace.mark()
    time.sleep(0.3)
    equal(len(bench.trace.since(mark, 0x184)), 0, "PDOs in pre-operational")
    equal(bench.read(0x1000), 0x00040192, "1000h")


@check("a PDO whose COB-ID has bit 31 set is silent")
def switched_off(bench):
    set_up(bench, bench.node.tpdo[1], (0x6041,), trans_type=1)
    bench.write(0x1800, 0x80000184, sub=1)
    start(bench)
    mark = bench.trace.mark()
    bench.network.sync.transmit()
    time.sleep(0.1)
    equal(len(bench.trace.since(mark, 0x184)), 0, "PDOs after SYNC")


@check("mappings that cannot be are refused")
def bad_mappings(bench):
    for index in (0x1601, 0x1A01):
        bench.write(index, 0, sub=0)
    for index, entry, codes in (
        (0x1601, 0x60640020, (CANNOT_BE_MAPPED,)),
        (0x1A01, 0x10170010, (CANNOT_BE_MAPPED,)),
        (0x1A01, 0x65020020, (NO_OBJECT, CANNOT_BE_MAPPED)),
    ):
        code = bench.abort_code(bench.write, index, entry, 1)
        true(code in codes, f"{entry:08X}h into {index:04X}h: abort {code and hex(code)}")
    for sub in (1, 2, 3):
        bench.write(0x1A01, 0x60640020, sub=sub)
    code = bench.abort_code(bench.write, 0x1A01, 3, 0)
    true(code in (CANNOT_BE_MAPPED, TOO_LONG), f"three times 32 bits: abort {code and hex(code)}")
    equal(bench.abort_code(bench.write, 0x1A01, 5, 0), TOO_LONG, "five objects")


@check("a mapping entry cannot be written while its count is not 0")
def mapping_in_use(bench):
    true(bench.abort_code(bench.write, 0x1600, 0x60600008, 1) is not None, "1600h:01 while 1600h:00 = 1")
    equal(bench.read(0x1600, 1), 0x60400010, "1600h:01")
