"""Alarms 10h, 12h, 14h and 15h, their lights, and how they are cleared (manual, interface 3, 5.04)."""

from checks import check, equal, eventually, near, true
from lights import bursts, flashes, usual
from mjoint.joint import ALARM, POSITION, REACHED, SPEED, command, is_at, speed_becomes

BATTERY, LOCKED_ROTOR, STALL, OVER_VOLTAGE, COMMUNICATION = 0x10, 0x12, 0x14, 0x15, 0x20


def alarm_is(bench, code, timeout_s=8.0):
    eventually(lambda: bench.read(0x260E), lambda now: now == code, f"260Eh = {code:02X}h", timeout_s)
    bench.status_becomes(ALARM, ALARM if code else 0, "bit 3 of the statusword")


def heartbeat_is(bench, expected):
    mark = bench.trace.mark()
    bench.trace.wait(0x701, mark, 4.0, f"heartbeat {expected:02X}", lambda frame: frame.data[0] == expected)


def clear_by_controlword(bench):
    bench.write(0x6040, 0x0080)


def clear_by_output(bench):
    bench.write(0x2601, 0)
    bench.write(0x2601, 1)


def clear_by_code(bench):
    bench.write(0x260E, 0)


def block(bench, code):
    """A locked rotor that is asked to move, with limits that raise the one alarm or the other."""
    # The ones digit is the time in seconds, and 0 never. 261Dh: the limit in mA. 2618h: the limit in tenths of a per cent.
    bench.write(0x261D, 2001 if code == LOCKED_ROTOR else 7000)
    bench.write(0x2618, 101 if code == STALL else 600)
    bench.write(0x1017, 100)
    bench.world("rotor lock")
    command(bench, SPEED, 0x0F)
    bench.write(0x60FF, 300)


for _code, _name in ((LOCKED_ROTOR, "a locked rotor at the current limit of 261Dh"), (STALL, "a stall at the output limit of 2618h")):

    @check(f"alarm {_code:02X}h: {_name}, after the second in the ones digit; the motor is off and the heartbeat 04")
    def blocked(bench, code=_code):
        block(bench, code)
        begin = bench.now()
        alarm_is(bench, code)
        near(bench.now() - begin, 1.0, 0.4, "seconds until the alarm")
        heartbeat_is(bench, 0x04)
        bench.world("rotor free")
        bench.sleep(0.3)
        near(bench.read(0x606C), 0, 30, "606Ch in alarm")
        near(bench.world("get")["current_a"], 0, 0.1, "current in alarm")

    @check(f"alarm {_code:02X}h is cleared by bit 7 of 6040h, by 2601h from 0 to 1, or by 260Eh = 0")
    def cleared(bench, code=_code):
        for clear in (clear_by_controlword, clear_by_output, clear_by_code):
            block(bench, code)
            alarm_is(bench, code)
            bench.write(0x60FF, 0)
            bench.world("rotor free")
            clear(bench)
            alarm_is(bench, 0)
            heartbeat_is(bench, 0x05)
            command(bench, SPEED, 0x0F)
            bench.write(0x60FF, 200)
            speed_becomes(bench, 200)
            bench.write(0x60FF, 0)
            speed_becomes(bench, 0)


@check("with 0 in the ones digits of 261Dh and 2618h a blocked rotor raises no alarm")
def never(bench):
    block(bench, 0)
    bench.sleep(3.0)
    equal(bench.read(0x260E), 0, "260Eh after 3 s")
    true(abs(bench.world("get")["current_a"]) > 1, "the motor pushes on")
    bench.world("rotor free")
    speed_becomes(bench, 300)


@check("261Dh limits the current: 2000 mA for a locked rotor")
def current_limit(bench):
    bench.write(0x261D, 2000)
    bench.write(0x2618, 600)
    bench.world("rotor lock")
    command(bench, SPEED, 0x0F)
    bench.write(0x60FF, 1000)
    bench.sleep(1.0)
    near(abs(bench.world("get")["current_a"]), 2.0, 0.15, "current in A")
    near(bench.read(0x6078) / 2000, 2.0, 0.15, "6078h in A")


@check("alarm 15h: 51 V is none, 53 V is; it goes with a reset below 52 V, not before")
def over_voltage(bench):
    bench.write(0x1017, 100)
    command(bench, SPEED, 0x0F)
    bench.write(0x60FF, 200)
    speed_becomes(bench, 200)
    bench.world("supply 51")
    bench.sleep(0.4)
    equal(bench.read(0x260E), 0, "260Eh at 51 V")
    bench.world("supply 53.5")
    alarm_is(bench, OVER_VOLTAGE)
    heartbeat_is(bench, 0x04)
    speed_becomes(bench, 0)
    for clear in (clear_by_controlword, clear_by_output, clear_by_code):
        clear(bench)
        equal(bench.read(0x260E), OVER_VOLTAGE, f"260Eh after {clear.__name__} above 52 V")
    bench.world("supply 36")
    eventually(lambda: bench.read(0x6079), lambda now: now / 327 < 50, "6079h falls")
    clear_by_controlword(bench)
    alarm_is(bench, 0)


