"""Faults: 603Fh, EMCY, the statusword, what the motor does, and how they are cleared (manual 3.4, 5.2, 5.3.1, 5.4)."""

import time

from checks import check, equal, eventually, near, true
from lights import bursts, flashes, usual
from zlim42c.axis import POSITION, POWER_STATE, go, runs, speed_becomes

EMERGENCY = 0x081
OVER_VOLTAGE, PHASE_LOSS, REFERENCE, EEPROM = 0xFF01, 0xFF04, 0xFF08, 0xFF10
#: How the world causes and ends each fault, while the motor turns.
CAUSES = {
    OVER_VOLTAGE: ("supply 45", "supply 24"),
    PHASE_LOSS: ("fault phase on", "fault phase off"),
    REFERENCE: ("fault reference on", "fault reference off"),
    EEPROM: ("fault eeprom on", "fault eeprom off"),
}


def fault_appears(bench, code):
    eventually(lambda: bench.read(0x603F), lambda now: now == code, f"603Fh = {code:04X}h")
    bench.status_becomes(POWER_STATE, 0x0298, "the statusword shows fault, with the motor released")


def by_controlword(bench):
    bench.write(0x6040, 0x0000)
    bench.write(0x6040, 0x0080)


def by_2011h(bench):
    bench.write(0x2011, 1)
    equal(bench.read(0x2011), 0, "2011h afterwards")


def fault_story(code, cause, end, reset):
    @check(f"fault {code:04X}h comes with EMCY and register, releases the motor, and goes {reset.__name__.replace('_', ' ')}")
    def run(bench):
        bench.write(0x200C, 1)  # or each write would try the EEPROM
        runs(bench, 100)
        mark = bench.trace.mark()
        bench.world(cause)
        if code == EEPROM:
            bench.write(0x2010, 2)  # the memory is noticed when it is used
        frame = bench.trace.wait(EMERGENCY, mark, 3.0, "an EMCY")
        fault_appears(bench, code)
        register = bench.read(0x1001)
        true(register & 1, "bit 0 of 1001h")
        equal(bytes(frame.data), code.to_bytes(2, "little") + bytes((register, 0, 0, 0, 0, 0)), "the EMCY")
        reset(bench)
        time.sleep(0.05)
        if code in (OVER_VOLTAGE, REFERENCE):
            equal(bench.statusword() & POWER_STATE, 0x0298, "the statusword, reset while the cause remains")
            bench.world(end)
            bench.sleep(0.2)
            mark = bench.trace.mark()
            reset(bench)
            cleared = bench.trace.wait(EMERGENCY, mark, 3.0, "an EMCY that tells the reset")
            equal(bytes(cleared.data), bytes(8), "the EMCY after the reset")
        else:
            # No current flows in fault, so a lost phase cannot be seen; the memory is not used.
            bench.world(end)
            reset(bench)
        bench.status_becomes(POWER_STATE, 0x0270, "the statusword after the reset")
        equal([bench.read(0x603F), bench.read(0x1001)], [0, 0], "603Fh and 1001h after the reset")
        bench.write(0x60FF, 0)
        runs(bench, 50)

    return run


for _code, (_cause, _end) in CAUSES.items():
    for _reset in (by_controlword, by_2011h):
        fault_story(_code, _cause, _end, _reset)


@check("a phase that is still lost is a fault again when the motor turns again")
def phase_again(bench):
    runs(bench, 100)
    bench.world("fault phase on")
    fault_appears(bench, PHASE_LOSS)
    by_controlword(bench)
    bench.status_becomes(POWER_STATE, 0x0270, "the statusword after the reset")
    equal(bench.read(0x603F), 0, "603Fh after the reset")
    for controlword in (0x06, 0x07, 0x0F):
        bench.write(0x6040, controlword)
    fault_appears(bench, PHASE_LOSS)


@check("only a rising edge of bit 7 resets a fault, and no other command leaves it")
def edge(bench):
    bench.write(0x6040, 0x0080)
    bench.world("supply 45")
    fault_appears(bench, OVER_VOLTAGE)
    bench.world("supply 24")
    bench.sleep(0.3)
    for controlword in (0x80, 0x06, 0x07, 0x0F, 0x02, 0x00):
        bench.write(0x6040, controlword)
        time.sleep(0.02)
        equal(bench.statusword() & POWER_STATE, 0x0298, f"the statusword after {controlword:02X}h")
    bench.write(0x6040, 0x0080)
    bench.status_becomes(POWER_STATE, 0x0270, "the statusword after an edge")


