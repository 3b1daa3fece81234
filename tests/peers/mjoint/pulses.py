"""Pulse and direction, encoder follow, duty cycle, electronic gear and the ZO output (manual, wiring 2 and 3; 5.04)."""

from checks import check, equal, eventually, near, true
from mjoint.joint import COUNTS_PER_TURN, POSITION, absolute, command, save, speed_becomes, turned

CLOSE = 80


def settles(bench, start, counts, what):
    close = lambda now: abs(now - start - counts) <= CLOSE
    eventually(lambda: bench.read(0x6064), close, f"{what}: {start + counts} in 6064h", timeout_s=10)


@check("8192 pulses are a turn with the gear as delivered, 32768 to 8192")
def as_delivered(bench):
    start = bench.read(0x6064)
    bench.world("pulses 8192 20000")
    settles(bench, start, COUNTS_PER_TURN, "a turn forward")
    bench.world("pulses -16384 20000")
    settles(bench, start, -COUNTS_PER_TURN, "two turns back")


@check("260Ah over 260Bh is the gear: 3200 pulses a turn, as in the manual's example")
def gear(bench):
    bench.write(0x260A, 32768)
    bench.write(0x260B, 3200)
    start = bench.read(0x6064)
    bench.world("pulses 3200 10000")
    settles(bench, start, COUNTS_PER_TURN, "a turn")
    bench.write(0x260A, 256)
    bench.write(0x260B, 25)
    bench.world("pulses 3200 10000")
    settles(bench, start, 2 * COUNTS_PER_TURN, "a turn with 256 to 25")


@check("2609h turns the direction of pulses around")
def polarity(bench):
    start = bench.read(0x6064)
    bench.write(0x2609, 1)
    bench.sleep(0.1)
    bench.world("pulses 8192 20000")
    settles(bench, start, -COUNTS_PER_TURN, "a turn backward")


@check("the gear does not act on positions of CANopen")
def gear_on_can(bench):
    bench.write(0x260B, 3200)
    absolute(bench, 50_000)


@check("136533 pulses a second turn the motor at 1000 r/min, as the manual reckons")
def frequency(bench):
    bench.world("pulses 400000 136533")
    speed_becomes(bench, 1000)
    bench.sleep(0.3)
    near(bench.read(0x606C), 10_000, 300, "606Ch")


@check("bit 0 of the controlword, and 2600h = 1, make pulses invalid")
def invalid(bench):
    command(bench, POSITION, 0x0F)
    start = bench.read(0x6064)
    bench.world("pulses 8192 20000")
    bench.sleep(0.8)
    turned(bench, start, 0, "counts with 6040h = 0Fh", CLOSE)
    bench.write(0x6040, 0)
    bench.write(0x2600, 1)
    start = bench.read(0x6064)
    bench.world("pulses 8192 20000")
    bench.sleep(0.8)
    turned(bench, start, 0, "counts with 2600h = 1", CLOSE)


@check("2619h = 9, and 260Ah = 0, saved, make pulses invalid from power-on")
def invalid_from_power_on(bench):
    for index, value in ((0x2619, 9), (0x260A, 0)):
        bench.write(0x2619, 0)
        bench.write(index, value)
        save(bench)
        bench.power_cycle()
        equal(bench.read(0x2600), 1, f"2600h after power-on with {index:04X}h = {value}")
        start = bench.read(0x6064)
        bench.world("pulses 8192 20000")
        bench.sleep(0.8)
        turned(bench, start, 0, f"counts with {index:04X}h = {value}", CLOSE)


@check("2619h = 2, saved, follows an encoder after power-on, both ways")
def quadrature(bench):
    bench.write(0x2619, 2)
    save(bench)
    bench.power_cycle()
    start = bench.read(0x6064)
    bench.world("quadrature 8192 20000")
    bench.sleep(1.5)
    forward = bench.read(0x6064) - start
    true(forward > COUNTS_PER_TURN / 8, f"the motor follows forward, by {forward} counts")
    bench.world("quadrature -8192 20000")
    bench.sleep(1.5)
    near(bench.read(0x6064), start, CLOSE, "6064h after as many counts back")
    bench.write(0x260B, 4096)
    bench.world("quadrature 8192 20000")
    bench.sleep(1.5)
    near(bench.read(0x6064) - start, 2 * forward, CLOSE, "counts with half the denominator")


@check("the duty cycle sets the speed with 2619h = 1: 10 % to 90 % are 0 to 1000 r/min")
def duty(bench):
    bench.write(0x2619, 1)
    save(bench)
    bench.power_cycle()
    for percent, r_min in ((50, 500), (90, 1000), (30, 250), (10, 0)):
        bench.world(f"duty {percent}")
        speed_becomes(bench, r_min)
        bench.sleep(0.3)
        near(bench.read(0x606C) / 10, r_min, 12 + r_min * 0.02, f"r/min at {percent} %")


@check("a slope under 60000 limits how fast pulses are followed, and one from 60000 on does not")
def curve(bench):
    lags = []
    for slope in (1000, 60000):
        bench.write(0x6083, slope)
        start = bench.read(0x6064)
        begin = bench.now()
        bench.world("pulses 16384 80000")
        eventually(lambda: bench.read(0x6064), lambda now: abs(now - start - 2 * COUNTS_PER_TURN) < 2 * CLOSE, "two turns", 10)
        lags.append(bench.now() - begin)
    # Two turns at 586 r/min take 0.2 s; from rest to rest at 1000 r/min/s they take 0.69 s.
    true(lags[0] > 0.55, f"with the ramp {lags[0]:.2f} s")
    true(lags[1] < 0.5, f"without the ramp {lags[1]:.2f} s")


@check("ZO conducts below the origin and not above it")
def origin_signal(bench):
    for target, on in ((20_000, 0), (-20_000, 1), (20_000, 0)):
        absolute(bench, target)
        equal(bench.world("get")["outputs"]["ZO"], on, f"ZO at {target}")


@check("60FDh shows PU in bit 0 and DIR in bit 1")
def inputs(bench):
    for terminal, bit in (("PU", 1), ("DIR", 2)):
        bench.world(f"input {terminal} 1")
        eventually(lambda: bench.read(0x60FD), lambda now: now == bit, f"60FDh with {terminal}")
        bench.world(f"input {terminal} 0")
        eventually(lambda: bench.read(0x60FD), lambda now: now == 0, "60FDh")
