"""The CiA 402 power states by SDO (CiA 402-2; ZLAC8030L manual 4.1, 4.5, 4.6, 7; ZLIM42-C manual 5.3.1 and 5.3.2)."""

import time

from checks import Common, equal, true

COMMON = Common()
check = COMMON.check
ENERGISED = 1 << 13
#: How to reach a state from switch on disabled, by controlwords.
WAYS = {
    "switch_on_disabled": (),
    "ready_to_switch_on": (0x06,),
    "switched_on": (0x06, 0x07),
    "operation_enabled": (0x06, 0x07, 0x0F),
    "quick_stop_active": (0x06, 0x07, 0x0F, 0x02),
}


def command(bench, controlword):
    bench.write(0x6040, controlword)
    time.sleep(0.03)


@check("every controlword in every state leads where CiA 402 says, with the statusword's low byte")
def table(bench):
    lows = {row["state_after"]: int(row["low_byte_after"], 16) for row in bench.drive.rows("power_state.csv")}
    for row in bench.drive.rows("power_state.csv"):
        if row["state"] not in WAYS or not row["controlword"]:
            continue
        command(bench, 0x00)
        for controlword in WAYS[row["state"]]:
            command(bench, controlword)
        bench.status_becomes(0xFF, lows[row["state"]], f"reach {row['state']}")
        command(bench, int(row["controlword"], 16))
        mask, expected = 0xFF, int(row["low_byte_after"], 16)
        if row.get("bit_13_after"):
            mask, expected = mask | ENERGISED, expected | ENERGISED * int(row["bit_13_after"])
        bench.status_becomes(mask, expected, f"{row['event']} in {row['state']}")


@check("bit 9 of the statusword is set in every state")
def remote(bench):
    for controlword in (0x00, 0x06, 0x07, 0x0F, 0x02):
        command(bench, controlword)
        true(bench.statusword() & 1 << 9, f"bit 9 after 6040h = {controlword:X}h")


@check("canopen-python's own state machine enables and disables the drive")
def by_library(bench):
    for bit, mode in enumerate(("PROFILED POSITION", "VELOCITY", "PROFILED VELOCITY", "PROFILED TORQUE", "", "HOMING")):
        if bench.node._op_mode_support & 1 << bit:
            bench.node.op_mode = mode
            equal(bench.node.op_mode, mode, "mode in canopen-python")
    for state in ("OPERATION ENABLED", "SWITCHED ON", "READY TO SWITCH ON", "SWITCH ON DISABLED"):
        bench.node.state = state
        equal(bench.node.state, state, "state in canopen-python")
