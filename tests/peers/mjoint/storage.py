"""What survives the power: 2614h, the node-ID of 2615h, multi-turn positions, and what 2619h does at power-on."""

import time

from checks import check, equal, eventually, near, true
from mjoint.joint import COUNTS_PER_TURN, POSITION, SPEED, absolute, command, is_at, save, shaft, speed_becomes

#: A stored object and a value that differs from its default: (index, sub, value).
STORED = ((0x1017, 0, 500), (0x6081, 0, 700), (0x6083, 0, 12_000), (0x60F9, 1, 2000), (0x260A, 0, 16_384), (0x261D, 0, 5003), (0x6098, 0, 21))


def values(bench):
    return [bench.read(index, sub) for index, sub, _ in STORED]


def write_all(bench):
    for index, sub, value in STORED:
        bench.write(index, value, sub)


@check("2614h = 1 stores the parameters and reads 2 when done; without it they are lost with the power")
def parameters(bench):
    delivered = values(bench)
    write_all(bench)
    bench.power_cycle()
    equal(values(bench), delivered, "the objects without saving")
    write_all(bench)
    save(bench)
    bench.power_cycle()
    equal(values(bench), [value for _, _, value in STORED], "the objects after saving")
    true(bench.read(0x2614) in (0, 2), "2614h")


@check("what commands the joint is not stored: it stands still after power-on")
def commands(bench):
    command(bench, SPEED, 0x0F)
    bench.write(0x60FF, 300)
    speed_becomes(bench, 300)
    save(bench)
    bench.power_cycle()
    bench.sleep(0.3)
    equal([bench.read(index) for index in (0x6040, 0x60FF)], [0, 0], "6040h and 60FFh")
    near(bench.read(0x606C), 0, 20, "606Ch")


def boots_as(bench, node_id):
    mark = bench.trace.mark()
    bench.world("power cycle")
    bench.trace.wait(0x700 + node_id, mark, 8.0, f"boot-up of node {node_id}", lambda frame: frame.data == b"\0")


@check("a node-ID of 2615h holds after saving and a power cycle, for every identifier")
def node_id(bench):
    bench.write(0x2615, 5)
    boots_as(bench, 1)
    equal(bench.read(0x2615), 1, "2615h without saving")
    bench.write(0x2615, 5)
    save(bench)
    equal(bench.read(0x1000), 0x20192, "1000h, still as node 1")
    boots_as(bench, 5)
    moved = bench.other(5)
    equal([moved.read(0x1400 + number, 1) for number in range(4)], [0x205, 0x305, 0x405, 0x505], "COB-IDs of the RPDOs")
    equal([moved.read(0x1800 + number, 1) for number in range(4)], [0x185, 0x285, 0x385, 0x485], "COB-IDs of the TPDOs")
    mark = bench.trace.mark()
    bench.send(0x305, bytes(8))
    equal(bench.trace.wait(0x285, mark, 3.0, "TPDO2 of node 5").dlc, 6, "bytes of TPDO2")
    true(not bench.answers(), "no answer from node 1")
    equal(bench.world("get")["node"], 5, "the node of `get`")


@check("node-IDs of 0 and above 127 are refused")
def bad_node_ids(bench):
    for value in (0, 128, 255):
        true(bench.abort_code(bench.write, 0x2615, value) is not None, f"2615h = {value} was taken")


@check("--state keeps what was saved when the simulator is killed", state=True)
def across_kill(bench):
    write_all(bench)
    save(bench)
    # The contract: on disk within 1.5 s of the drive's store.
    time.sleep(2.5)
    bench.restart(kill=True)
    equal(values(bench), [value for _, _, value in STORED], "the objects in the next run")


@check("60006 and then 60016 to 260Ah make the present position 0, and 260Ah keeps its value")
def zero(bench):
    absolute(bench, 100_000)
    bench.write(0x260A, 60006)
    bench.write(0x260A, 60016)
    eventually(lambda: bench.read(0x6064), lambda now: abs(now) < 10, "6064h, 0 or a single digit")
    equal(bench.read(0x260A), 32768, "260Ah")


@check("60016 without 60006 before it sets no origin")
def half_a_sequence(bench):
    absolute(bench, 100_000)
    bench.write(0x260A, 60016)
    bench.sleep(0.2)
    near(bench.read(0x6064), 100_000, 30, "6064h")


@check("with the battery 6064h begins at the multi-turn position after a power cycle")
def multi_turn(bench):
    for target in (5 * COUNTS_PER_TURN + 1000, -3 * COUNTS_PER_TURN - 77):
        absolute(bench, target)
        bench.write(0x6040, 0)
        bench.sleep(0.2)
        before = bench.read(0x6064)
        bench.power_cycle()
        near(bench.read(0x6064), before, 60, "6064h after the power cycle")


