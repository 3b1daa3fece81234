"""The three modes: profile velocity, profile position, profile torque (manual 4.1 to 4.6, 5.3, 7)."""

import time

from checks import check, equal, eventually, near, true

POSITION, VELOCITY, TORQUE = 1, 3, 4
COUNTS_PER_TURN = 4 * 1024
#: 606Ch is in 0.1 r/min; the drive calls a speed reached within 5 r/min.
SPEED_TOLERANCE = 50
#: 2002h: in place within 30 counts.
IN_PLACE = 30
REACHED, ACKNOWLEDGE, SPEED_IS_ZERO, IN_POSITION, RUNNING = 1 << 10, 1 << 12, 1 << 12, 1 << 13, 1 << 14


def bits(bench, mask):
    return bench.statusword() & mask


def speed_becomes(bench, r_min):
    close = lambda speed: abs(speed - 10 * r_min) <= SPEED_TOLERANCE
    eventually(lambda: bench.read(0x606C), close, f"606Ch becomes {10 * r_min}")


@check("profile velocity runs at 100, -100, 50 and -50 r/min and tells so")
def velocity(bench):
    bench.enable(VELOCITY)
    for r_min in (100, -100, 50, -50):
        bench.write(0x60FF, r_min)
        speed_becomes(bench, r_min)
        eventually(lambda: bits(bench, REACHED | RUNNING), lambda b: b == REACHED | RUNNING, "bits 10 and 14", 2)
        equal(bits(bench, SPEED_IS_ZERO), 0, f"bit 12 at {r_min} r/min")
    bench.write(0x60FF, 0)
    speed_becomes(bench, 0)
    eventually(lambda: bits(bench, SPEED_IS_ZERO), bool, "bit 12 at standstill")


@check("at 60 r/min the position advances by 4096 counts a second")
def velocity_moves_position(bench):
    bench.enable(VELOCITY)
    bench.write(0x60FF, 60)
    speed_becomes(bench, 60)
    time.sleep(0.5)
    bench.read(0x6064)
    mark = bench.trace.mark()
    first = bench.read(0x6064)
    time.sleep(0.9)
    second = bench.read(0x6064)
    frames = bench.trace.since(mark, 0x584)
    took_s = frames[-1].timestamp - frames[0].timestamp
    near((second - first) / took_s, COUNTS_PER_TURN, COUNTS_PER_TURN * 0.03, "counts a second")


@check("a velocity ramp of 500 ms takes about that long")
def velocity_ramp(bench):
    bench.write(0x6083, 500)
    bench.enable(VELOCITY)
    start = time.monotonic()
    bench.write(0x60FF, 500)
    eventually(lambda: bench.read(0x606C), lambda speed: speed >= 4900, "606Ch reaches 490 r/min")
    near(time.monotonic() - start, 0.5, 0.2, "time to 98 % of the speed in s")


@check("the controlword's halt bit stops the motor and keeps it enabled")
def halt(bench):
    bench.enable(VELOCITY)
    bench.write(0x60FF, 100)
    speed_becomes(bench, 100)
    bench.write(0x6040, 0x010F)
    speed_becomes(bench, 0)
    equal(bench.statusword() & 0x7F, 0x37, "low bits of the statusword in halt")
    bench.write(0x6040, 0x000F)
    speed_becomes(bench, 100)


@check("quick stop halts and stays in quick stop active; Fh enables again")
def quick_stop(bench):
    bench.enable(VELOCITY)
    bench.write(0x60FF, 100)
    speed_becomes(bench, 100)
    bench.write(0x6040, 0x0002)
    speed_becomes(bench, 0)
    equal(bench.statusword() & 0xFF, 0x17, "low byte after the quick stop")
    bench.write(0x6040, 0x000F)
    eventually(lambda: bench.statusword() & 0xFF, lambda low: low == 0x37, "low byte after Fh")


def go(bench, target, relative):
    """One set-point with the handshake of bits 4 and 12 (manual 4.2, 4.3, 7.2)."""
    prepare, start = (0x4F, 0x5F) if relative else (0x0F, 0x1F)
    bench.write(0x607A, target)
    bench.write(0x6040, prepare)
    eventually(lambda: bits(bench, ACKNOWLEDGE), lambda bit: not bit, "bit 12 falls before the set-point")
    bench.write(0x6040, start)
    eventually(lambda: bits(bench, ACKNOWLEDGE), bool, "bit 12 acknowledges the set-point")
    bench.write(0x6040, prepare)
    eventually(lambda: bits(bench, ACKNOWLEDGE), lambda bit: not bit, "bit 12 falls after bit 4")
    eventually(lambda: bits(bench, REACHED), bool, "bit 10 tells that the target is reached", timeout_s=12)


