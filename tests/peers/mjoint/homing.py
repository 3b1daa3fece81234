"""Homing 17 to 22 from every start of `homing.csv`, with switches on PU and DIR (manual 5.09; CiA 402-2)."""

from checks import check, equal, eventually, near, true
from mjoint import rows
from mjoint.joint import COUNTS_PER_TURN, HOMING, ORIGIN_FOUND, POSITION, absolute, command, is_at, shaft, speed_becomes

#: The terminal of each method, and on which side of its edge it is active.
SWITCHES = {17: ("DIR", -1), 18: ("PU", 1), 19: ("DIR", 1), 20: ("DIR", 1), 21: ("DIR", -1), 22: ("DIR", -1)}
#: How far the edge is from the start, in counts.
WAY = 16_000
#: 6083h: 100 r/min for homing in the ones digit; a ramp of 0.1 s, so that the way back from an edge can be seen.
RAMP = 1000
#: The same as delivered: 20000 (r/min)/s.
DELIVERED_OVERSHOOT = 32768 * 100 / 60 * 0.005 / 2
OVERSHOOT = 32768 * 100 / 60 * 0.1 / 2
#: At 100 r/min a millisecond is 55 counts.
CLOSE = 120


def place_switch(bench, method, start):
    """Commands the switch and returns where its edge is."""
    terminal, side = SWITCHES[method]
    here = bench.read(0x6064)
    if start == "beyond_switch":
        near_end, far_end = here + side * -4000, here + side * -9000
        bench.world(f"switch {terminal} {min(near_end, far_end)} {max(near_end, far_end)}")
        return None
    edge = here + side * WAY * (-1 if start == "on_switch" else 1)
    bench.world(f"switch {terminal} " + (f"{edge} max" if side > 0 else f"min {edge}"))
    return edge


def directions(moves):
    result = []
    for move in moves.split(" | "):
        direction = 1 if move.startswith("positive") else -1
        if result[-1:] != [direction]:
            result.append(direction)
    return result


def watch_directions(bench, until, timeout_s=12):
    """The directions in which the motor turns at no less than half the homing speed, until the statusword is so."""
    seen = []
    end = bench.now() + timeout_s
    while bench.now() < end:
        speed = bench.read(0x606C)
        direction = 1 if speed > 0 else -1
        if abs(speed) > 500 and seen[-1:] != [direction]:
            seen.append(direction)
        if until(bench.statusword()):
            break
    return seen


def homes(row):
    method, start = int(row["method"]), row["start"]

    @check(f"homing {method}, start {start.replace('_', ' ')}: {row['result']}")
    def run(bench):
        edge = place_switch(bench, method, start)
        origin = bench.read(0x6064) - shaft(bench)
        bench.write(0x6083, RAMP)
        bench.write(0x6098, method)
        bench.write(0x6060, HOMING)
        equal(bench.statusword(), int(row["statusword_running"], 16), "statusword on the way")
        if row["result"] == "running":
            seen = watch_directions(bench, lambda word: False, timeout_s=0.6)
            equal(seen, directions(row["moves"]), "directions of the moves")
            equal(bench.statusword(), int(row["statusword_after"], 16), "statusword later")
            return
        after = int(row["statusword_after"], 16)
        seen = watch_directions(bench, lambda word: word == after)
        equal(seen, directions(row["moves"]), "directions of the moves")
        equal(bench.statusword(), after, "statusword in the end")
        bench.sleep(0.3)
        near(bench.read(0x6064), 0, CLOSE, "6064h in the end")
        near(abs(origin + shaft(bench) - bench.read(0x6064) - edge), OVERSHOOT, 800, "the place where 6064h is 0, a ramp beyond the edge")

    return run


for _row in rows("homing.csv"):
    if _row["start"] in ("off_switch", "on_switch", "beyond_switch"):
        homes(_row)


@check("homing leaves the switch that it does not use alone: 17 ignores PU, 18 ignores DIR")
def other_terminal(bench):
    bench.world("input PU 1")
    edge = place_switch(bench, 17, "off_switch")
    origin = bench.read(0x6064) - shaft(bench)
    bench.write(0x6098, 17)
    bench.write(0x6060, HOMING)
    bench.status_becomes(ORIGIN_FOUND, ORIGIN_FOUND, "bit 12", 12)
    bench.sleep(0.3)
    near(origin + shaft(bench) - bench.read(0x6064), edge + DELIVERED_OVERSHOOT, CLOSE, "the place where 6064h is 0")


@check("the ones digit of 6083h is the homing speed: 0 is 100 r/min, 5 is 600 r/min")
def speed(bench):
    for digit, r_min in ((0, 100), (5, 600)):
        bench.write(0x6083, 30_000 + digit)
        bench.write(0x6098, 17)
        bench.write(0x6060, HOMING)
        speed_becomes(bench, -r_min)
        bench.write(0x6060, POSITION)
        speed_becomes(bench, 0)


@check("leaving mode 6 on the way ends homing: the motor stops and the position keeps its origin")
def left(bench):
    before = bench.read(0x6064) - shaft(bench)
    bench.write(0x6060, HOMING)
    speed_becomes(bench, -100)
    bench.write(0x6060, POSITION)
    speed_becomes(bench, 0)
    bench.status_becomes(0xFFFF, 0x0404, "the statusword")
    near(bench.read(0x6064) - shaft(bench), before, CLOSE, "the origin")


@check("a mechanical stop on the way is an alarm, and the statusword tells that no origin was found")
def stalled(bench):
    bench.write(0x2618, 101)
    bench.write(0x6060, HOMING)
    speed_becomes(bench, -100)
    bench.world("rotor lock")
    eventually(lambda: bench.read(0x260E), lambda code: code == 0x14, "260Eh", 10)
    row = next(row for row in rows("homing.csv") if row["start"] == "stalls_on_the_way")
    bench.status_becomes(0xFFFF, int(row["statusword_after"], 16), "the statusword")


@check("after homing the joint goes to absolute positions from the new origin")
def then_moves(bench):
    edge = place_switch(bench, 17, "off_switch")
    origin = bench.read(0x6064) - shaft(bench)
    bench.write(0x6060, HOMING)
    bench.status_becomes(ORIGIN_FOUND, ORIGIN_FOUND, "bit 12", 12)
    absolute(bench, COUNTS_PER_TURN)
    bench.sleep(0.3)
    near(origin + shaft(bench), edge + DELIVERED_OVERSHOOT + COUNTS_PER_TURN, CLOSE, "where the motor is")


@check("homing can be started again, by writing 6 again")
def again(bench):
    place_switch(bench, 17, "off_switch")
    for _ in range(2):
        bench.write(0x6060, HOMING)
        bench.status_becomes(ORIGIN_FOUND, 0, "bit 12 on the way")
        bench.status_becomes(ORIGIN_FOUND, ORIGIN_FOUND, "bit 12", 12)
        true(abs(bench.read(0x6064)) < 1500, f"6064h near the origin, got {bench.read(0x6064)}")
    command(bench, POSITION, 0x2F)
    bench.write(0x607A, 5000)
    is_at(bench, 5000)
