"""PDOs: fixed mapping, answers, SYNC and interpolation (manual 5.08 and 5.10.3)."""

import math
import struct
import time

from checks import check, equal, near, true
from mjoint.joint import INTERPOLATION, POSITION, command, is_at, rpdo2, rpdo4
from sweeps import BAD_VALUE

LENGTHS = {1: 7, 2: 8, 3: 7, 4: 4}
SYNC = 0x080
THREE = ("m4230e17b50@1", "m4230e17b50@2", "m4230e17b50@3")


def answers(bench, mark):
    return [len(bench.trace.since(mark, 0x081 + 0x100 * number)) for number in LENGTHS]


@check("each receive PDO is answered once by the transmit PDO of its number, with six bytes")
def answered(bench):
    for number, length in LENGTHS.items():
        mark = bench.trace.mark()
        bench.send(0x101 + 0x100 * number, bytes(length))
        frame = bench.trace.wait(0x081 + 0x100 * number, mark, 3.0, f"the answer to RPDO{number}")
        equal(frame.dlc, 6, f"bytes of TPDO{number}")
        bench.sleep(0.1)
        equal(answers(bench, mark), [int(number == other) for other in LENGTHS], f"answers to RPDO{number}")


@check("transmit PDOs do not come unasked, not with SYNC, time or movement")
def unasked(bench):
    command(bench, 3, 0x0F)
    mark = bench.trace.mark()
    bench.write(0x60FF, 300)
    for _ in range(5):
        bench.send(SYNC)
        bench.sleep(0.1)
    equal(answers(bench, mark), [0, 0, 0, 0], "transmit PDOs")


@check("a receive PDO that is too short changes nothing")
def too_short(bench):
    for number, length in LENGTHS.items():
        bench.send(0x101 + 0x100 * number, b"\x0F\0\x03\x64\0\0\0\0"[: length - 1])
    bench.sleep(0.1)
    bench.send(SYNC)
    bench.sleep(0.1)
    equal([bench.read(index) for index in (0x6040, 0x6060, 0x607A, 0x6081, 0x60FF)], [0, 1, 0, 1500, 0], "the objects")


@check("a receive PDO with bytes to spare acts by its first ones")
def too_long(bench):
    bench.send(0x501, struct.pack("<iI", 4242, 0))
    bench.send(0x401, struct.pack("<HbiB", 0, 3, 77, 9))
    bench.sleep(0.1)
    equal([bench.read(0x6060), bench.read(0x60FF)], [3, 77], "6060h and 60FFh")


@check("the transmission types are fixed: 255, and 1 for RPDO4")
def types(bench):
    for index in (0x1400, 0x1401, 0x1402, 0x1800, 0x1801, 0x1802, 0x1803):
        equal(bench.read(index, 2), 255, f"{index:04X}h:02")
        equal(bench.abort_code(bench.write, index, 1, 2), BAD_VALUE, f"{index:04X}h:02 = 1")
    equal(bench.read(0x1403, 2), 1, "1403h:02")
    equal(bench.abort_code(bench.write, 0x1403, 255, 2), BAD_VALUE, "1403h:02 = 255")


@check("a PDO whose COB-ID has bit 31 set neither acts nor answers")
def switched_off(bench):
    bench.write(0x1801, 0x80000281, sub=1)
    mark = bench.trace.mark()
    bench.send(0x301, struct.pack("<iI", 11, 900))
    bench.sleep(0.2)
    equal(answers(bench, mark), [0, 0, 0, 0], "answers while TPDO2 is off")
    equal(bench.read(0x6081), 900, "6081h: RPDO2 is on")
    bench.write(0x1401, 0x80000301, sub=1)
    bench.send(0x301, struct.pack("<iI", 12, 800))
    bench.sleep(0.1)
    equal([bench.read(0x607A), bench.read(0x6081)], [11, 900], "607Ah and 6081h while RPDO2 is off")


@check("RPDO4 waits for SYNC in mode 1 too, and then is a move")
def cached_in_mode_1(bench):
    start = bench.read(0x6064)
    command(bench, POSITION, 0x0F)
    rpdo4(bench, start + 40_000)
    bench.sleep(0.3)
    near(bench.read(0x6064), start, 30, "6064h before SYNC")
    bench.send(SYNC)
    is_at(bench, start + 40_000)


