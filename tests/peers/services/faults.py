"""Faults and alarms: how each is reported and cleared, and a drive without supply or without its cable."""

from checks import check, equal, eventually, table, true
from drive import ALL, MJOINT, ZL, ZLAC8030L, ZLIM42C
from services.network import heartbeat_becomes

#: How the world causes and ends each fault while the motor turns, and its code in 603Fh.
FAULTS = {
    "zlac8030l": table(
        "fault cause end code",
        ("a Hall error", "fault hall on", "fault hall off", 0x0200),
        ("over-voltage", "supply 90", "supply 48", 0x0001),
        ("a hot motor", "temperature motor 95", "temperature motor 30", 0x0400),
        ("a hot driver", "temperature driver 95", "temperature driver 30", 0x0800),
        ("a wrong reference voltage", "fault reference on", "fault reference off", 0x0080),
    ),
    "zlim42c": table(
        "fault cause end code",
        ("over-voltage", "supply 45", "supply 24", 0xFF01),
        ("a lost phase", "fault phase on", "fault phase off", 0xFF04),
        ("a wrong reference voltage", "fault reference on", "fault reference off", 0xFF08),
    ),
}


def is_unseen_at_rest(row):
    """No current flows in fault, so that a lost phase cannot be seen, and is reset although it is still there."""
    return "phase" in row["fault"]


@check("{fault} stops the drive with EMCY, 603Fh and 1001h, and is reset by a rising bit 7 once its cause is gone", *ZL, rows=lambda drive: FAULTS[drive.name])
def fault(bench, row):
    bench.turn(100)
    mark, emcy = bench.trace.mark(), 0x80 + bench.node_id
    bench.world(row["cause"])
    frame = bench.trace.wait(emcy, mark, "an EMCY")
    bench.becomes(0x603F, row["code"])
    bench.status_becomes(0xFF, 0x98, "fault")
    register = bench.read(0x1001)
    true(register & 1, "bit 0 of 1001h")
    equal(bytes(frame.data), row["code"].to_bytes(2, "little") + bytes((register, 0, 0, 0, 0, 0)), "the EMCY")
    for controlword in (0x0F, 0x00, 0x80):
        bench.write(0x6040, controlword)
        bench.sleep(0.05)
        reset = controlword == 0x80 and is_unseen_at_rest(row)
        equal(bench.statusword() & 0xFF, 0x70 if reset else 0x98, f"the statusword after {controlword:02X}h, the cause still there")
    bench.world(row["end"])
    bench.sleep(3.0)
    bench.write(0x6040, 0x80)
    true(bench.statusword() & 0xFF == 0x98 or is_unseen_at_rest(row), "80h again is not an edge")
    bench.write(0x6040, 0x00)
    bench.write(0x6040, 0x80)
    bench.status_becomes(0xFF, 0x70, "the statusword after the reset")
    cleared = bench.trace.since(mark, emcy)[-1]
    equal(bytes(cleared.data), bytes(8), "the EMCY of the reset")
    equal([bench.read(0x603F), bench.read(0x1001)], [0, 0], "603Fh and 1001h after the reset")


@check("canopen-python sees the fault and its EMCY, and brings the drive back to operation", *ZL)
def by_library(bench):
    bench.world("fault reference on")
    eventually(lambda: bench.node.state, lambda state: state == "FAULT", "state in canopen-python")
    code = bench.read(0x603F)
    eventually(lambda: [entry.code for entry in bench.node.emcy.log], lambda codes: codes == [code], "its EMCY log")
    bench.world("fault reference off")
    bench.sleep(0.3)
    bench.node.state = "OPERATION ENABLED"
    equal(bench.node.state, "OPERATION ENABLED", "state in canopen-python")
    equal(bench.node.emcy.active, [], "its active errors")


def by_controlword(bench):
    bench.write(0x6040, 0x0080)


def by_output(bench):
    bench.write(0x2601, 0)
    bench.write(0x2601, 1)


def by_code(bench):
    bench.write(0x260E, 0)


#: What leads to each alarm at 300 r/min; the limits of 261Dh and 2618h hold the seconds in their ones digit.
ALARMS = table(
    "alarm settings cause end code",
    ("a locked rotor", ((0x261D, 0, 2001), (0x2618, 0, 600)), "rotor lock", "rotor free", 0x12),
    ("a stall", ((0x261D, 0, 7000), (0x2618, 0, 101)), "rotor lock", "rotor free", 0x14),
    ("over-voltage", (), "supply 53.5", "supply 36", 0x15),
)


@check("{alarm} is reported by 260Eh, bit 3 and heartbeat 04, and is cleared in each of three ways once it has gone", MJOINT, rows=ALARMS)
def alarm(bench, row):
    bench.write(0x1017, 100)
    bench.write_all(row["settings"])
    for clear in (by_controlword, by_output, by_code):
        bench.turn(300)
        bench.world(row["cause"])
        bench.becomes(0x260E, row["code"])
        bench.status_becomes(1 << 3, 1 << 3, "bit 3")
        heartbeat_becomes(bench, 0x04)
        equal(bench.read(0x1001) & 1, 1, "bit 0 of 1001h")
        bench.write(0x60FF, 0)
        if row["cause"].startswith("supply"):
            clear(bench)
            equal(bench.read(0x260E), row["code"], "260Eh after a reset, the cause still there")
        bench.world(row["end"])
        bench.sleep(3.0)
        clear(bench)
        bench.becomes(0x260E, 0)
        heartbeat_becomes(bench, 0x05)


@check("a drive without supply, or behind a cut cable, is silent, and answers when it is back", *ALL)
def silence(bench):
    for away, back in (("power cut", "power on"), ("cable cut", "cable join")):
        bench.world(away)
        true(not bench.answers(), f"no answer after {away}")
        bench.world(back)
        eventually(lambda: bench.answers(10.0), bool, f"an answer after {back}")
        bench.sleep(0.5)  # frames that were not read meanwhile are answered now
        bench.turn(60)
