"""Position mode, the controlword and the statusword that mirrors it (manual 5.04 and 5.06)."""

import math

from checks import check, equal, eventually, near, true
from mjoint import rows
from mjoint.joint import (
    CLOSE, COUNTS_PER_TURN, INTERPOLATION, POSITION, REACHED, SPEED,
    absolute, arrives, command, is_at, rpdo1, rpdo2, rpdo4, shaft, speed_becomes, turned,
)

FAR = 2_000_000


@check("an idle joint reads 0404h, and its position is within the turn of the encoder")
def idle(bench):
    equal(bench.statusword(), 0x0404, "the statusword")
    true(0 <= bench.read(0x6064) < COUNTS_PER_TURN, f"6064h = {bench.read(0x6064)}")
    equal(bench.read(0x6063), bench.read(0x6064), "6063h and 6064h")


def word(row):
    return int(row["statusword"], 16)


SITUATIONS = {row["event"]: word(row) for row in rows("statusword.csv")}


def statusword_is(bench, event):
    eventually(bench.statusword, lambda now: now == SITUATIONS[event], f"the statusword of {event.replace('_', ' ')}")


@check("the statusword mirrors the controlword at rest, as printed and as the rule for the bits gives it")
def mirror(bench):
    statusword_is(bench, "power_on")
    for controlword, event in (
        (0x000F, "enable_at_rest"),
        (0x004F, "relative_move_selected"),
        (0x0006, "shutdown_command"),
        (0x0007, "switch_on_command"),
        (0x000B, "quick_stop_command"),
        (0x0001, "start_bit_only"),
        (0x0000, "disable_voltage_command"),
        (0x000F, "enable_at_rest"),
    ):
        bench.write(0x6040, controlword)
        statusword_is(bench, event)
    bench.write(0x2601, 0)
    statusword_is(bench, "output_forbidden")
    bench.write(0x2601, 1)
    statusword_is(bench, "output_allowed_again")


@check("the statusword tells of moves, speeds and targets that wait, as printed")
def moving(bench):
    equal(rpdo2(bench, FAR, 1000)[1], SITUATIONS["target_cached_while_idle"], "statusword with a target cached while idle")
    command(bench, POSITION, 0x2F)
    bench.write(0x607A, bench.read(0x6064) + 100_000)
    equal(bench.statusword(), SITUATIONS["absolute_move_begins"], "statusword on the way")
    statusword_is(bench, "absolute_move_done")
    bench.write(0x607A, 20_000)
    bench.write(0x6040, 0x5F)
    equal(bench.statusword(), SITUATIONS["relative_move_begins"], "statusword on the relative way")
    statusword_is(bench, "relative_move_done")
    command(bench, INTERPOLATION, 0x0F)
    equal(rpdo4(bench, bench.read(0x6064) + 200)[1], SITUATIONS["target_cached_by_rpdo4"], "statusword before SYNC")
    bench.write(0x6060, SPEED)
    bench.write(0x60FF, 500)
    equal(bench.statusword(), SITUATIONS["speed_begins"], "statusword on the way to the speed")
    statusword_is(bench, "speed_reached")
    bench.write(0x6040, 0x010F)
    statusword_is(bench, "halt_at_standstill")
    bench.write(0x6040, 0x000F)
    equal(bench.statusword(), SITUATIONS["halt_released"], "statusword once halt is released")


@check("with bit 5 each write of 607Ah starts an absolute move at once, on the way too")
def at_once(bench):
    absolute(bench, 60_000)
    bench.write(0x607A, FAR)
    bench.sleep(0.3)
    bench.write(0x607A, -30_000)
    bench.status_becomes(REACHED, 0, "bit 10 falls")
    arrives(bench)
    is_at(bench, -30_000)


@check("without bit 5 the target is only kept, until bit 4 is written, which clears itself")
def on_command(bench):
    start = bench.read(0x6064)
    command(bench, POSITION, 0x0F)
    bench.write(0x607A, start + 40_000)
    bench.sleep(0.3)
    turned(bench, start, 0, "counts moved by 607Ah alone")
    bench.write(0x6040, 0x1F)
    eventually(lambda: bench.read(0x6040), lambda now: now == 0x0F, "6040h: bit 4 clears itself")
    is_at(bench, start + 40_000)


