"""Speed mode, and the two scales of 606Ch (manual 5.04, 5.07, 5.10.2)."""

import statistics

from checks import check, equal, eventually, near, true
from mjoint.joint import COUNTS_PER_SECOND, SPEED, command, rpdo3, speed_becomes


def runs(bench, r_min):
    command(bench, SPEED, 0x0F)
    bench.write(0x60FF, r_min)
    speed_becomes(bench, r_min)


@check("606Ch is 0.1 r/min by SDO and 1 r/min in TPDO3, for either direction")
def two_scales(bench):
    for r_min in (600, -600, 60):
        runs(bench, r_min)
        bench.sleep(0.3)
        near(bench.read(0x606C), 10 * r_min, 60, "606Ch by SDO, 16 bits")
        near(rpdo3(bench, 0x0F, SPEED, r_min)[0], r_min, 6, "606Ch in TPDO3, 32 bits")


@check("at 600 r/min 6064h advances by 327680 counts a second")
def counts(bench):
    runs(bench, 600)
    bench.sleep(0.5)
    mark = bench.trace.mark()
    first = bench.read(0x6064)
    bench.sleep(0.5)
    second = bench.read(0x6064)
    frames = bench.trace.since(mark, 0x581)
    rate = (second - first) / (frames[-1].timestamp - frames[0].timestamp)
    near(rate, 600 * COUNTS_PER_SECOND, 600 * COUNTS_PER_SECOND * 0.01, "counts a second")


@check("the speed rises by 6083h r/min each second")
def slope(bench):
    bench.write(0x6083, 1000)
    command(bench, SPEED, 0x0F)
    mark = bench.trace.mark()
    bench.write(0x60FF, 1000)
    begin = bench.trace.since(mark, 0x581)[-1].timestamp
    eventually(lambda: bench.read(0x606C), lambda now: now >= 5000, "606Ch reaches 500 r/min")
    half = bench.trace.since(mark, 0x581)[-1].timestamp - begin
    near(half, 0.5, 0.08, "seconds to half the speed")
    eventually(lambda: bench.read(0x606C), lambda now: now >= 9500, "606Ch reaches 950 r/min")
    near(bench.trace.since(mark, 0x581)[-1].timestamp - begin, 0.95, 0.1, "seconds to 95 % of the speed")


@check("from 60000 on 6083h makes no ramp")
def no_ramp(bench):
    bench.write(0x6083, 60000)
    command(bench, SPEED, 0x0F)
    mark = bench.trace.mark()
    bench.write(0x60FF, 500)
    begin = bench.trace.since(mark, 0x581)[-1].timestamp
    eventually(lambda: bench.read(0x606C), lambda now: now >= 4500, "606Ch reaches 450 r/min")
    took = bench.trace.since(mark, 0x581)[-1].timestamp - begin
    true(took < 0.2, f"90 % at once, as fast as the motor can; took {took:.3f} s")


@check("010Fh stops at once and keeps the power, 000Fh goes on")
def halt(bench):
    bench.write(0x6083, 500)
    runs(bench, 300)
    begin = bench.now()
    bench.write(0x6040, 0x010F)
    eventually(lambda: bench.read(0x606C), lambda now: abs(now) < 100, "606Ch under halt")
    true(bench.now() - begin < 0.3, f"a ramp of 500 r/min/s would take 0.6 s, got {bench.now() - begin:.2f} s")
    bench.status_becomes(0xFFFF, 0x0437, "the statusword at standstill")
    bench.write(0x6040, 0x000F)
    speed_becomes(bench, 300)


@check("RPDO3 commands controlword, mode and speed at once")
def by_pdo(bench):
    equal(rpdo3(bench, 0x0F, SPEED, 400)[1], 0x0037, "statusword in TPDO3")
    speed_becomes(bench, 400)
    equal([bench.read(0x6040), bench.read(0x6060), bench.read(0x60FF)], [0x0F, SPEED, 400], "6040h, 6060h and 60FFh")


@check("606Ch agrees with the motor's true speed")
def true_speed(bench):
    runs(bench, 900)
    bench.sleep(0.3)
    near(bench.world("get")["velocity_rpm"], 900, 15, "r/min by the world")
    near(bench.read(0x606C), 9000, 150, "606Ch")


@check("a load within the rated torque slows the joint down for a moment only")
def under_load(bench):
    runs(bench, 500)
    bench.world("load torque 20")
    bench.sleep(1.0)
    near(bench.read(0x606C), 5000, 150, "606Ch under 20 N·m")
    equal(bench.read(0x260E), 0, "260Eh")


@check("60FFh takes up to 3000 r/min, and the motor turns as fast as its model does: 2000")
def greatest(bench):
    # At 36 V the motor's own voltage and the reducer's friction leave a little less.
    bench.world("supply 40")
    command(bench, SPEED, 0x0F)
    bench.write(0x60FF, 3000)
    speed_becomes(bench, 2000)
    bench.sleep(1.0)
    near(bench.read(0x606C), 20_000, 200, "606Ch")


@check("2613h shows the output with its sign: more at more speed")
def output(bench):
    near(bench.read(0x2613), 0, 600, "2613h at rest without power")
    seen = []
    for r_min in (500, 1000, -1000):
        runs(bench, r_min)
        bench.sleep(0.3)
        # The mean: the loops answer each ripple of the gear.
        seen.append(statistics.mean(bench.read(0x2613) for _ in range(100)))
    slow, fast, backward = seen
    true(0 < slow < fast, f"2613h at 500 and 1000 r/min: {slow} and {fast}")
    near(backward, -fast, 0.2 * fast, "2613h at -1000 r/min")
    true(1.6 < fast / slow < 2.2, f"the motor's own voltage grows with the speed: {slow}, {fast}")