@check("profile position moves by 32000 counts and back, relative to where it stands")
def relative(bench):
    bench.write(0x6081, 300)
    bench.enable(POSITION)
    start = bench.read(0x6064)
    go(bench, 32000, relative=True)
    near(bench.read(0x6064) - start, 32000, IN_PLACE, "counts moved")
    true(bits(bench, IN_POSITION), "bit 13 in place")
    go(bench, -32000, relative=True)
    near(bench.read(0x6064) - start, 0, IN_PLACE, "counts moved there and back")


@check("profile position goes to 32000 and to -32000 from wherever it stands")
def absolute(bench):
    bench.write(0x6081, 300)
    bench.enable(POSITION)
    for target in (32000, 32000, -32000):
        go(bench, target, relative=False)
        near(bench.read(0x6064), target, IN_PLACE, "6064h")


@check("the profile speed of a position move is the one in 6081h")
def profile_speed(bench):
    bench.write(0x6081, 120)
    bench.enable(POSITION)
    bench.write(0x607A, 32000)
    bench.write(0x6040, 0x5F)
    speed_becomes(bench, 120)
    fastest = max(bench.read(0x606C) for _ in range(100))
    true(fastest <= 1200 * 1.1, f"606Ch goes up to {fastest}, 6081h asks for 1200")


@check("a second set-point waits for the first when bit 5 is 0")
def queued_set_point(bench):
    bench.write(0x6081, 300)
    bench.enable(POSITION)
    for target in (8000, 16000):
        bench.write(0x607A, target)
        bench.write(0x6040, 0x4F)
        bench.write(0x6040, 0x5F)
    bench.write(0x6040, 0x4F)
    eventually(lambda: bench.read(0x6064), lambda at: abs(at - 24000) <= IN_PLACE, "8000 and then 16000 counts", 8)


@check("profile torque puts 1000 mA and -1000 mA into a locked rotor")
def torque(bench):
    bench.world("rotor lock")
    bench.write(0x6087, 20_000)
    bench.enable(TORQUE)
    for milliamperes in (1000, -1000):
        bench.write(0x6071, milliamperes)
        near(eventually(lambda: bench.read(0x6074), lambda now: now == milliamperes, "6074h"), milliamperes, 0, "6074h")
        close = lambda tenths: abs(tenths - milliamperes / 100) <= 1
        eventually(lambda: bench.read(0x6077), close, f"6077h shows {milliamperes / 1000} A")
    eventually(lambda: bits(bench, REACHED), bool, "bit 10 tells that the torque is reached")


@check("the torque slope of 6087h takes its time")
def torque_slope(bench):
    bench.world("rotor lock")
    bench.write(0x6087, 1000)
    bench.enable(TORQUE)
    start = time.monotonic()
    bench.write(0x6071, 1000)
    eventually(lambda: bench.read(0x6074), lambda now: now >= 1000, "6074h reaches 1000 mA")
    near(time.monotonic() - start, 1.0, 0.15, "seconds to 1000 mA at 1000 mA/s")


@check("without a word from the host for 2000h milliseconds the motor stops and stays enabled")
def host_watch(bench):
    bench.write(0x2000, 400)
    bench.enable(VELOCITY)
    bench.write(0x60FF, 100)
    speed_becomes(bench, 100)
    time.sleep(1.5)
    near(bench.world("get")["velocity_rpm"], 0, 2, "velocity by the world, after silence")
    equal(bench.statusword() & 0x7F, 0x37, "low bits of the statusword")
    equal(bench.read(0x603F), 0, "603Fh")


@check("with 2000h = 0 the motor runs on without the host")
def host_watch_off(bench):
    bench.write(0x2000, 0)
    bench.enable(VELOCITY)
    bench.write(0x60FF, 100)
    speed_becomes(bench, 100)
    time.sleep(1.5)
    near(bench.world("get")["velocity_rpm"], 100, 5, "velocity by the world, after silence")
