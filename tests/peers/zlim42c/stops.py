"""Halt, quick stop and the option codes 605Ah to 605Dh (manual 5.3.1, 5.3.4, 5.3.5 and 5.4; CiA 402-2)."""

from checks import check, equal, eventually, near, true
from zlim42c.axis import POSITION, POWER_STATE, PULSES_PER_SECOND, REACHED, RUNNING, VELOCITY, go, runs, set_point, speed_becomes, stands, watch

NORMAL_MS, URGENT_MS = 800, 300
SPEED = 300


def stopping_time(bench, controlword):
    """Runs at speed, gives a controlword, and returns the simulated seconds from its answer to standstill."""
    bench.write(0x6084, NORMAL_MS)
    bench.write(0x6085, URGENT_MS)
    runs(bench, SPEED)
    watch(bench, 0x6041)
    mark = bench.trace.mark()
    bench.write(0x6040, controlword)
    given = bench.trace.wait(0x581, mark, 3.0, "the answer to the controlword")
    stands(bench)
    still = lambda frame: frame.timestamp > given.timestamp and not int.from_bytes(frame.data[:2], "little") & RUNNING
    return bench.trace.wait(0x181, mark, 5.0, "bit 14 falls", still).timestamp - given.timestamp


def stops_as_told(bench, controlword, index, ways, then):
    """Each value of an option code stops in its own time and ends in the same state."""
    for code, expected in ways:
        bench.write(index, code)
        near(stopping_time(bench, controlword), expected, 0.03, f"seconds with {index:04X}h = {code}")
        bench.status_becomes(POWER_STATE, then, f"the state after the stop with {index:04X}h = {code}")
        equal(bench.read(0x606C), 0, "606Ch")
        bench.write(0x60FF, 0)
        bench.write(0x6040, 0x0F)


@check("halt stops as 605Dh says, in 6084h or in 6085h, and stays enabled")
def halt(bench):
    ways = ((1, NORMAL_MS / 1000), (2, URGENT_MS / 1000), (3, URGENT_MS / 1000))
    stops_as_told(bench, 0x010F, 0x605D, ways, 0x2237)


@check("quick stop stops as 605Ah says, in 6084h or in 6085h, and stays in quick stop active")
def quick_stop(bench):
    ways = ((5, NORMAL_MS / 1000), (6, URGENT_MS / 1000), (7, URGENT_MS / 1000))
    stops_as_told(bench, 0x0002, 0x605A, ways, 0x2217)


@check("shutdown slows down first with 605Bh = 1, and lets go at once with 0")
def shutdown(bench):
    near(stopping_time(bench, 0x0006), NORMAL_MS / 1000, 0.03, "seconds with 605Bh = 1")
    bench.status_becomes(POWER_STATE, 0x0231, "the state after the stop")
    bench.write(0x605B, 0)
    near(stopping_time(bench, 0x0006), 0, 0.03, "seconds with 605Bh = 0")
    bench.status_becomes(POWER_STATE, 0x0231, "the state")


@check("disable operation slows down first with 605Ch = 1, and lets go at once with 0")
def disable_operation(bench):
    near(stopping_time(bench, 0x0007), NORMAL_MS / 1000, 0.03, "seconds with 605Ch = 1")
    bench.status_becomes(POWER_STATE, 0x2233, "the state after the stop")
    bench.write(0x605C, 0)
    near(stopping_time(bench, 0x0007), 0, 0.03, "seconds with 605Ch = 0")
    bench.status_becomes(POWER_STATE, 0x2233, "the state")


@check("disable voltage releases the motor at once")
def disable_voltage(bench):
    near(stopping_time(bench, 0x0000), 0, 0.03, "seconds")
    bench.status_becomes(POWER_STATE, 0x0270, "the state")


@check("halt in profile velocity sets bit 10 at standstill, and the motor goes on without halt")
def halt_in_velocity(bench):
    bench.write(0x6084, 1000)
    runs(bench, SPEED)
    bench.write(0x6040, 0x010F)
    bench.status_becomes(REACHED | RUNNING, RUNNING, "bit 10 while slowing down")
    bench.status_becomes(REACHED | RUNNING, REACHED, "bit 10 at standstill")
    bench.write(0x6040, 0x000F)
    speed_becomes(bench, SPEED)


@check("halt in profile position interrupts the move, and the move ends at its target without halt")
def halt_in_position(bench):
    bench.enable(POSITION)
    set_point(bench, 10000, relative=False)
    bench.sleep(0.3)
    bench.write(0x6040, 0x010F)
    bench.status_becomes(REACHED | RUNNING, REACHED, "bit 10 at standstill under halt")
    halted = bench.read(0x6064)
    true(0 < halted < 10000, f"halted at {halted}")
    bench.sleep(0.2)
    equal(bench.read(0x6064), halted, "6064h under halt")
    bench.write(0x6040, 0x000F)
    stands(bench)
    bench.status_becomes(REACHED, REACHED, "bit 10 at the target")
    equal(bench.read(0x6064), 10000, "6064h")


@check("quick stop in profile position ends the move, and Fh enables again for the next")
def quick_stop_in_position(bench):
    bench.enable(POSITION)
    set_point(bench, 40000, relative=False)
    bench.sleep(0.3)
    bench.write(0x6040, 0x0002)
    bench.status_becomes(POWER_STATE, 0x2217, "quick stop active")
    stands(bench)
    stopped = bench.read(0x6064)
    true(0 < stopped < 40000, f"stopped at {stopped}")
    bench.write(0x6040, 0x000F)
    bench.status_becomes(POWER_STATE, 0x2237, "operation enabled")
    bench.sleep(0.3)
    equal(bench.read(0x6064), stopped, "6064h: the old set-point is gone")
    go(bench, 1000, relative=True)
    equal(bench.read(0x6064), stopped + 1000, "6064h")


@check("a halt with 605Dh = 1 from 300 r/min covers the way of a ramp of 6084h")
def halt_way(bench):
    bench.write(0x6084, 600)
    runs(bench, SPEED)
    before = bench.read(0x6064)
    bench.write(0x6040, 0x010F)
    stands(bench)
    # The mean of the speeds at its ends, plus what the motor went between the two SDO transfers.
    way = SPEED * PULSES_PER_SECOND * 0.6 / 2
    went = bench.read(0x6064) - before
    true(way * 0.97 <= went <= way + SPEED * PULSES_PER_SECOND * 0.25, f"{way} pulses and little more, got {went}")


@check("a mode written while the motor runs is shown and taken at standstill")
def mode_change(bench):
    runs(bench, 120)
    bench.write(0x6060, POSITION)
    bench.sleep(0.3)
    equal(bench.read(0x6061), VELOCITY, "6061h while running")
    bench.write(0x60FF, 0)
    stands(bench)
    eventually(lambda: bench.read(0x6061), lambda mode: mode == POSITION, "6061h at standstill")
    go(bench, 500, relative=True)
