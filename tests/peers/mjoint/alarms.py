"""Alarms 10h, 12h, 14h and 15h, their lights, and how they are cleared (manual, interface 3, 5.04)."""

from checks import check, equal, eventually, near, true
from mjoint.joint import ALARM, POSITION, REACHED, SPEED, command, is_at, speed_becomes

BATTERY, LOCKED_ROTOR, STALL, OVER_VOLTAGE = 0x10, 0x12, 0x14, 0x15


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


def flashes(bench, led, for_s):
    """The lengths of what the light was on for, in simulated seconds, and of the darkness after each."""
    end = bench.now() + for_s
    changes = []
    while (get := bench.world("get"))["t"] < end:
        on = get["outputs"][led]
        if not changes or changes[-1][1] != on:
            changes.append((get["t"], on))
    lengths = [(on, later - at) for (at, on), (later, _) in zip(changes, changes[1:])]
    return lengths[1:]


def bursts(lengths):
    """Flashes between long darknesses, as L for long and s for short."""
    lit = [length for on, length in lengths if on]
    dark = [length for on, length in lengths if not on]
    if not lit or not dark:
        return []
    pause, long = max(dark) * 0.7, max(lit) * 0.6
    words, word = [], ""
    for on, length in lengths:
        if on:
            word += "L" if length > long else "s"
        elif length > pause:
            words.append(word)
            word = ""
    return words[1:]


@check("the red light flashes the alarm: 15h is one long and five short")
def red_light(bench):
    bench.world("supply 55")
    alarm_is(bench, OVER_VOLTAGE)
    seen = bursts(flashes(bench, "RED", 14))
    true(seen and set(seen) == {"Lsssss"}, f"one long and five short, again and again; got {seen}")


@check("in health the red light is dark and the green one shines or shows the battery charging")
def green_light(bench):
    bench.sleep(2.0)
    seen = [bench.world("get")["outputs"] for _ in range(200)]
    equal({outputs["RED"] for outputs in seen}, {0}, "the red light")
    true(any(outputs["GREEN"] for outputs in seen), "the green light")


@check("the alarm output conducts in health with an even ones digit of 60FBh:01, and in alarm with an odd one")
def alarm_output(bench):
    for value, in_health in ((3000, 1), (3001, 0)):
        bench.write(0x60FB, value, sub=1)
        eventually(lambda: bench.world("get")["outputs"]["WR"], lambda wr: wr == in_health, f"WR in health with {value}")
        bench.world("supply 55")
        alarm_is(bench, OVER_VOLTAGE)
        eventually(lambda: bench.world("get")["outputs"]["WR"], lambda wr: wr != in_health, f"WR in alarm with {value}")
        bench.world("supply 36")
        eventually(lambda: bench.read(0x6079), lambda now: now / 327 < 50, "6079h falls")
        clear_by_controlword(bench)
        alarm_is(bench, 0)
