"""Resetting a node and hearing that it has restarted, with canopen-python."""

import threading


def after_reset(node, patience_s):
    """Resets a node; true if its boot-up came within `patience_s` (CiA 301, 7.3.2.3).

    `nmt.wait_for_bootup` hears only what comes after it was called, and a virtual drive may be up again before that. So the
    ear is there before the command goes out.
    """
    booted = threading.Event()
    node.nmt.add_heartbeat_callback(lambda state: state == 0 and booted.set())
    node.nmt.state = "RESET"
    return booted.wait(patience_s)