def minimum_jerk(share):
    """From 0 to 1 with rest at both ends."""
    return share**3 * (10 - 15 * share + 6 * share**2)


@check("three joints follow a curve of a point each 2 ms, by RPDO4 and SYNC, and arrive together", drives=THREE)
def interpolation(bench):
    joints = [bench, bench.other(2), bench.other(3)]
    ways = (60_000, -45_000, 20_000)
    for joint in joints:
        joint.write(0x261C, 1)
        command(joint, INTERPOLATION, 0x0F)
    starts = [joint.read(0x6064) for joint in joints]
    mark = bench.trace.mark()
    cycles = 600
    begin, clock = bench.now(), time.monotonic()
    for cycle in range(1, cycles + 1):
        for joint, start, way in zip(joints, starts, ways):
            bench.send(0x500 + joint.node_id, struct.pack("<i", start + round(way * minimum_jerk(cycle / cycles))))
        bench.send(SYNC)
        time.sleep(max(0, clock + cycle * 0.002 - time.monotonic()))
    took = bench.now() - begin
    for joint, start, way in zip(joints, starts, ways):
        is_at(joint, start + way, f"6064h of joint {joint.node_id}")
        answered = bench.trace.since(mark, 0x480 + joint.node_id)
        equal(len(answered), cycles, f"answers of joint {joint.node_id} to {cycles} points")
        way_of = [struct.unpack("<iH", frame.data)[0] - start for frame in answered]
        true(all(0 <= at * math.copysign(1, way) + 300 <= abs(way) + 600 for at in way_of), f"joint {joint.node_id} stays on its way")
        true(abs(way_of[cycles // 2] - way / 2) < abs(way) * 0.25, f"joint {joint.node_id} is half way at half time, got {way_of[cycles // 2]} of {way}")
        equal(joint.read(0x260E), 0, f"260Eh of joint {joint.node_id}")
    true(took < 30, f"the points took {took:.1f} s")


@check("with 261Ch = 255 mode 7 goes on by the edges at DIR, and stands without them")
def dir_clock(bench):
    start = bench.read(0x6064)
    bench.write(0x261C, 255)
    command(bench, INTERPOLATION, 0x0F)
    rpdo4(bench, start + 300)
    bench.send(SYNC)
    bench.sleep(0.3)
    near(bench.read(0x6064), start, 30, "6064h after SYNC, without edges")
    bench.world("clock 10000")
    is_at(bench, start + 300)


@check("targets of three joints wait for one SYNC and then begin in the same cycle", drives=THREE)
def together(bench):
    joints = [bench, bench.other(2), bench.other(3)]
    for joint in joints:
        joint.write(0x261C, 1)
        joint.write(0x6081, 1000)
        command(joint, POSITION, 0x0F)
    starts = [joint.read(0x6064) for joint in joints]
    for joint, start in zip(joints, starts):
        bench.send(0x500 + joint.node_id, struct.pack("<i", start + 30_000))
    bench.sleep(0.3)
    for joint, start in zip(joints, starts):
        near(joint.read(0x6064), start, 30, f"6064h of joint {joint.node_id} before SYNC")
    bench.send(SYNC)
    for joint, start in zip(joints, starts):
        is_at(joint, start + 30_000, f"6064h of joint {joint.node_id}")


@check("canopen-python's SYNC producer executes a cached target")
def by_library(bench):
    start = bench.read(0x6064)
    command(bench, POSITION, 0x0F)
    rpdo4(bench, start + 9000)
    bench.network.sync.start(0.05)
    try:
        is_at(bench, start + 9000)
    finally:
        bench.network.sync.stop()


@check("RPDO2 changes target and speed together")
def target_and_speed(bench):
    start = bench.read(0x6064)
    command(bench, POSITION, 0x2F)
    rpdo2(bench, start + 50_000, 700)
    equal([bench.read(0x607A), bench.read(0x6081)], [start + 50_000, 700], "607Ah and 6081h")
    is_at(bench, start + 50_000)
