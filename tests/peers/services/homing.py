"""Homing: each run of `homing.csv` that begins off its switch and attains its origin (ZLIM42-C, 5.3.6; joint, 5.09)."""

import math

from checks import check, equal, near
from drive import MJOINT, ZLIM42C

#: Pulses of a turn, and where the edges of the axis are from where the rotor starts. An input is seen 10 ms late (3.2):
#: 40 pulses at the 60 r/min of 6099h:02.
STEPPER_TURN, LIMIT, HOME, LATE = 4000, 3000, 500, 40
#: Counts of a turn; 100 r/min are slowed down with 20000 (r/min)/s in 137 counts.
JOINT_TURN, EDGE, WAY = 32_768, 16_000, 137


def runs(start):
    return lambda drive: [row for row in drive.rows("homing.csv") if row["start"] == start and row["result"] == "attained"]


def shaft(bench, turn):
    """Where the shaft truly is, in counts from where it stood at the start of the simulation."""
    return bench.world("get")["shaft_angle_rad"] / math.tau * turn


def direction(word):
    return 1 if word == "positive" else -1


@check("homing {method} finds the edge that its row names, and an absolute move then goes to the place of the offset", ZLIM42C, rows=runs("between"))
def stepper(bench, row):
    places = ((1, f"{-HOME - 400} {-HOME}"), (2, f"{LIMIT} max"), (3, f"min {-LIMIT}"))
    for number, (function, place) in enumerate(places):
        bench.write(0x2030, function, sub=2 + number)
        bench.world(f"switch X{number} {place}")
    switch, _, way = row["latch"].split()
    # From a limit the motor can only go away.
    offset = -700 * direction(way)
    bench.write_all(((0x6098, 0, int(row["method"])), (0x607C, 0, offset), (0x6099, 1, 200), (0x6099, 2, 60)))
    bench.enable(6)
    bench.status_becomes(0x4500, 0, "neither attained nor running before the first homing")
    bench.write(0x6040, 0x1F)
    bench.status_becomes(0x4500, 0x0500, "attained and reached", 20)
    edge = {"negative_limit": -LIMIT, "positive_limit": LIMIT, "home": -HOME - (400 if way == "positive" else 0)}[switch]
    bench.sleep(0.1)
    origin = shaft(bench, STEPPER_TURN) - bench.read(0x6064) - offset
    near(origin, edge + direction(way) * LATE, 20, "the place where 6064h became -607Ch")
    equal(bench.read(0x6064), -offset, "6064h: it stops when the switch is found")
    bench.write(0x6040, 0x0F)
    bench.enable(1)
    bench.move(0)
    near(shaft(bench, STEPPER_TURN), edge + direction(way) * LATE + offset, 20, "where the rotor is on the axis")


@check("homing {method} finds the edge that its row names, and an absolute move then counts from there", MJOINT, rows=runs("off_switch"))
def joint(bench, row):
    terminal, _, way = row["latch"].split()
    side = direction(row["moves"].split()[0])
    here, begin = bench.read(0x6064), shaft(bench, JOINT_TURN)
    edge = here + side * EDGE
    bench.world(f"switch {terminal.upper()} " + (f"{edge} max" if side > 0 else f"min {edge}"))
    bench.write(0x6098, int(row["method"]))
    bench.write(0x6060, 6)
    equal(bench.statusword(), int(row["statusword_running"], 16), "statusword on the way")
    bench.status_becomes(0xFFFF, int(row["statusword_after"], 16), "statusword in the end", 20)
    bench.enable(1)
    bench.move(JOINT_TURN)
    bench.sleep(0.3)
    origin = begin + side * EDGE + direction(way) * WAY
    near(shaft(bench, JOINT_TURN), origin + JOINT_TURN, 120, "where the motor is")
