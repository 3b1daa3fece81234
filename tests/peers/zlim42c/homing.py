"""Homing 17, 18, 24 and 29 from every start of `homing.csv`, on every input (manual 5.3.6; CiA 402-2).

The axis has a negative limit below -3000, a home switch from -200 to 200 and a positive limit above 3000, in pulses. The
drive always wakes up at 0, so a start elsewhere moves the switches instead.
"""

import itertools

from checks import check, equal, near, true
from zlim42c.axis import HOME, HOMED, HOMING, NEGATIVE_LIMIT, POSITION, POSITIVE_LIMIT, REACHED, RUNNING, go, rotor, speed_becomes, watch
from zlim42c import rows

SWITCHES = {NEGATIVE_LIMIT: ("min", -3000), HOME: (-200, 200), POSITIVE_LIMIT: (3000, "max")}
#: Where a start is on the axis, and which switches it changes there.
STARTS = {
    "between": (1000, {}),
    "on_home": (0, {}),
    "on_negative_limit": (-3500, {}),
    "on_positive_limit": (3500, {}),
    "beyond_negative_limit": (-4000, {NEGATIVE_LIMIT: (-3000, -2500)}),
    "beyond_positive_limit": (4000, {POSITIVE_LIMIT: (2500, 3000)}),
    "both_limits_on": (0, {NEGATIVE_LIMIT: ("min", "max"), POSITIVE_LIMIT: ("min", "max")}),
    "below_home": (-1500, {}),
    "above_home": (1500, {}),
    "above_home_without_home_switch": (1500, {HOME: None}),
    "below_home_without_home_switch": (-1500, {HOME: None}),
    "home_on_at_negative_limit": (0, {HOME: ("min", 200)}),
    "no_input_configured": (0, {NEGATIVE_LIMIT: None, HOME: None, POSITIVE_LIMIT: None}),
    "bit_4_falls_on_the_way": (2900, {}),
    "halt_on_the_way": (2900, {}),
}
#: The edge that becomes the origin: where it is, and the direction in which it is crossed.
LATCHES = {17: (-3000, -1), 18: (3000, 1), 24: (-200, 1), 29: (-200, 1)}
FAST, SLOW, RAMP_MS = 300, 60, 30
#: An input is seen 10 ms late (3.2), which is 40 pulses at 60 r/min.
LATE = 40
OUTCOME = HOMED | REACHED | RUNNING


def wire(bench, start, first_input):
    """Puts the switches on inputs, beginning with any of them."""
    at, changes = STARTS[start]
    inputs = itertools.cycle(range(4))
    for _ in range(first_input):
        next(inputs)
    for function, place in (SWITCHES | changes).items():
        number = next(inputs)
        if place:
            low, high = (bound if isinstance(bound, str) else bound - at for bound in place)
            bench.write(0x2030, function, sub=2 + number)
            bench.world(f"switch X{number} {low} {high}")


def prepare(bench, method, offset):
    for index, sub, value in ((0x6098, 0, method), (0x6099, 1, FAST), (0x6099, 2, SLOW), (0x609A, 0, RAMP_MS), (0x607C, 0, offset)):
        bench.write(index, value, sub)
    watch(bench, 0x606C)
    bench.enable(HOMING)
    bench.sleep(0.05)


def expected_speeds(moves):
    """The speeds that the moves of a row run at, one after the other."""
    result = []
    for move in filter(None, moves.split(" | ")):
        direction, speed, _ = move.split()
        signed = (1 if direction == "positive" else -1) * {"6099:01": FAST, "6099:02": SLOW}[speed]
        if result[-1:] != [signed]:
            result.append(signed)
    return result


def speeds_held(bench, mark):
    """The speeds that the drive held for 10 ms and more since the mark, without standstills."""
    frames = bench.trace.since(mark, 0x181)
    result = []
    for frame, following in itertools.zip_longest(frames, frames[1:]):
        speed = int.from_bytes(frame.data[:4], "little", signed=True)
        held = following is None or following.timestamp - frame.timestamp > 0.01
        if speed and held and result[-1:] != [speed]:
            result.append(speed)
    return result


def outcome(bench, row):
    """Waits for the bits that the row ends with."""
    expected = HOMED * int(row["bit_8"]) | REACHED * int(row["bit_10"]) | RUNNING * int(row["bit_14"])
    if row["result"] == "running":
        bench.sleep(0.5)
        equal(bench.statusword() & OUTCOME, expected, "bits 8, 10 and 14 half a second later")
        return
    bench.status_becomes(OUTCOME, expected, "bits 8, 10 and 14 in the end", timeout_s=10)


