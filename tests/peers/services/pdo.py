"""PDOs: those of the ZL drives set up by canopen-python's own classes, those of the joint as they are fixed (5.08, 5.10.3)."""

import math
import statistics
import struct
import time

import ears
from checks import PATIENCE_S, check, equal, near, table, true
from drive import MJOINT, ZL
from services.network import START, gaps

THREE = ("m4230e17b50@1", "m4230e17b50@2", "m4230e17b50@3")
SYNC = 0x080


def set_up(bench, pdo, variables, **parameters):
    """Maps variables with the library: COB-ID off (bit 31), parameters, mapping, COB-ID on; and starts the node."""
    bench.node.tpdo.read()
    bench.node.rpdo.read()
    pdo.clear()
    for index in variables:
        pdo.add_variable(index)
    for name, value in parameters.items():
        setattr(pdo, name, value)
    pdo.enabled = True
    pdo.save()
    bench.nmt(START)
    bench.sleep(0.1)


def tpdos(bench, mark, number=1):
    bench.read(0x1000)  # what was sent before the answer has been heard by then
    return bench.trace.since(mark, 0x080 + 0x100 * number + bench.node_id)


def syncs(bench, count):
    """Sends SYNCs, 20 ms apart; a mark from before them."""
    mark = bench.trace.mark()
    for _ in range(count):
        bench.network.sync.transmit()
        bench.sleep(0.02)
    bench.sleep(0.05)
    return mark


TYPES = table(
    "type syncs unchanged changed what",
    (0, 3, 0, 1, "once after a change"),
    (1, 6, 6, 6, "each SYNC"),
    (3, 6, 2, 2, "every third SYNC"),
    (254, 3, 0, 0, "no SYNC, and a change by itself"),
    (255, 3, 0, 0, "no SYNC, and a change by itself"),
)


@check("a transmit PDO of type {type} answers {what}", *ZL, rows=TYPES)
def transmission_type(bench, row):
    set_up(bench, bench.node.tpdo[1], (0x6040,), trans_type=row["type"], inhibit_time=0, event_timer=0)
    syncs(bench, 3)
    equal(len(tpdos(bench, syncs(bench, row["syncs"]))), row["unchanged"], "PDOs for SYNCs without a change")
    mark = bench.trace.mark()
    bench.write(0x6040, 6)
    bench.sleep(0.05)
    equal(len(tpdos(bench, mark)), int(row["type"] >= 254), "PDOs for the change itself")
    after = tpdos(bench, syncs(bench, row["syncs"]))
    equal([bytes(frame.data) for frame in after], [b"\x06\0"] * row["changed"], "PDOs for SYNCs after it")


@check("each of the four PDOs in each direction has its own identifier and its own objects", *ZL)
def all_four(bench):
    for number, index in enumerate((0x6041, 0x6064, 0x606C, 0x6061), 1):
        set_up(bench, bench.node.tpdo[number], (index,), trans_type=1)
    mark = syncs(bench, 1)
    lengths = [[frame.dlc for frame in tpdos(bench, mark, number)] for number in (1, 2, 3, 4)]
    equal(lengths, [[2], [4], [4], [1]], "lengths of the transmit PDOs")
    objects = (0x6081, 0x6083, 0x6084, 0x607A)
    for number, index in enumerate(objects, 1):
        set_up(bench, bench.node.rpdo[number], (index,), trans_type=255)
    for number, index in enumerate(objects, 1):
        bench.send(0x100 + 0x100 * number + bench.node_id, struct.pack("<I", 200 + number))
        bench.becomes(index, 200 + number)


@check("the event timer and the inhibit time count half milliseconds", *ZL)
def times(bench):
    bench.turn(60)
    for kind, timer, inhibit in ((255, 200, 0), (254, 0, 200)):
        set_up(bench, bench.node.tpdo[1], (0x6064,), trans_type=kind, inhibit_time=inhibit, event_timer=timer)
        mark = bench.trace.mark()
        bench.sleep(1.55)
        frames = tpdos(bench, mark)
        true(len(frames) >= 14, f"14 PDOs of type {kind} in 1.55 s and more, got {len(frames)}")
        near(statistics.mean(gaps(frames)), 0.100, 0.004, f"mean time between PDOs of type {kind} in s")


