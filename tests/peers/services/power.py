"""Power states: the table of CiA 402-2 for the ZL drives, and the joint's statusword, which mirrors its controlword (5.04)."""

from checks import check, equal
from drive import MJOINT, ZL

ENERGISED = 1 << 13
#: How to reach a state from switch on disabled, by controlwords.
WAYS = {
    "switch_on_disabled": (),
    "ready_to_switch_on": (0x06,),
    "switched_on": (0x06, 0x07),
    "operation_enabled": (0x06, 0x07, 0x0F),
    "quick_stop_active": (0x06, 0x07, 0x0F, 0x02),
}


@check("every controlword in every state leads where CiA 402 says, with the statusword's low byte", *ZL)
def every_command(bench):
    rows = bench.drive.rows("power_state.csv")
    lows = {row["state_after"]: int(row["low_byte_after"], 16) for row in rows}
    for row in rows:
        if row["state"] not in WAYS or not row["controlword"]:
            continue
        for controlword in (0x00, *WAYS[row["state"]]):
            bench.write(0x6040, controlword)
        bench.status_becomes(0xFF, lows[row["state"]], f"reach {row['state']}")
        bench.write(0x6040, int(row["controlword"], 16))
        mask, expected = 0xFF, int(row["low_byte_after"], 16)
        if row.get("bit_13_after"):
            mask, expected = mask | ENERGISED, expected | ENERGISED * int(row["bit_13_after"])
        bench.status_becomes(mask, expected, f"{row['event']} in {row['state']}")


@check("canopen-python's own state machine selects modes, enables and disables the drive", *ZL)
def by_library(bench):
    for bit, mode in enumerate(("PROFILED POSITION", "VELOCITY", "PROFILED VELOCITY", "PROFILED TORQUE", "", "HOMING")):
        if bench.drive.modes & 1 << bit:
            bench.node.op_mode = mode
            equal(bench.node.op_mode, mode, "mode in canopen-python")
    for state in ("OPERATION ENABLED", "SWITCHED ON", "READY TO SWITCH ON", "SWITCH ON DISABLED"):
        bench.node.state = state
        equal(bench.node.state, state, "state in canopen-python")


@check("the statusword of each row of statusword.csv that a controlword at rest leads to", MJOINT)
def mirror(bench):
    at_rest = {"mode": "1", "alarm": "00", "homing": "none", "reached": "1"}
    for row in bench.drive.rows("statusword.csv"):
        if any(row[field] != value for field, value in at_rest.items()):
            continue
        bench.write(0x2601, int(row["output_enabled"]))
        bench.write(0x6040, int(row["controlword"], 16))
        bench.status_becomes(0xFFFF, int(row["statusword"], 16), f"the statusword of {row['event']}")
