"""Terminals by the world's commands: what objects show of inputs, what inputs do, what outputs tell, pulses and duty cycles."""

from checks import check, eventually, near, table
from drive import ALL, MJOINT, ZL, ZLIM42C

#: The object that shows the inputs, and the terminals in the order of its bits.
INPUTS = {"zlac8030l": (0x2003, "X0 X1"), "zlim42c": (0x2003, "X0 X1 X2 X3"), "mjoint": (0x60FD, "PU DIR")}


@check("the input status shows the level of each terminal", *ALL)
def levels(bench):
    index, terminals = INPUTS[bench.drive.name]
    for bit, terminal in enumerate(terminals.split()):
        for level in (1, 0):
            bench.world(f"input {terminal} {level}")
            bench.becomes(index, level << bit)


@check("an emergency stop at an input, of either polarity, stops the motor, and nothing starts by itself after it", *ZL)
def emergency_stop(bench):
    bench.write_all(bench.drive.unwatched)
    for number, inverted in ((0, False), (1, True)):
        bench.world(f"input X{number} {int(inverted)}")
        bench.write(0x2030, inverted << number, sub=1)
        bench.write(0x2030, 9, sub=2 + number)
        bench.sleep(0.1)
        bench.turn(100)
        bench.world(f"input X{number} {int(not inverted)}")
        bench.speed_becomes(0)
        bench.world(f"input X{number} {int(inverted)}")
        bench.sleep(0.3)
        bench.speed_becomes(0)
        bench.write(0x2030, 0, sub=2 + number)


@check("a limit switch on the way stops the motor, which can only go away from it, and goes on when the switch is moved", ZLIM42C)
def limit(bench):
    bench.write(0x2030, 2, sub=2)
    bench.world("switch X0 6000 max")
    bench.turn(120)
    bench.speed_becomes(0)
    bench.write(0x60FF, -120)
    bench.speed_becomes(-120)
    bench.world("switch X0 1000000 max")
    bench.write(0x60FF, 120)
    eventually(lambda: bench.read(0x6064), lambda at: at > 9000, "6064h beyond where the switch was")


#: What tells of a fault at an output: its setting for "on in fault", the setting for the reverse, the output, the cause.
ALARM_OUTPUTS = {
    "zlac8030l": ((0x2030, 0x0D, 1), (0x2030, 0x0C, 1), "Y0", "fault reference on"),
    "zlim42c": ((0x2030, 0x0D, 1), (0x2030, 0x0C, 1), "Y0", "supply 45"),
    "mjoint": ((0x60FB, 1, 3000), (0x60FB, 1, 3001), "WR", "supply 55"),
}


@check("the alarm output is on in a fault, and off with the other polarity", *ALL)
def alarm_output(bench):
    on_in_fault, reverse, output, cause = ALARM_OUTPUTS[bench.drive.name]
    becomes = lambda level, when: eventually(lambda: bench.world("get")["outputs"][output], lambda now: now == level, f"{output} {when}")
    bench.write_all((on_in_fault,))
    becomes(0, "in health")
    bench.world(cause)
    becomes(1, "in a fault")
    bench.write_all((reverse,))
    becomes(0, "in a fault, reversed")


PULSES = table(
    "what settings command turns",
    ("8192 pulses are a turn with the gear as delivered", (), "pulses 8192 20000", 1),
    ("3200 pulses are a turn with 256 to 25", ((0x260A, 0, 256), (0x260B, 0, 25)), "pulses 3200 10000", 1),
    ("2609h turns the direction around", ((0x2609, 0, 1),), "pulses 8192 20000", -1),
    ("bit 0 of the controlword makes pulses invalid", ((0x6040, 0, 0x0F),), "pulses 8192 20000", 0),
)


@check("{what}", MJOINT, rows=PULSES)
def pulses(bench, row):
    bench.write_all(row["settings"])
    bench.world(row["command"])
    bench.sleep(1.0)
    bench.becomes(0x6064, 32_768 * row["turns"], 80)


@check("saved functions of 2619h act from power-on: an encoder is followed, the duty cycle is a speed", MJOINT)
def functions(bench):
    for function, command in ((2, "quadrature 4096 8000"), (1, "duty 50")):
        bench.write(0x2619, function)
        bench.save()
        bench.power_cycle()
        start = bench.read(0x6064)
        bench.world(command)
        if function == 2:
            bench.becomes(0x6064, start + 16_384, 80)
            continue
        bench.speed_becomes(500)
        bench.world("duty 90")
        bench.speed_becomes(1000)
        near(bench.world("get")["velocity_rpm"], 1000, 30, "r/min by the world")