@check("canopen-python commands a speed by PDO, in operational and at SYNC, and reads speed and position from another", *ZL)
def by_library(bench):
    target, actual = bench.node.rpdo[2], bench.node.tpdo[2]
    sync = bench.network.sync.transmit
    set_up(bench, target, (0x60FF,), trans_type=1)
    set_up(bench, actual, (0x606C, 0x6064), trans_type=1)
    bench.enable(3)
    bench.nmt(0x80)
    for state, asked, expected in (("pre-operational", 100, 0), ("operational", 60, 0)):
        target[0x60FF].raw = asked
        target.transmit()
        bench.sleep(0.05)
        equal(bench.read(0x60FF), expected, f"60FFh after a PDO in {state}, before SYNC")
        bench.nmt(START)
        bench.sleep(0.05)
    bench.network.sync.transmit()
    bench.speed_becomes(60)
    true(ears.pdo_after(sync, actual, PATIENCE_S), "a PDO after SYNC")
    near(actual[0x606C].raw, 60 * bench.drive.per_rpm, 5 * bench.drive.per_rpm, "606Ch in the PDO")
    bench.write(0x60FF, 0)
    bench.speed_becomes(0)
    bench.sleep(0.5)
    true(ears.pdo_after(sync, actual, PATIENCE_S), "a PDO after SYNC")
    near(actual[0x6064].raw, bench.read(0x6064), 3, "6064h in the PDO, at standstill")


def exchange(joint, number, form, *values):
    """Sends a receive PDO and returns position or speed, and statusword, of the transmit PDO that answers it."""
    mark = joint.bench.trace.mark()
    joint.bench.send(0x100 + 0x100 * number + joint.node_id, struct.pack(form, *values))
    cob_id = 0x080 + 0x100 * number + joint.node_id
    frame = joint.bench.trace.wait(cob_id, mark, f"the answer to RPDO{number}")
    return struct.unpack("<iH", frame.data)


@check("each receive PDO commands what it carries, and is answered once by the transmit PDO of its number", MJOINT)
def answered(bench):
    mark = bench.trace.mark()
    exchange(bench, 3, "<Hbi", 0x0F, 3, 400)
    bench.speed_becomes(400)
    near(exchange(bench, 3, "<Hbi", 0x0F, 3, 400)[0], 400, 20, "606Ch in TPDO3, in r/min")
    exchange(bench, 1, "<Hbi", 0x2F, 1, 70_000)
    bench.becomes(0x6064, 70_000, bench.drive.close)
    exchange(bench, 2, "<iI", 20_000, 700)
    equal([bench.read(0x607A), bench.read(0x6081)], [20_000, 700], "607Ah and 6081h")
    bench.becomes(0x6064, 20_000, bench.drive.close)
    exchange(bench, 4, "<i", 5000)
    bench.sleep(0.3)
    bench.becomes(0x6064, 20_000, bench.drive.close)
    bench.network.sync.start(0.05)
    try:
        bench.becomes(0x6064, 5000, bench.drive.close)
    finally:
        bench.network.sync.stop()
    equal([len(tpdos(bench, mark, number)) for number in (1, 2, 3, 4)], [1, 1, 2, 1], "transmit PDOs")


def minimum_jerk(share):
    """From 0 to 1 with rest at both ends."""
    return share**3 * (10 - 15 * share + 6 * share**2)


@check("three joints follow a curve of a point each 2 ms, by RPDO4 and SYNC, and arrive together", MJOINT, drives=THREE)
def interpolation(bench):
    joints, ways, cycles = [bench, bench.other(2), bench.other(3)], (60_000, -45_000, 20_000), 600
    for joint in joints:
        joint.write(0x261C, 1)
        joint.enable(7)
    starts = [joint.read(0x6064) for joint in joints]
    mark, clock = bench.trace.mark(), time.monotonic()
    for cycle in range(1, cycles + 1):
        for joint, start, way in zip(joints, starts, ways):
            bench.send(0x500 + joint.node_id, struct.pack("<i", start + round(way * minimum_jerk(cycle / cycles))))
        bench.send(SYNC)
        time.sleep(max(0, clock + cycle * 0.002 - time.monotonic()))
    for joint, start, way in zip(joints, starts, ways):
        at = f"joint {joint.node_id}"
        joint.becomes(0x6064, start + way, 30)
        way_of = [struct.unpack("<iH", frame.data)[0] - start for frame in bench.trace.since(mark, 0x480 + joint.node_id)]
        equal(len(way_of), cycles, f"answers of {at} to {cycles} points")
        true(all(-300 <= now * math.copysign(1, way) <= abs(way) + 300 for now in way_of), f"{at} stays on its way")
        near(way_of[cycles // 2], way / 2, abs(way) * 0.25, f"{at} at half time")
        equal(joint.read(0x260E), 0, f"260Eh of {at}")
