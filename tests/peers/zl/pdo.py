"""PDOs, set up by canopen-python's own PDO classes (CiA 301, 7.2.2; ZLAC8030L manual 6; ZLIM42-C manual 5.2 and 5.4)."""

import statistics
import struct
import time

from checks import Common, equal, eventually, near, true
from pdos import gaps, set_up, start, syncs

COMMON = Common()
check = COMMON.check
CANNOT_BE_MAPPED, TOO_LONG = 0x06040041, 0x06040042
NO_OBJECT = 0x06020000
VELOCITY = 3


def tpdo(bench, number):
    """The identifier of the transmit PDO of that number, from 1."""
    return 0x080 + 0x100 * number + bench.node_id


def rpdo(bench, number):
    return 0x100 + 0x100 * number + bench.node_id


def runs(bench, r_min):
    bench.enable(VELOCITY)
    bench.write(0x60FF, r_min)
    close = lambda speed: abs(speed - bench.drive.per_rpm * r_min) <= 5 * bench.drive.per_rpm
    eventually(lambda: bench.read(0x606C), close, f"606Ch shows {r_min} r/min")


@check("a transmit PDO of type 1 answers each SYNC once, with speed and position")
def synchronous(bench):
    set_up(bench, bench.node.tpdo[1], (0x606C, 0x6064), trans_type=1)
    equal(bench.read(0x1800, 1), tpdo(bench, 1), "1800h:01, switched on again")
    start(bench)
    mark = bench.trace.mark()
    syncs(bench, 10)
    frames = bench.trace.since(mark, tpdo(bench, 1))
    equal(len(frames), 10, "PDOs for 10 SYNCs")
    true(all(frame.dlc == 8 for frame in frames), "8 bytes each")


@check("type 3 answers every third SYNC")
def every_third(bench):
    set_up(bench, bench.node.tpdo[1], (0x6041,), trans_type=3)
    start(bench)
    mark = bench.trace.mark()
    syncs(bench, 9)
    equal(len(bench.trace.since(mark, tpdo(bench, 1))), 3, "PDOs for 9 SYNCs")


@check("type 0 answers a SYNC only when its value changed since the last")
def acyclic(bench):
    set_up(bench, bench.node.tpdo[1], (0x6040,), trans_type=0)
    start(bench)
    syncs(bench, 1)
    mark = bench.trace.mark()
    syncs(bench, 3)
    equal(len(bench.trace.since(mark, tpdo(bench, 1))), 0, "PDOs for 3 SYNCs without a change")
    bench.write(0x6040, 6)
    mark = bench.trace.mark()
    syncs(bench, 3)
    frames = bench.trace.since(mark, tpdo(bench, 1))
    equal([bytes(frame.data) for frame in frames], [b"\x06\0"], "PDOs for 3 SYNCs after one change")


@check("each of the four transmit PDOs has its own identifier and its own objects")
def all_transmit(bench):
    objects = (0x6041, 0x6064, 0x606C, 0x6061)
    for number, index in enumerate(objects, 1):
        set_up(bench, bench.node.tpdo[number], (index,), trans_type=1)
    start(bench)
    mark = bench.trace.mark()
    syncs(bench, 1)
    for number, size in enumerate((2, 4, 4, 1), 1):
        frames = bench.trace.since(mark, tpdo(bench, number))
        equal([frame.dlc for frame in frames], [size], f"lengths of the PDOs {tpdo(bench, number):03X}h")


@check("each of the four receive PDOs has its own identifier and writes its own object")
def all_receive(bench):
    objects = ((0x6081, "<I"), (0x6083, "<I"), (0x6084, "<I"), (0x607A, "<i"))
    for number, (index, _) in enumerate(objects, 1):
        set_up(bench, bench.node.rpdo[number], (index,), trans_type=255)
    start(bench)
    for number, (index, form) in enumerate(objects, 1):
        bench.send(rpdo(bench, number), struct.pack(form, 200 + number))
        eventually(lambda: bench.read(index), lambda value: value == 200 + number, f"{index:04X}h")


@check("a receive PDO of type 1 acts at the next SYNC and not before")
def synchronous_receive(bench):
    set_up(bench, bench.node.rpdo[2], (0x60FF,), trans_type=1)
    start(bench)
    bench.send(rpdo(bench, 2), struct.pack("<i", 42))
    time.sleep(0.05)
    equal(bench.read(0x60FF), 0, "60FFh before SYNC")
    syncs(bench, 1)
    equal(bench.read(0x60FF), 42, "60FFh after SYNC")