@check("5Fh after 5Fh goes twice the relative way, without 4Fh between")
def relative_again(bench):
    start = bench.read(0x6064)
    command(bench, POSITION, 0x4F)
    bench.write(0x607A, 25_000)
    for times in (1, 2, 3):
        bench.write(0x6040, 0x5F)
        arrives(bench)
        is_at(bench, start + times * 25_000)
    bench.write(0x607A, -75_000)
    bench.write(0x6040, 0x5F)
    arrives(bench)
    is_at(bench, start)


@check("32768 counts are a turn of the motor")
def units(bench):
    start, angle = bench.read(0x6064), shaft(bench)
    bench.write(0x6081, 2000)
    absolute(bench, start + 10 * COUNTS_PER_TURN)
    bench.sleep(0.3)
    near(shaft(bench) - angle, 10 * COUNTS_PER_TURN, 60, "way of the shaft")


@check("the reduction divides the load: of the same motor, 50 takes 1.6 times the current of 80", drives=("m4230e17b50@1", "m4230e17b80@2"))
def reductions(bench):
    currents = []
    for joint in (bench, bench.other(2)):
        eventually(joint.answers, bool, "the joint answers")
        command(joint, POSITION, 0x0F)
        seen = []
        for torque in (20, -20):
            joint.world(f"load torque {torque}")
            bench.sleep(0.8)
            seen.append(joint.world("get")["current_a"])
        # Half the difference: what friction holds is the same both ways.
        currents.append(abs(seen[0] - seen[1]) / 2)
    near(currents[0] / currents[1], 80 / 50, 0.25, f"ratio of the currents {currents}")


@check("no speed above the model's greatest: 2000 r/min for the M4230, 1500 for the M8025", drives=("m4230e17b50@1", "m8025e25b50@2"))
def greatest_speed(bench):
    for joint, greatest in ((bench, 2000), (bench.other(2), 1500)):
        eventually(joint.answers, bool, "the joint answers")
        joint.world("supply 40")
        joint.write(0x6081, 3000)
        command(joint, POSITION, 0x2F)
        joint.write(0x607A, 10_000_000)
        eventually(lambda: joint.read(0x606C), lambda now: now > 9 * greatest, f"606Ch of node {joint.node_id}")
        bench.sleep(1.0)
        near(joint.read(0x606C) / 10, greatest, greatest * 0.01, f"r/min of node {joint.node_id}")


def arrival_time(bench):
    """How long a relative move takes, in simulated seconds between the answers on the wire."""
    mark = bench.trace.mark()
    bench.write(0x6040, 0x5F)
    begin = bench.trace.since(mark, 0x581)[-1].timestamp
    arrives(bench)
    return bench.trace.since(mark, 0x581)[-1].timestamp - begin


@check("a move takes the time that 6081h and 6083h give in closed form")
def durations(bench):
    command(bench, POSITION, 0x4F)
    for turns, r_min, slope in ((10, 600, 3000), (-6, 1000, 2000), (1, 1500, 1000)):
        for index, value in ((0x6081, r_min), (0x6083, slope), (0x607A, turns * COUNTS_PER_TURN)):
            bench.write(index, value)
        way, speed, rise = abs(turns), r_min / 60, slope / 60
        # A trapezium, or a triangle when the way is too short for the speed.
        expected = way / speed + speed / rise if way > speed**2 / rise else 2 * math.sqrt(way / rise)
        near(arrival_time(bench), expected, 0.15, f"seconds for {turns} turns at {r_min} r/min, {slope} r/min/s")


@check("260Ch moves by what is written, at once, each time")
def increments(bench):
    start = bench.read(0x6064)
    command(bench, POSITION, 0x0F)
    for total, step in ((10_000, 10_000), (20_000, 10_000), (-30_000, -50_000)):
        bench.write(0x260C, step)
        is_at(bench, start + total)


