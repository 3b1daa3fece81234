"""The CiA 402 power states and the statusword (manual 4.1, 4.5, 4.6, 7; CiA 402-2)."""

import time

from zlac8030l import rows
from checks import check, equal, eventually, true

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


def low_byte_becomes(bench, expected, what):
    eventually(lambda: bench.statusword() & 0xFF, lambda low: low == expected, what, timeout_s=1.5)


@check("every controlword in every state leads where CiA 402 says, with the statusword's low byte")
def table(bench):
    lows = {row["state_after"]: int(row["low_byte_after"], 16) for row in rows("power_state.csv")}
    for row in rows("power_state.csv"):
        if row["state"] not in WAYS or not row["controlword"]:
            continue
        command(bench, 0x00)
        for controlword in WAYS[row["state"]]:
            command(bench, controlword)
        low_byte_becomes(bench, lows[row["state"]], f"reach {row['state']}")
        command(bench, int(row["controlword"], 16))
        low_byte_becomes(bench, int(row["low_byte_after"], 16), f"{row['event']} in {row['state']}")


@check("bit 9 of the statusword is set in every state")
def remote(bench):
    for controlword in (0x00, 0x06, 0x07, 0x0F):
        command(bench, controlword)
        true(bench.statusword() & 1 << 9, f"bit 9 after 6040h = {controlword:X}h")


@check("canopen-python's own state machine enables and disables the drive")
def by_library(bench):
    for mode in ("PROFILED POSITION", "PROFILED VELOCITY", "PROFILED TORQUE"):
        bench.node.op_mode = mode
        equal(bench.node.op_mode, mode, "mode in canopen-python")
    bench.node.state = "OPERATION ENABLED"
    equal(bench.node.state, "OPERATION ENABLED", "state")
    bench.node.state = "SWITCHED ON"
    equal(bench.node.state, "SWITCHED ON", "state")
    bench.node.state = "SWITCH ON DISABLED"
    equal(bench.node.state, "SWITCH ON DISABLED", "state")


@check("the drive's default receive PDO takes the controlword")
def by_pdo(bench):
    bench.nmt(0x01)
    time.sleep(0.05)
    for controlword, low in ((0x06, 0x31), (0x07, 0x33), (0x0F, 0x37), (0x00, 0x70)):
        bench.send(0x204, controlword.to_bytes(2, "little"))
        low_byte_becomes(bench, low, f"204h with {controlword:02X}h")
