"""What the checks of the joints share: units, statusword values, moves, heartbeats, and what the world sees."""

import math
import struct

from checks import eventually, near

COUNTS_PER_TURN = 32768
COUNTS_PER_SECOND = COUNTS_PER_TURN / 60  # at 1 r/min
POSITION, SPEED, HOMING, INTERPOLATION = 1, 3, 6, 7
ALARM, REACHED, ORIGIN_FOUND, ORIGIN_NOT_FOUND = 1 << 3, 1 << 10, 1 << 12, 1 << 13
#: How near a target the servo comes: a hundredth of a turn of the motor would be 330 counts.
CLOSE = 30
HOST_HEARTBEAT = 0x77F


def command(bench, mode, controlword):
    bench.write(0x6060, mode)
    bench.write(0x6040, controlword)


def arrives(bench, timeout_s=15.0):
    bench.status_becomes(REACHED, REACHED, "bit 10 tells that the target is reached", timeout_s)


def is_at(bench, position, what="6064h"):
    """6064h settles at a position."""
    close = lambda now: abs(now - position) <= CLOSE
    eventually(lambda: bench.read(0x6064), close, f"{what} settles at {position}", timeout_s=15.0)


def speed_becomes(bench, r_min, timeout_s=8.0):
    """606Ch by SDO is in 0.1 r/min: within 2 r/min, and within 2 %."""
    close = lambda now: abs(now - 10 * r_min) <= max(20, abs(r_min) // 5)
    eventually(lambda: bench.read(0x606C), close, f"606Ch becomes {10 * r_min}", timeout_s)


def absolute(bench, target):
    """An absolute position, taken at once (manual 5.06.1)."""
    command(bench, POSITION, 0x2F)
    bench.write(0x607A, target)
    arrives(bench)
    is_at(bench, target)


def shaft(bench):
    """Where the motor's shaft truly is, in counts from where it stood at the start of the simulation."""
    return bench.world("get")["shaft_angle_rad"] / math.tau * COUNTS_PER_TURN


def exchange(bench, number, data, node_id=None):
    """Sends a receive PDO and returns the bytes of the transmit PDO that answers it."""
    node_id = node_id or bench.node_id
    mark = bench.bench.trace.mark()
    bench.bench.send(0x100 + 0x100 * number + node_id, data)
    cob_id = 0x080 + 0x100 * number + node_id
    return bytes(bench.bench.trace.wait(cob_id, mark, 3.0, f"the answer to RPDO{number}").data)


def rpdo1(bench, controlword, mode, target):
    return struct.unpack("<iH", exchange(bench, 1, struct.pack("<Hbi", controlword, mode, target)))


def rpdo2(bench, target, speed):
    return struct.unpack("<iH", exchange(bench, 2, struct.pack("<iI", target, speed)))


def rpdo3(bench, controlword, mode, speed):
    return struct.unpack("<iH", exchange(bench, 3, struct.pack("<Hbi", controlword, mode, speed)))


def rpdo4(bench, target):
    return struct.unpack("<iH", exchange(bench, 4, struct.pack("<i", target)))


def save(bench):
    bench.write(0x2614, 1)
    eventually(lambda: bench.read(0x2614), lambda flag: flag == 2, "2614h reads 2 when all is stored")
    bench.sleep(0.3)


def turned(bench, before, counts, what, tolerance=CLOSE):
    near(bench.read(0x6064) - before, counts, tolerance, what)
