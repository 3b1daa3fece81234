"""Profile velocity (manual 5.3.5 and 5.4; CiA 402-2)."""

from checks import check, equal, eventually, near, true
from zlim42c.axis import ENERGISED, REACHED, RUNNING, SPEED_IS_ZERO, VELOCITY, rotor, runs, speed_becomes, stands, watch


def speeds(bench, mark):
    """Watched 606Ch with its time, since the mark."""
    return [(frame.timestamp, int.from_bytes(frame.data[:4], "little", signed=True)) for frame in bench.trace.since(mark, 0x181)]


@check("606Ch, 2002h and the statusword follow the target speed, in 1 r/min and with its sign")
def follows(bench):
    bench.enable(VELOCITY)
    for r_min in (60, -60, 250, -1):
        bench.write(0x60FF, r_min)
        speed_becomes(bench, r_min)
        bench.status_becomes(REACHED | SPEED_IS_ZERO | RUNNING, REACHED | RUNNING, f"bits 10, 12 and 14 at {r_min} r/min")
        equal(bench.read(0x2002), r_min, "2002h")
        equal(bench.read(0x2001), 1, "2001h")
    bench.write(0x60FF, 0)
    bench.status_becomes(SPEED_IS_ZERO | RUNNING | ENERGISED, SPEED_IS_ZERO | ENERGISED, "bits 12, 13 and 14 at rest")
    equal([bench.read(0x2001), bench.read(0x2002)], [0, 0], "2001h and 2002h at rest")


@check("at 60 r/min 6064h advances by 4000 pulses a second, and the rotor with it")
def pulses(bench):
    runs(bench, 60)
    mark = bench.trace.mark()
    first, rotor_first = bench.read(0x6064), bench.world("get")
    bench.sleep(0.8)
    second, rotor_second = bench.read(0x6064), bench.world("get")
    frames = bench.trace.since(mark, 0x581)
    near((second - first) / (frames[-1].timestamp - frames[0].timestamp), 4000, 20, "6064h a second")
    near((rotor(rotor_second) - rotor(rotor_first)) / (rotor_second["t"] - rotor_first["t"]), 4000, 60, "rotor a second")


@check("the target speed set before enabling is followed from operation enabled on")
def before_enabling(bench):
    bench.write(0x60FF, 90)
    bench.enable(VELOCITY)
    speed_becomes(bench, 90)


@check("acceleration takes the time of 6083h, and slowing down that of 6084h")
def ramps(bench):
    watch(bench, 0x606C)
    bench.write(0x6083, 800)
    bench.write(0x6084, 400)
    bench.enable(VELOCITY)
    for target, rest, expected in ((300, 0, 0.8), (0, 300, 0.4)):
        mark = bench.trace.mark()
        bench.write(0x60FF, target)
        speed_becomes(bench, target)
        seen = speeds(bench, mark)
        left = next(at for at, speed in seen if speed != rest)
        there = next(at for at, speed in seen if speed == target)
        # An S creeps into its ends, and 606Ch is in whole r/min: the ends look a little shorter.
        near(there - left, expected, 0.06, f"seconds to {target} r/min")


@check("the ramp begins at the start speed of 200Eh")
def start_speed(bench):
    watch(bench, 0x606C)
    bench.write(0x6083, 2000)
    bench.write(0x200E, 60)
    bench.enable(VELOCITY)
    mark = bench.trace.mark()
    bench.write(0x60FF, 200)
    eventually(lambda: bench.read(0x606C), lambda speed: speed > 80, "606Ch rises")
    first = next(speed for _, speed in speeds(bench, mark) if speed)
    true(58 <= first <= 64, f"the first speed is about 60 r/min, got {first}")


@check("no setting steps faster than 200 kHz: 468 r/min with 25600 pulses a turn")
def step_rate(bench):
    bench.write(0x2006, 7)
    bench.enable(VELOCITY)
    bench.write(0x60FF, 1000)
    eventually(lambda: bench.read(0x606C), lambda speed: speed >= 467, "606Ch")
    bench.sleep(0.3)
    true(bench.read(0x606C) <= 469, f"606Ch goes up to {bench.read(0x606C)}")
    mark = bench.trace.mark()
    first = bench.read(0x6064)
    bench.sleep(0.5)
    second = bench.read(0x6064)
    frames = bench.trace.since(mark, 0x581)
    rate = (second - first) / (frames[-1].timestamp - frames[0].timestamp)
    true(rate <= 200_500, f"{rate:.0f} pulses a second")


@check("a reversal passes through standstill and loses no step")
def reversal(bench):
    runs(bench, 200)
    bench.write(0x60FF, -200)
    speed_becomes(bench, -200)
    bench.write(0x60FF, 0)
    stands(bench)
    bench.sleep(0.2)
    near(rotor(bench.world("get")), bench.read(0x6064), 10, "where the rotor is")