@check("halt stops without a ramp and holds, and the move goes on when halt is released")
def halt(bench):
    start = bench.read(0x6064)
    bench.write(0x6083, 1000)
    command(bench, POSITION, 0x2F)
    bench.write(0x607A, start + 300_000)
    eventually(lambda: bench.read(0x606C), lambda now: now > 5000, "606Ch on the way")
    bench.write(0x6040, 0x012F)
    begin = bench.now()
    eventually(lambda: bench.read(0x606C), lambda now: abs(now) < 100, "606Ch under halt")
    true(bench.now() - begin < 0.25, f"a ramp of 1000 r/min/s would take half a second, got {bench.now() - begin:.2f} s")
    halted = bench.read(0x6064)
    bench.sleep(0.3)
    near(bench.read(0x6064), halted, 2000, "6064h under halt")
    bench.write(0x6040, 0x002F)
    is_at(bench, start + 300_000)


@check("quick stop ends the move: 6040h without bit 2 stops, and Fh alone does not go on")
def quick_stop(bench):
    start = bench.read(0x6064)
    command(bench, POSITION, 0x2F)
    bench.write(0x607A, start + 500_000)
    eventually(lambda: bench.read(0x606C), lambda now: now > 5000, "606Ch on the way")
    bench.write(0x6040, 0x000B)
    speed_becomes(bench, 0)
    stopped = bench.read(0x6064)
    bench.write(0x6040, 0x000F)
    bench.sleep(0.5)
    near(bench.read(0x6064), stopped, 2000, "6064h after Fh")
    true(abs(bench.read(0x6064) - start - 500_000) > 100_000, "the target was not reached")


@check("0Fh enables from anywhere, and bit 1 or 2601h takes the power away")
def power(bench):
    bench.write(0x6040, 0x0F)
    bench.write(0x6060, SPEED)
    bench.write(0x60FF, 500)
    speed_becomes(bench, 500)
    bench.write(0x6040, 0x0000)
    speed_becomes(bench, 0)
    bench.write(0x6040, 0x000F)
    speed_becomes(bench, 500)
    bench.write(0x2601, 0)
    speed_becomes(bench, 0)
    bench.write(0x2601, 1)
    speed_becomes(bench, 500)


@check("the enabled joint holds its position against a load, and the idle one does not")
def holding(bench):
    command(bench, POSITION, 0x0F)
    start = bench.read(0x6064)
    bench.world("load torque 20")
    bench.sleep(0.5)
    near(bench.read(0x6064), start, 600, "6064h under 20 N·m")
    bench.write(0x6040, 0)
    bench.sleep(0.5)
    true(abs(bench.read(0x6064) - start) > 3000, "the idle joint gives way")


@check("RPDO1 commands controlword, mode and target at once, and each RPDO is answered once")
def by_pdo(bench):
    start = bench.read(0x6064)
    mark = bench.trace.mark()
    position, statusword = rpdo1(bench, 0x2F, POSITION, start + 70_000)
    near(position, start, 2000, "position in TPDO1")
    equal(statusword, 0x0037, "statusword in TPDO1")
    arrives(bench)
    is_at(bench, start + 70_000)
    equal(len(bench.trace.since(mark, 0x181)), 1, "TPDO1 for one RPDO1")


@check("a mode that there is not leaves the mode as it was, in RPDO1 too")
def bad_mode_by_pdo(bench):
    for mode in (0, 2, 5, 8, -1):
        rpdo1(bench, 0x00, mode, 0)
        equal(bench.read(0x6060), POSITION, f"6060h after RPDO1 with mode {mode}")


@check("6078h reads the current in 1/2000 A: about the torque's share under a load")
def current(bench):
    command(bench, POSITION, 0x0F)
    bench.world("load torque 15")
    bench.sleep(0.6)
    seen, actual = bench.read(0x6078) / 2000, abs(bench.world("get")["current_a"])
    true(actual > 0.3, f"a current flows, got {actual} A")
    near(seen, actual, 0.15 + 0.1 * actual, "6078h in A, and the world's current")


@check("a target that is already there is reached at once")
def already_there(bench):
    absolute(bench, 12_345)
    bench.write(0x607A, 12_345)
    arrives(bench)
    near(bench.read(0x6064), 12_345, CLOSE, "6064h")