@check("canopen-python reads position and speed from the PDO as by SDO")
def by_library(bench):
    pdo = bench.node.tpdo[2]
    set_up(bench, pdo, (0x606C, 0x6064), trans_type=1)
    start(bench)
    runs(bench, 100)
    bench.network.sync.transmit()
    true(pdo.wait_for_reception(timeout=3), "a PDO after SYNC")
    near(pdo[0x606C].raw, 100 * bench.drive.per_rpm, 5 * bench.drive.per_rpm, "606Ch in the PDO")
    bench.write(0x60FF, 0)
    eventually(lambda: bench.read(0x606C), lambda speed: abs(speed) < bench.drive.per_rpm, "606Ch falls to 0")
    time.sleep(0.3)
    bench.network.sync.transmit()
    true(pdo.wait_for_reception(timeout=3), "a PDO after SYNC")
    near(pdo[0x6064].raw, bench.read(0x6064), 3, "6064h in the PDO, at standstill")


@check("the event timer counts half milliseconds: 200 gives 100 ms")
def event_timer(bench):
    set_up(bench, bench.node.tpdo[1], (0x606C,), trans_type=255, inhibit_time=0, event_timer=200)
    start(bench)
    mark = bench.trace.mark()
    bench.sleep(1.55)
    frames = bench.trace.since(mark, tpdo(bench, 1))
    true(14 <= len(frames) <= 17, f"14 to 17 PDOs in 1.55 s, got {len(frames)}")
    near(statistics.mean(gaps(frames)), 0.100, 0.002, "mean time between PDOs in s")


@check("type 254 sends changes, no faster than the inhibit time of 200 half milliseconds")
def inhibit_time(bench):
    set_up(bench, bench.node.tpdo[1], (0x6064,), trans_type=254, inhibit_time=200, event_timer=0)
    start(bench)
    runs(bench, 60)
    mark = bench.trace.mark()
    bench.sleep(0.9)
    frames = bench.trace.since(mark, tpdo(bench, 1))
    true(len(frames) >= 8, f"8 PDOs and more in 0.9 s, got {len(frames)}")
    true(min(gaps(frames)) >= 0.098, f"at least 100 ms between PDOs, got {min(gaps(frames)):.4f} s")


@check("type 254 is silent while nothing changes, and sends once on entering operational")
def silent_without_change(bench):
    set_up(bench, bench.node.tpdo[1], (0x6040,), trans_type=254, inhibit_time=0, event_timer=0)
    mark = bench.trace.mark()
    start(bench)
    time.sleep(0.5)
    equal(len(bench.trace.since(mark, tpdo(bench, 1))), 1, "PDOs after NMT start")


@check("a receive PDO sets the target speed in operational only")
def receive(bench):
    pdo = bench.node.rpdo[2]
    set_up(bench, pdo, (0x60FF,), trans_type=255)
    pdo[0x60FF].raw = 77
    pdo.transmit()
    time.sleep(0.05)
    equal(bench.read(0x60FF), 0, "60FFh after a PDO in pre-operational")
    start(bench)
    equal(bench.read(0x60FF), 0, "60FFh after NMT start")
    pdo[0x60FF].raw = -88
    pdo.transmit()
    eventually(lambda: bench.read(0x60FF), lambda value: value == -88, "60FFh after a PDO in operational")
    bench.send(rpdo(bench, 2), struct.pack("<h", 55))
    time.sleep(0.05)
    equal(bench.read(0x60FF), -88, "60FFh after a PDO that is too short")


@check("the default receive PDO takes the controlword")
def by_default(bench):
    start(bench)
    for controlword, low in ((0x06, 0x31), (0x07, 0x33), (0x0F, 0x37), (0x00, 0x70)):
        bench.send(rpdo(bench, 1), controlword.to_bytes(2, "little"))
        bench.status_becomes(0xFF, low, f"the low byte after {controlword:02X}h")


@check("transmission stops with pre-operational, and the SDO server does not")
def closing(bench):
    set_up(bench, bench.node.tpdo[1], (0x606C,), trans_type=255, event_timer=100)
    start(bench)
    bench.nmt(0x80)
    time.sleep(0.1)
    mark = bench.trace.mark()
    time.sleep(0.3)
    equal(len(bench.trace.since(mark, tpdo(bench, 1))), 0, "PDOs in pre-operational")
    equal(bench.read(0x1000), bench.drive.device_type, "1000h")


@check("a PDO whose COB-ID has bit 31 set is silent")
def switched_off(bench):
    set_up(bench, bench.node.tpdo[1], (0x6041,), trans_type=1)
    bench.write(0x1800, 0x80000000 + tpdo(bench, 1), sub=1)
    start(bench)
    mark = bench.trace.mark()
    syncs(bench, 1)
    equal(len(bench.trace.since(mark, tpdo(bench, 1))), 0, "PDOs after SYNC")


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
