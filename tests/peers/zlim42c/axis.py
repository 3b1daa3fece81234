"""What the checks of the stepper share: units, statusword bits, set-points, and times measured by PDO."""

import math

from checks import eventually
from pdos import set_up, start

PULSES_PER_TURN = 4000  # 2006h = 10
PULSES_PER_SECOND = PULSES_PER_TURN / 60  # at 1 r/min
POSITION, VELOCITY, HOMING = 1, 3, 6

HOMED, REACHED, BIT_4, ACKNOWLEDGE, SPEED_IS_ZERO = 1 << 8, 1 << 10, 1 << 11, 1 << 12, 1 << 12
ENERGISED, RUNNING, IN_POSITION = 1 << 13, 1 << 14, 1 << 15
#: The bits that do not belong to the mode of operation.
POWER_STATE = 0x22FF

#: Functions of an input (2030h:02 to 05) and of an output (2030h:0D, 0E).
NO_FUNCTION, HOME, POSITIVE_LIMIT, NEGATIVE_LIMIT, EMERGENCY_STOP = 0, 1, 2, 3, 9
ALARM, DRIVE_STATUS, HOMING_DONE, ARRIVED = 1, 2, 3, 4


def rotor(get):
    """Where the rotor truly is, in pulses from where it stood at the start of the simulation."""
    return get["shaft_angle_rad"] / math.tau * PULSES_PER_TURN


def speed_becomes(bench, r_min, timeout_s=5.0):
    eventually(lambda: bench.read(0x606C), lambda speed: speed == r_min, f"606Ch becomes {r_min}", timeout_s)


def stands(bench, timeout_s=10.0):
    bench.status_becomes(RUNNING, 0, "bit 14 falls: the motor stands", timeout_s)


def runs(bench, r_min):
    """Profile velocity, up to speed."""
    bench.enable(VELOCITY)
    bench.write(0x60FF, r_min)
    speed_becomes(bench, r_min)


def set_point(bench, target, relative, immediately=False):
    """One set-point with the handshake of bits 4 and 12 (manual 5.3.4)."""
    ready = 0x0F | relative << 6 | immediately << 5
    bench.write(0x607A, target)
    bench.write(0x6040, ready)
    bench.status_becomes(ACKNOWLEDGE, 0, "bit 12 falls before the set-point")
    bench.write(0x6040, ready | 0x10)
    bench.status_becomes(ACKNOWLEDGE, ACKNOWLEDGE, "bit 12 acknowledges the set-point")
    bench.write(0x6040, ready)


def go(bench, target, relative, timeout_s=12.0):
    """A set-point, and the wait until it is reached."""
    set_point(bench, target, relative)
    bench.status_becomes(REACHED | ACKNOWLEDGE, REACHED, "bit 10 tells that the target is reached", timeout_s)


def watch(bench, *objects):
    """Has the drive send objects whenever one changes, as its first PDO. The frames bear simulated time."""
    set_up(bench, bench.node.tpdo[1], objects, trans_type=254, inhibit_time=0, event_timer=0)
    start(bench)


def running_time(bench, mark, timeout_s=10.0):
    """How long bit 14 of the watched statusword was set after the mark, in simulated seconds."""
    bit = lambda frame: int.from_bytes(frame.data[:2], "little") & RUNNING
    first = bench.trace.wait(0x181, mark, timeout_s, "bit 14 rises", bit)
    later = lambda frame: frame.timestamp > first.timestamp and not bit(frame)
    return bench.trace.wait(0x181, mark, timeout_s, "bit 14 falls", later).timestamp - first.timestamp
