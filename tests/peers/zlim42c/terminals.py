"""Inputs and outputs: functions, levels, filter, limit switches, emergency stop (manual 3.2 and 5.4)."""

from checks import check, equal, eventually, near, true
from zlim42c.axis import (
    ALARM, ARRIVED, DRIVE_STATUS, EMERGENCY_STOP, HOMING, HOMING_DONE, NEGATIVE_LIMIT, POSITION, POSITIVE_LIMIT,
    PULSES_PER_SECOND, VELOCITY, go, runs, set_point, speed_becomes, stands,
)


def outputs(bench):
    """Y0 and Y1 by the world, or nothing while 2004h tells something else."""
    word = bench.read(0x2004) & 3
    seen = bench.world("get")["outputs"]
    return [seen["Y0"], seen["Y1"]] if word == seen["Y0"] | seen["Y1"] << 1 else None


def outputs_become(bench, expected, what):
    """Waits for Y0 and Y1; None stands for either."""
    fits = lambda ys: ys and all(wanted in (None, y) for wanted, y in zip(expected, ys))
    eventually(lambda: outputs(bench), fits, what)


@check("2003h shows the level of each input")
def levels(bench):
    for number in range(4):
        bench.world(f"input X{number} 1")
        eventually(lambda: bench.read(0x2003), lambda bits: bits == 1 << number, f"2003h with X{number}")
        bench.world(f"input X{number} 0")
    eventually(lambda: bench.read(0x2003), lambda bits: bits == 0, "2003h")


@check("inputs without a function have no effect")
def no_function(bench):
    runs(bench, 100)
    for number in range(4):
        bench.world(f"input X{number} 1")
    bench.sleep(0.1)
    equal(bench.read(0x606C), 100, "606Ch")


@check("an emergency stop on any input stops the motor and holds it, and nothing starts by itself afterwards")
def emergency_stop(bench):
    for number in range(4):
        bench.write(0x2030, EMERGENCY_STOP, sub=2 + number)
        runs(bench, 200)
        bench.world(f"input X{number} 1")
        speed_becomes(bench, 0)
        bench.write(0x60FF, 100)
        bench.sleep(0.1)
        equal(bench.read(0x606C), 0, f"606Ch while X{number} is active")
        bench.world(f"input X{number} 0")
        bench.sleep(0.1)
        equal(bench.read(0x606C), 0, f"606Ch after X{number}")
        bench.write(0x6040, 0)
        bench.write(0x2030, 0, sub=2 + number)


def pulse(bench, terminal, duration_s):
    """Gives an input a pulse and returns how long it was in simulated time."""
    begin = bench.world(f"input {terminal} 1")["t"]
    if duration_s:
        bench.sleep(duration_s)
    return bench.world(f"input {terminal} 0")["t"] - begin


@check("a pulse under 10 ms is not seen, and one of 30 ms is")
def short_pulse(bench):
    bench.write(0x2030, EMERGENCY_STOP, sub=2)
    runs(bench, 100)
    if pulse(bench, "X0", 0) < 0.009:
        bench.sleep(0.1)
        equal(bench.read(0x606C), 100, "606Ch after a short pulse")
    pulse(bench, "X0", 0.03)
    speed_becomes(bench, 0)


@check("204Bh filters X0 and X1, and 204Ch X2 and X3")
def filters(bench):
    bench.write(0x204B, 2000)
    for sub in (2, 3, 4, 5):
        bench.write(0x2030, EMERGENCY_STOP, sub=sub)
    runs(bench, 100)
    for terminal in ("X0", "X1"):
        pulse(bench, terminal, 0.1)
        bench.sleep(0.05)
        equal(bench.read(0x606C), 100, f"606Ch after a pulse of 0.1 s at {terminal}")
    pulse(bench, "X2", 0.1)
    speed_becomes(bench, 0)


@check("2030h:01 inverts an input: an emergency stop that opens")
def inverted_input(bench):
    bench.world("input X1 1")
    bench.write(0x2030, 0b0010, sub=1)
    bench.write(0x2030, EMERGENCY_STOP, sub=3)
    bench.sleep(0.05)
    runs(bench, 100)
    bench.world("input X1 0")
    speed_becomes(bench, 0)


