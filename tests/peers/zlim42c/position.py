"""Profile position on S-curves (manual 5.3.4 and 5.4; CiA 402-2)."""

import time

from checks import check, equal, near, true
from sweeps import BAD_VALUE, TOO_HIGH, TOO_LOW
from zlim42c.axis import ACKNOWLEDGE, IN_POSITION, POSITION, PULSES_PER_SECOND, REACHED, RUNNING, go, rotor, running_time, set_point, stands, watch

#: 200Eh and 6082h as delivered, in r/min.
START_SPEED, END_SPEED = 5, 10


@check("relative set-points add up, and 6064h counts every pulse")
def relative(bench):
    bench.write(0x6081, 300)
    bench.enable(POSITION)
    for expected, step in ((3200, 3200), (6400, 3200), (-600, -7000)):
        go(bench, step, relative=True)
        equal(bench.read(0x6064), expected, "6064h")
    near(rotor(bench.world("get")), -600, 10, "where the rotor is")


@check("absolute set-points lead to the same place from everywhere")
def absolute(bench):
    bench.write(0x6081, 300)
    bench.enable(POSITION)
    for target in (5000, 5000, -5000, 0):
        go(bench, target, relative=False)
        equal(bench.read(0x6064), target, "6064h")
    near(rotor(bench.world("get")), 0, 10, "where the rotor is")


@check("as delivered, 0Fh and 1Fh go to 5000 pulses at 120 r/min")
def as_delivered(bench):
    bench.enable(POSITION)
    bench.write(0x6040, 0x1F)
    time.sleep(0.4)
    equal(bench.read(0x606C), 120, "606Ch on the way")
    stands(bench)
    equal(bench.read(0x6064), 5000, "6064h")


@check("bits 10, 12, 14 and 15 tell: under way, acknowledged, running, arrived")
def bits(bench):
    bench.enable(POSITION)
    bench.write(0x607A, 8000)
    bench.write(0x6040, 0x1F)
    all_bits = REACHED | ACKNOWLEDGE | RUNNING | IN_POSITION
    bench.status_becomes(all_bits, ACKNOWLEDGE | RUNNING, "the bits on the way")
    bench.write(0x6040, 0x0F)
    bench.status_becomes(all_bits, RUNNING, "the bits once bit 4 is 0 again")
    bench.status_becomes(all_bits, REACHED | IN_POSITION, "the bits on arrival", 10)
    equal(bench.read(0x6064), 8000, "6064h")


@check("bit 11 mirrors bit 4 of the controlword")
def mirror(bench):
    bench.enable(POSITION)
    for controlword, bit in ((0x0F, 0), (0x1F, 1 << 11), (0x0F, 0)):
        bench.write(0x6040, controlword)
        bench.status_becomes(1 << 11, bit, f"bit 11 after {controlword:02X}h")


def duration(pulses, r_min, up_ms, down_ms, start_r_min=START_SPEED, end_r_min=END_SPEED):
    """Closed form: an S that is symmetric covers its time at the mean of its two speeds."""
    speed, start, end = (v * PULSES_PER_SECOND for v in (r_min, start_r_min, end_r_min))
    up, down = up_ms / 1000, down_ms / 1000
    cruise = abs(pulses) - (start + speed) / 2 * up - (speed + end) / 2 * down
    return up + down + cruise / speed


def timed_move(bench, pulses, r_min, up_ms, down_ms):
    for index, value in ((0x6081, r_min), (0x6083, up_ms), (0x6084, down_ms)):
        bench.write(index, value)
    mark = bench.trace.mark()
    go(bench, pulses, relative=True)
    return running_time(bench, mark)


@check("a move takes the time that speed, ramps, start speed and distance give in closed form")
def durations(bench):
    watch(bench, 0x6041)
    bench.enable(POSITION)
    for pulses, r_min, up_ms, down_ms in ((3200, 60, 100, 100), (12000, 300, 400, 200), (-16000, 600, 300, 500), (2000, 60, 0, 0)):
        before = bench.read(0x6064)
        took = timed_move(bench, pulses, r_min, up_ms, down_ms)
        near(took, duration(pulses, r_min, up_ms, down_ms), 0.012, f"seconds for {pulses} at {r_min} r/min, ramps {up_ms} and {down_ms} ms")
        equal(bench.read(0x6064) - before, pulses, "pulses")


@check("200Eh is where a move's speed begins, and 6082h where it ends")
def start_and_end_speeds(bench):
    watch(bench, 0x6041)
    bench.enable(POSITION)
    for start, end in ((100, 200), (300, 5), (2, 250)):
        bench.write(0x200E, start)
        bench.write(0x6082, end)
        took = timed_move(bench, 16000, 300, 400, 400)
        near(took, duration(16000, 300, 400, 400, start, end), 0.012, f"seconds from {start} r/min and to {end} r/min")