@check("canopen-python sees the fault and brings the drive back to operation")
def by_library(bench):
    bench.world("fault reference on")
    fault_appears(bench, REFERENCE)
    equal(bench.node.state, "FAULT", "state in canopen-python")
    eventually(lambda: [entry.code for entry in bench.node.emcy.log], lambda codes: codes == [REFERENCE], "canopen-python's EMCY log")
    bench.world("fault reference off")
    bench.node.state = "OPERATION ENABLED"
    equal(bench.node.state, "OPERATION ENABLED", "state in canopen-python")
    equal(bench.node.emcy.active, [], "canopen-python's active errors")


@check("603Fh holds the latest of two faults, and one reset clears both")
def latest(bench):
    bench.world("supply 45")
    fault_appears(bench, OVER_VOLTAGE)
    bench.world("fault reference on")
    fault_appears(bench, REFERENCE)
    bench.world("supply 24")
    bench.world("fault reference off")
    bench.sleep(0.3)
    by_controlword(bench)
    bench.status_becomes(POWER_STATE, 0x0270, "the statusword after the reset")


@check("30 V and 39 V are no fault, 41 V is: 40 V is the limit of 2.1")
def threshold(bench):
    for volts in (20, 30, 39):
        bench.world(f"supply {volts}")
        near(eventually(lambda: bench.read(0x2069), lambda now: abs(now - volts) <= 1, "2069h"), volts, 1, "2069h in V")
        bench.sleep(0.1)
        equal(bench.read(0x603F), 0, f"603Fh at {volts} V")
    bench.world("supply 41.5")
    fault_appears(bench, OVER_VOLTAGE)


@check("a power cycle clears a fault, as 3.4 says")
def power_cycle(bench):
    bench.world("supply 45")
    fault_appears(bench, OVER_VOLTAGE)
    bench.world("supply 24")
    eventually(lambda: bench.read(0x2069), lambda now: now < 30, "2069h falls")
    bench.power_cycle()
    equal(bench.statusword(), 0x0270, "the statusword")
    equal(bench.read(0x603F), 0, "603Fh")


@check("without supply the drive is silent, and it boots when the supply is back")
def without_supply(bench):
    bench.world("power off")
    time.sleep(0.1)
    true(not bench.answers(), "no answer without supply")
    mark = bench.trace.mark()
    bench.world("power on")
    bench.trace.wait(0x701, mark, 8.0, "boot-up", lambda frame: frame.data == b"\0")
    bench.sleep(0.3)  # what nobody took from the wire meanwhile is answered now
    equal(bench.statusword(), 0x0270, "the statusword")


@check("a cut cable silences the drive, the motor runs on, and a joined one brings it back")
def cable(bench):
    runs(bench, 100)
    bench.world("cable cut")
    true(not bench.answers(), "no answer over a cut cable")
    bench.world("cable join")
    eventually(bench.answers, bool, "an answer over the joined cable", timeout_s=10)
    bench.sleep(0.3)  # what nobody took from the wire meanwhile is answered now
    # 2000h is the node number here: nothing watches the host.
    speed_becomes(bench, 100)


@check("without a fault the red light is dark and the green one shines")
def green_light(bench):
    seen = [bench.world("get")["outputs"] for _ in range(100)]
    equal({(outputs["RED"], outputs["GREEN"]) for outputs in seen}, {(0, 1)}, "the red and the green light")


for _code, _count in ((OVER_VOLTAGE, 1), (PHASE_LOSS, 3), (REFERENCE, 4)):

    @check(f"the red light flashes fault {_code:04X}h: {_count}")
    def red_light(bench, code=_code, count=_count):
        runs(bench, 100)
        bench.world(CAUSES[code][0])
        fault_appears(bench, code)
        seen = flashes(bench, "RED", 9)
        dark = sorted(length for on, length in seen if not on)
        if count == 1:
            near(dark[len(dark) // 4], dark[-1], 0.2, f"single flashes: the same darkness between all, {dark}")
        else:
            equal(len(usual(bursts(seen))), count, f"flashes, in {bursts(seen)}")
        equal(bench.world("get")["outputs"]["GREEN"], 1, "the green light")


@check("1014h is the identifier of the EMCY, and 80h plus the node-ID as delivered")
def identifier(bench):
    equal(bench.read(0x1014), 0x81, "1014h")
    bench.enable(POSITION)
    go(bench, 100, relative=True)
    mark = bench.trace.mark()
    bench.world("fault reference on")
    frame = bench.trace.wait(EMERGENCY, mark, 3.0, "an EMCY")
    equal(frame.dlc, 8, "bytes of the EMCY")