@check("a limit switch stops the motor as 200Ah says: in 6084h, in 6085h, or not at all")
def limit_modes(bench):
    speed = 300 * PULSES_PER_SECOND
    late = 0.01 * speed
    bench.write(0x6084, 200)
    bench.write(0x6085, 20)
    bench.write(0x2030, POSITIVE_LIMIT, sub=4)
    for mode, way in ((0, late + speed * 0.2 / 2), (1, late + speed * 0.02 / 2)):
        bench.write(0x200A, mode)
        bench.enable(VELOCITY)
        at = bench.read(0x6064) + 8000
        bench.world(f"switch X2 {at} max")
        bench.write(0x60FF, 300)
        bench.sleep(0.2)
        stands(bench)
        near(bench.read(0x6064) - at, way, 60, f"pulses beyond the switch with 200Ah = {mode}")
        bench.write(0x60FF, 0)
        bench.world("switch X2 100000000 max")
        bench.sleep(0.05)
    bench.write(0x200A, 2)
    bench.world(f"switch X2 {bench.read(0x6064) + 8000} max")
    bench.write(0x60FF, 300)
    bench.sleep(1.0)
    equal(bench.read(0x606C), 300, "606Ch beyond the switch with 200Ah = 2")


@check("from a limit switch the motor can only go away, in both modes and at both ends")
def away(bench):
    for function, direction in ((POSITIVE_LIMIT, 1), (NEGATIVE_LIMIT, -1)):
        bench.write(0x2030, function, sub=2)
        bench.world("input X0 1")
        bench.sleep(0.05)
        bench.enable(VELOCITY)
        bench.write(0x60FF, direction * 120)
        bench.sleep(0.3)
        equal(bench.read(0x606C), 0, "606Ch into the limit")
        bench.write(0x60FF, -direction * 120)
        speed_becomes(bench, -direction * 120)
        bench.write(0x60FF, 0)
        stands(bench)
        bench.enable(POSITION)
        before = bench.read(0x6064)
        bench.write(0x607A, direction * 1000)
        bench.write(0x6040, 0x4F)
        bench.write(0x6040, 0x5F)
        bench.sleep(0.4)
        near(bench.read(0x6064), before, 5, "6064h after a set-point into the limit")
        bench.write(0x6040, 0x4F)
        go(bench, -direction * 1000, relative=True)
        equal(bench.read(0x6064), before - direction * 1000, "6064h after a set-point away from it")
        bench.write(0x6040, 0)
        bench.world("input X0 0")


@check("an output with the alarm function is on in fault, and 2030h:0C inverts it")
def alarm_output(bench):
    bench.write(0x2030, ALARM, sub=0x0D)
    bench.write(0x2030, ALARM, sub=0x0E)
    bench.write(0x2030, 0b10, sub=0x0C)
    outputs_become(bench, [0, 1], "Y0 and Y1 without a fault")
    bench.world("supply 45")
    outputs_become(bench, [1, 0], "Y0 and Y1 in fault")


@check("an output with the arrival function follows the move")
def arrival_output(bench):
    bench.write(0x2030, ARRIVED, sub=0x0E)
    bench.enable(POSITION)
    set_point(bench, 8000, relative=True)
    outputs_become(bench, [None, 0], "Y1 on the way")
    outputs_become(bench, [None, 1], "Y1 on arrival")
    equal(bench.read(0x6064), 8000, "6064h")


@check("an output with the homing function comes on when homing is done")
def homing_output(bench):
    bench.write(0x2030, HOMING_DONE, sub=0x0D)
    bench.write(0x2030, NEGATIVE_LIMIT, sub=5)
    bench.world("switch X3 min -2000")
    bench.write(0x6098, 17)
    bench.enable(HOMING)
    outputs_become(bench, [0, None], "Y0 before")
    bench.write(0x6040, 0x1F)
    bench.status_becomes(1 << 8, 1 << 8, "bit 8", 10)
    outputs_become(bench, [1, None], "Y0 afterwards")


@check("an output with the status function is on while operation is enabled")
def status_output(bench):
    bench.write(0x2030, DRIVE_STATUS, sub=0x0D)
    for controlword, on in ((0x06, 0), (0x07, 0), (0x0F, 1), (0x07, 0), (0x0F, 1), (0x00, 0)):
        bench.write(0x6040, controlword)
        outputs_become(bench, [on, None], f"Y0 after {controlword:02X}h")


@check("functions that are not connected have no effect, and others are refused")
def unknown_functions(bench):
    bench.write(0x2030, 5, sub=2)
    runs(bench, 100)
    bench.world("input X0 1")
    bench.sleep(0.1)
    equal(bench.read(0x606C), 100, "606Ch")
    for sub, value in ((2, 16), (0x0D, 5)):
        true(bench.abort_code(bench.write, 0x2030, value, sub) is not None, f"2030h:{sub:02X} = {value} was taken")