@check("the battery counts turns of the shaft without supply")
def turned_without_supply(bench):
    before, angle = bench.read(0x6064), shaft(bench)
    bench.world("power off")
    bench.sleep(0.1)
    bench.world("load torque -30")
    eventually(lambda: shaft(bench) - angle, lambda way: way > 2 * COUNTS_PER_TURN, "the load turns the shaft by two turns")
    bench.world("load torque 0")
    bench.world("rotor lock")
    bench.world("rotor free")
    mark = bench.trace.mark()
    bench.world("power on")
    bench.trace.wait(0x701, mark, 8.0, "boot-up")
    bench.sleep(0.3)
    way = shaft(bench) - angle
    near(bench.read(0x6064) - before, way, 100, "6064h")


@check("without the battery 6064h begins within the turn, where the shaft is")
def single_turn(bench):
    absolute(bench, 7 * COUNTS_PER_TURN + 1234)
    bench.write(0x6040, 0)
    bench.sleep(0.2)
    before = bench.read(0x6064)
    bench.world("battery off")
    bench.power_cycle()
    now = bench.read(0x6064)
    true(0 <= now < COUNTS_PER_TURN, f"6064h = {now}")
    near((now - before + COUNTS_PER_TURN // 2) % COUNTS_PER_TURN, COUNTS_PER_TURN // 2, 60, "place within the turn")


def at_power_on(bench, special, slope=None):
    """Saves what the joint shall do at power-on."""
    if slope:
        bench.write(0x6083, slope)
    bench.write(0x2619, special)
    save(bench)


@check("2619h = 6 returns to the origin at power-on, at the speed in the ones digit of 6083h")
def returns(bench):
    absolute(bench, 0)
    at_power_on(bench, 6, 10_002)
    bench.write(0x6081, 2000)
    absolute(bench, 10 * COUNTS_PER_TURN)
    bench.power_cycle()
    fastest = 0
    end = bench.now() + 12
    while abs(bench.read(0x6064)) > 100 and bench.now() < end:
        fastest = min(fastest, bench.read(0x606C))
    is_at(bench, 0)
    near(fastest, -3000, 200, "606Ch on the way: 300 r/min in 0.1 r/min")


@check("2619h = 6 does not return without the turns: the battery was lost")
def stays(bench):
    at_power_on(bench, 6)
    absolute(bench, 3 * COUNTS_PER_TURN)
    bench.world("battery off")
    bench.power_cycle()
    at = bench.read(0x6064)
    bench.sleep(0.8)
    near(bench.read(0x6064), at, 60, "6064h a while after power-on")


@check("2619h = 8 returns to the origin at power-on with the brake released, and engages it without power")
def returns_with_brake(bench):
    at_power_on(bench, 8, 10_004)
    bench.power_cycle()
    absolute(bench, 4 * COUNTS_PER_TURN)
    bench.world("power off")
    # It lives on its capacitors for a while.
    eventually(lambda: bench.world("get")["brake"], lambda now: now == "engaged", "the brake without supply")
    bench.world("power on")
    bench.sleep(0.3)
    is_at(bench, 0)
    equal(bench.world("get")["brake"], "released", "the brake while the joint holds the origin")


@check("2619h = 7 holds with the brake while the power stage is off, and lets go to move")
def brake(bench):
    at_power_on(bench, 7)
    bench.power_cycle()
    eventually(lambda: bench.world("get")["brake"], lambda now: now == "engaged", "the brake at rest")
    start = bench.read(0x6064)
    bench.world("load torque 10")
    bench.sleep(0.4)
    near(bench.read(0x6064), start, 600, "6064h under a load on the brake")
    bench.world("load torque 0")
    command(bench, POSITION, 0x0F)
    eventually(lambda: bench.world("get")["brake"], lambda now: now == "released", "the brake when enabled")
    absolute(bench, start + 20_000)


@check("2619h from 30 to 32768 turns to that angle within the turn at power-on")
def angle(bench):
    at_power_on(bench, 8192)
    bench.power_cycle()
    eventually(lambda: bench.read(0x6064) % COUNTS_PER_TURN, lambda now: abs(now - 8192) < 60, "place within the turn", 10)


@check("values of 2619h without a meaning are refused")
def unknown_special(bench):
    for value in (4, 5, 10, 29, 32769):
        true(bench.abort_code(bench.write, 0x2619, value) is not None, f"2619h = {value} was taken")
    equal(bench.read(0x2619), 0, "2619h")