@check("start and end speeds above 6081h do not make a move faster than 6081h")
def slow_move(bench):
    watch(bench, 0x6041, 0x606C)
    bench.write(0x200E, 300)
    bench.write(0x6082, 3000)
    bench.enable(POSITION)
    mark = bench.trace.mark()
    took = timed_move(bench, 2000, 30, 100, 100)
    near(took, 1.0, 0.012, "seconds for half a turn at 30 r/min")
    fastest = max(abs(int.from_bytes(frame.data[2:6], "little", signed=True)) for frame in bench.trace.since(mark, 0x181))
    equal(fastest, 30, "greatest 606Ch")


@check("the ramp is an S: it gains little speed in its first and last tenth, and half of it in the middle")
def s_shape(bench):
    watch(bench, 0x6041, 0x606C)
    bench.write(0x6081, 500)
    bench.write(0x6083, 1000)
    bench.enable(POSITION)
    mark = bench.trace.mark()
    go(bench, 40000, relative=True)
    seen = [(frame.timestamp, int.from_bytes(frame.data[2:6], "little", signed=True)) for frame in bench.trace.since(mark, 0x181)]
    began = next(at for at, speed in seen if speed)
    at = lambda after: [speed for time_s, speed in seen if time_s <= began + after][-1]
    near(at(0.5), (500 + START_SPEED) / 2, 12, "r/min in the middle of the ramp")
    gain = 500 - START_SPEED
    true(at(0.1) - START_SPEED < 0.08 * gain, f"a straight ramp gains 10 % in its first tenth, an S less; got {at(0.1)} r/min")
    true(500 - at(0.9) < 0.08 * gain, f"a straight ramp gains 10 % in its last tenth, an S less; got {at(0.9)} r/min at nine tenths")
    equal(at(1.02), 500, "r/min after the ramp")


@check("a move too short for full speed arrives, without reaching the speed, in less than both ramps")
def too_short(bench):
    watch(bench, 0x6041, 0x606C)
    bench.enable(POSITION)
    for pulses in (4000, -1000, 100):
        mark = bench.trace.mark()
        before = bench.read(0x6064)
        took = timed_move(bench, pulses, 600, 500, 500)
        equal(bench.read(0x6064) - before, pulses, "pulses")
        fastest = max(abs(int.from_bytes(frame.data[2:6], "little", signed=True)) for frame in bench.trace.since(mark, 0x181))
        true(fastest < 600, f"{pulses} pulses reached {fastest} r/min")
        true(abs(pulses) / (fastest * PULSES_PER_SECOND) < took < 1.02, f"{pulses} pulses took {took:.3f} s, at most {fastest} r/min")


@check("a second set-point waits for the first when bit 5 is 0")
def queued(bench):
    bench.write(0x6081, 300)
    bench.enable(POSITION)
    set_point(bench, 10000, relative=False)
    set_point(bench, 2000, relative=False)
    furthest = 0
    end = bench.now() + 8
    while bench.statusword() & (RUNNING | REACHED) != REACHED and bench.now() < end:
        furthest = max(furthest, bench.read(0x6064))
    equal(bench.read(0x6064), 2000, "6064h in the end")
    true(furthest > 9000, f"the first set-point of 10000 was followed, got to {furthest}")


@check("a second set-point replaces the first when bit 5 is 1")
def immediately(bench):
    bench.write(0x6081, 300)
    bench.enable(POSITION)
    set_point(bench, 100_000, relative=False)
    set_point(bench, 20000, relative=False, immediately=True)
    bench.status_becomes(REACHED, REACHED, "bit 10")
    stands(bench)
    equal(bench.read(0x6064), 20000, "6064h")


@check("607Ah takes a million pulses either way and no more")
def range_of_target(bench):
    for value, codes in ((1_000_001, (BAD_VALUE, TOO_HIGH)), (-1_000_001, (BAD_VALUE, TOO_LOW))):
        code = bench.abort_code(bench.write, 0x607A, value)
        true(code in codes, f"607Ah = {value}: abort {code and hex(code)}")
        equal(bench.read(0x607A), 5000, "607Ah")


@check("2012h = 1 makes the present position 0, so that absolute set-points count from there")
def clear_position(bench):
    bench.write(0x6081, 300)
    bench.enable(POSITION)
    go(bench, 3000, relative=False)
    bench.write(0x2012, 1)
    equal(bench.read(0x6064), 0, "6064h")
    equal(bench.read(0x2012), 0, "2012h")
    go(bench, 1000, relative=False)
    near(rotor(bench.world("get")), 4000, 10, "where the rotor is")


@check("each microstep setting of 2006h turns the motor once with its number of pulses")
def microsteps(bench):
    table = {int(row["row"]): int(row["value"]) for row in bench.drive.rows("models.csv") if row["table"] == "microstep" and row["quantity"] == "pulses_per_turn"}
    equal(sorted(table), list(range(16)), "settings in the manual")
    bench.write(0x6081, 300)
    for setting, pulses in table.items():
        bench.write(0x6040, 0)
        bench.write(0x2006, setting)
        before = rotor(bench.world("get"))
        bench.enable(POSITION)
        go(bench, pulses, relative=True)
        time.sleep(0.05)
        near(rotor(bench.world("get")) - before, 4000, 45, f"way of the rotor with 2006h = {setting}, in 1/4000 turns")
