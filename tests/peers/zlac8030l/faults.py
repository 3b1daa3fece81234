"""Faults: 603Fh, EMCY, the statusword, and how they are cleared (manual 4.5, chapter 8; CiA 301, 7.2.7)."""

import time

from checks import check, equal, eventually, near, true

EMERGENCY = 0x084
HALL, OVER_VOLTAGE, MOTOR_TEMPERATURE, DRIVER_TEMPERATURE, ENCODER = 0x0200, 0x0001, 0x0400, 0x0800, 0x1000
FAULT_MASK, FAULT = 0x4F, 0x08


def fault_appears(bench, bit):
    eventually(lambda: bench.read(0x603F), lambda code: code & bit, f"603Fh has {bit:04X}h")
    eventually(lambda: bench.statusword() & FAULT_MASK, lambda bits: bits == FAULT, "the statusword shows fault")


def reset(bench):
    bench.write(0x6040, 0x0000)
    bench.write(0x6040, 0x0080)
    time.sleep(0.05)


@check("a Hall error stops the motor, sends an EMCY and can be reset when it is gone")
def hall(bench):
    bench.enable(3)
    bench.write(0x60FF, 100)
    eventually(lambda: bench.read(0x606C), lambda speed: abs(speed - 1000) <= 50, "606Ch")
    mark = bench.trace.mark()
    bench.world("fault hall on")
    frame = bench.trace.wait(EMERGENCY, mark, 2.0, "an EMCY")
    equal(frame.dlc, 8, "bytes of the EMCY")
    true(frame.data[0] | frame.data[1] << 8, "the EMCY's error code is not 0")
    fault_appears(bench, HALL)
    equal(bench.statusword() & 0xFF, 0x98, "low byte of the statusword")
    register = bench.read(0x1001)
    true(register & 1, "bit 0 of 1001h")
    equal(frame.data[2], register, "1001h and the EMCY's register")
    eventually(lambda: abs(bench.world("get")["velocity_rpm"]), lambda speed: speed < 95, "the motor slows down")
    bench.world("fault hall off")
    mark = bench.trace.mark()
    reset(bench)
    cleared = bench.trace.wait(EMERGENCY, mark, 1.0, "an EMCY that tells the reset")
    equal(bytes(cleared.data[:3]), b"\0\0\0", "code and register of the EMCY after the reset")
    equal(bench.read(0x603F), 0, "603Fh")
    equal(bench.read(0x1001), 0, "1001h")
    equal(bench.statusword() & 0xFF, 0x70, "low byte of the statusword")


@check("a fault whose cause is still there cannot be reset")
def cause_remains(bench):
    bench.world("fault hall on")
    fault_appears(bench, HALL)
    reset(bench)
    equal(bench.statusword() & FAULT_MASK, FAULT, "the statusword still shows fault")
    true(bench.read(0x603F) & HALL, "603Fh still has 0200h")


@check("only a rising edge of bit 7 resets a fault")
def edge(bench):
    bench.write(0x6040, 0x0080)
    bench.world("fault hall on")
    fault_appears(bench, HALL)
    bench.world("fault hall off")
    bench.write(0x6040, 0x0080)
    time.sleep(0.05)
    equal(bench.statusword() & FAULT_MASK, FAULT, "80h again without an edge")
    reset(bench)
    equal(bench.statusword() & 0x4F, 0x40, "after an edge")


@check("canopen-python sees the fault and brings the drive back to operation")
def by_library(bench):
    bench.world("fault encoder on")
    fault_appears(bench, ENCODER)
    equal(bench.node.state, "FAULT", "state in canopen-python")
    eventually(lambda: len(bench.node.emcy.log), bool, "EMCY in canopen-python's log")
    bench.world("fault encoder off")
    bench.node.state = "OPERATION ENABLED"
    equal(bench.node.state, "OPERATION ENABLED", "state in canopen-python")


@check("a supply of 90 V is an over-voltage")
def over_voltage(bench):
    bench.world("supply 90")
    fault_appears(bench, OVER_VOLTAGE)
    near(bench.read(0x2029), 9000, 100, "2029h in 0.01 V")


@check("temperatures above 2013h are faults, each with its own code")
def temperatures(bench):
    for part, sub, bit in (("motor", 1, MOTOR_TEMPERATURE), ("driver", 2, DRIVER_TEMPERATURE)):
        bench.world(f"temperature {part} 79")
        near(eventually(lambda: bench.read(0x2026, sub), lambda now: now > 700, f"2026h:0{sub}"), 790, 5, f"2026h:0{sub}")
        time.sleep(0.2)
        equal(bench.read(0x603F), 0, f"603Fh at 79 degC of the {part}")
        bench.world(f"temperature {part} 95")
        fault_appears(bench, bit)
        bench.world(f"temperature {part} 30")
        eventually(lambda: bench.read(0x2026, sub), lambda now: now < 400, f"2026h:0{sub} falls")
        reset(bench)
        equal(bench.read(0x603F), 0, "603Fh after the reset")


@check("an external stop at X0 stops the motor and shows in bit 15")
def external_stop(bench):
    bench.enable(3)
    bench.write(0x60FF, 100)
    eventually(lambda: bench.read(0x606C), lambda speed: abs(speed - 1000) <= 50, "606Ch")
    bench.world("input X0 1")
    eventually(lambda: bench.statusword() & 1 << 15, bool, "bit 15")
    eventually(lambda: bench.read(0x606C), lambda speed: abs(speed) <= 20, "606Ch falls to 0")
    equal(bench.read(0x2003) & 1, 1, "bit 0 of 2003h")
    bench.world("input X0 0")
    eventually(lambda: bench.statusword() & 1 << 15, lambda bit: not bit, "bit 15 falls")