@check("alarm 10h: turns lost without the battery; the motor goes on, and a new multi-turn origin clears it")
def battery(bench):
    bench.world("battery off")
    bench.power_cycle()
    alarm_is(bench, BATTERY)
    start = bench.read(0x6064)
    command(bench, POSITION, 0x2F)
    bench.write(0x607A, start + 20_000)
    is_at(bench, start + 20_000)
    bench.status_becomes(REACHED | ALARM, REACHED | ALARM, "bits 10 and 3")
    bench.world("battery on")
    for clear in (clear_by_controlword, clear_by_output, clear_by_code):
        clear(bench)
        equal(bench.read(0x260E), BATTERY, f"260Eh after {clear.__name__}")
    bench.write(0x260A, 60006)
    bench.write(0x260A, 60016)
    alarm_is(bench, 0)
    near(bench.read(0x6064), 0, 9, "6064h, 0 or a single digit")


@check("without an alarm 1001h is 0, and with one its bit 0 is set")
def error_register(bench):
    equal(bench.read(0x1001), 0, "1001h")
    bench.world("supply 55")
    alarm_is(bench, OVER_VOLTAGE)
    equal(bench.read(0x1001) & 1, 1, "bit 0 of 1001h")


def red_flashes(bench, code, expected):
    alarm_is(bench, code)
    seen = bursts(flashes(bench, "RED", 12))
    equal(usual(seen), expected, f"flashes of alarm {code:02X}h, L for long and s for short, in {seen}")


@check("the red light flashes over-voltage, 15h: one long and five short")
def red_for_over_voltage(bench):
    bench.world("supply 55")
    red_flashes(bench, OVER_VOLTAGE, "Lsssss")


@check("the red light flashes a locked rotor, 12h: one long and two short")
def red_for_locked_rotor(bench):
    block(bench, LOCKED_ROTOR)
    red_flashes(bench, LOCKED_ROTOR, "Lss")


@check("the red light flashes a stall, 14h: one long and four short")
def red_for_stall(bench):
    block(bench, STALL)
    red_flashes(bench, STALL, "Lssss")


@check("the red light flashes a lost battery, 10h, one long, and lost communication, 20h, two long")
def red_for_long_ones(bench):
    bench.world("battery off")
    bench.power_cycle()
    alarm_is(bench, BATTERY)
    battery = flashes(bench, "RED", 8)
    bench.restart()
    bench.write(0x1016, 0x007F0064, sub=1)
    bench.send(0x77F, [5])
    alarm_is(bench, COMMUNICATION)
    communication = flashes(bench, "RED", 10)
    lit = sorted(length for on, length in battery + communication if on)
    true(lit[len(lit) // 2] > 0.4, f"long to the eye, got {lit} s")
    dark = sorted(length for on, length in battery if not on)
    near(dark[len(dark) // 4], dark[-1], 0.2, f"single flashes: the same darkness between all, {dark}")
    equal(usual(bursts(communication)), "LL", "flashes of alarm 20h")


@check("the green light shines or flashes in health, and flickers faster without the battery")
def green_light(bench):
    bench.sleep(2.0)
    seen = flashes(bench, "GREEN", 3)
    equal({bench.world("get")["outputs"]["RED"] for _ in range(100)}, {0}, "the red light in health")
    true(bench.world("get")["outputs"]["GREEN"] or seen, "the green light in health")
    bench.world("battery off")
    bench.sleep(0.5)
    dropped = flashes(bench, "GREEN", 3)
    true(len(dropped) > 2 * len(seen) and len(dropped) > 10, f"changes in 3 s: {len(seen)} in health, {len(dropped)} without the battery")


@check("the alarm output is normally open with an even ones digit of 60FBh:01, and normally closed with an odd one")
def alarm_output(bench):
    for value, in_health in ((3000, 0), (3001, 1)):
        bench.write(0x60FB, value, sub=1)
        eventually(lambda: bench.world("get")["outputs"]["WR"], lambda wr: wr == in_health, f"WR in health with {value}")
        bench.world("supply 55")
        alarm_is(bench, OVER_VOLTAGE)
        eventually(lambda: bench.world("get")["outputs"]["WR"], lambda wr: wr != in_health, f"WR in alarm with {value}")
        bench.world("supply 36")
        eventually(lambda: bench.read(0x6079), lambda now: now / 327 < 50, "6079h falls")
        clear_by_controlword(bench)
        alarm_is(bench, 0)