def homes(number, row):
    method, start, offset = int(row["method"]), row["start"], (0, 700, -700)[number % 3]

    @check(f"homing {method}, start {start.replace('_', ' ')}: {row['result']}")
    def run(bench):
        wire(bench, start, number % 4)
        prepare(bench, method, offset)
        mark = bench.trace.mark()
        equal(bench.statusword() & OUTCOME, 0, "bits 8, 10 and 14 before the first homing")
        bench.write(0x6040, 0x1F)
        if start == "bit_4_falls_on_the_way":
            bench.sleep(0.1)
            bench.write(0x6040, 0x0F)
        if start == "halt_on_the_way":
            bench.sleep(0.1)
            bench.write(0x6040, 0x011F)
        outcome(bench, row)
        # A limit that is on already may end the run before its first step.
        expected = expected_speeds(row["moves"]) if "no step" not in row["note"] else []
        equal(speeds_held(bench, mark), expected, "speeds of the moves, in r/min")
        place = bench.world("get")
        if row["result"] == "attained":
            edge, direction = LATCHES[method]
            origin = STARTS[start][0] + rotor(place) - bench.read(0x6064) - offset
            near(origin, edge + direction * LATE, 20, "the place where 6064h became -607Ch")
            equal(bench.read(0x6064), -offset, "6064h: it stops when the switch is found")
            true(bench.read(0x2003), "the motor stands on the switch")
        elif row["result"] != "running":
            bench.sleep(0.2)  # a rotor that was stopped at once rings for a while
            place = bench.world("get")
            near(rotor(place), bench.read(0x6064), 12, "6064h keeps its origin")

    return run


for _number, _row in enumerate(rows("homing.csv")):
    homes(_number, _row)


@check("a halted homing goes on when bit 8 of the controlword falls")
def goes_on(bench):
    wire(bench, "between", 0)
    prepare(bench, 17, 0)
    bench.write(0x6040, 0x1F)
    bench.sleep(0.1)
    bench.write(0x6040, 0x011F)
    bench.status_becomes(OUTCOME, REACHED, "bits 8, 10 and 14 under halt")
    bench.write(0x6040, 0x1F)
    bench.status_becomes(OUTCOME, HOMED | REACHED, "bits 8, 10 and 14 in the end")


@check("halt in homing takes the time of 609Ah, not that of 6084h")
def halt_ramp(bench):
    prepare(bench, 17, 0)
    bench.write(0x609A, 600)
    bench.write(0x6084, 50)
    bench.write(0x6040, 0x1F)
    speed_becomes(bench, -FAST)
    mark = bench.trace.mark()
    bench.write(0x6040, 0x011F)
    given = bench.trace.wait(0x581, mark, 3.0, "the answer to the controlword").timestamp
    bench.status_becomes(OUTCOME, REACHED, "bits 8, 10 and 14 under halt")
    still = lambda frame: not any(frame.data[:4])
    near(bench.trace.wait(0x181, mark, 3.0, "606Ch becomes 0", still).timestamp - given, 0.6, 0.04, "seconds to standstill")


@check("homing can be repeated, and finds the same place again")
def repeated(bench):
    wire(bench, "between", 2)
    prepare(bench, 29, 0)
    origins = []
    for _ in range(3):
        bench.write(0x6040, 0x0F)
        bench.write(0x6040, 0x1F)
        bench.sleep(0.1)
        bench.status_becomes(OUTCOME, HOMED | REACHED, "bits 8, 10 and 14 in the end", timeout_s=10)
        bench.sleep(0.1)
        origins.append(rotor(bench.world("get")) - bench.read(0x6064))
    true(max(origins) - min(origins) <= 12, f"the same origin each time, got {origins}")


@check("a slower search speed finds the edge more exactly")
def exactness(bench):
    wire(bench, "between", 1)
    prepare(bench, 17, 0)
    bench.write(0x6099, 6, sub=2)
    bench.write(0x6099, 60, sub=1)
    bench.write(0x6040, 0x1F)
    bench.status_becomes(OUTCOME, HOMED | REACHED, "bits 8, 10 and 14 in the end", timeout_s=15)
    origin = 1000 + rotor(bench.world("get")) - bench.read(0x6064)
    near(origin, -3000 - LATE / 10, 8, "the place where 6064h became 0")


@check("after homing with an offset, an absolute move to 0 goes to the place beside the switch")
def to_the_origin(bench):
    wire(bench, "between", 0)
    prepare(bench, 17, 1000)
    bench.write(0x6040, 0x1F)
    bench.status_becomes(OUTCOME, HOMED | REACHED, "bits 8, 10 and 14 in the end")
    bench.write(0x6040, 0x0F)
    bench.enable(POSITION)
    go(bench, 0, relative=False)
    bench.sleep(0.1)
    near(1000 + rotor(bench.world("get")), -3000 - LATE + 1000, 20, "where the rotor is on the axis")


@check("the home switch works at either level: 2030h:01 inverts it")
def inverted(bench):
    bench.write(0x2030, 0b0001, sub=1)
    bench.write(0x2030, NEGATIVE_LIMIT, sub=2)
    # Active while the level is 0, so the level is 1 above the limit.
    bench.world("switch X0 -4000 max")
    prepare(bench, 17, 0)
    bench.write(0x6040, 0x1F)
    bench.status_becomes(OUTCOME, HOMED | REACHED, "bits 8, 10 and 14 in the end")
    near(rotor(bench.world("get")) - bench.read(0x6064), -4000 - LATE, 20, "the place where 6064h became 0")
