"""What is heard after something was sent, with canopen-python.

`nmt.wait_for_bootup` and `pdo.wait_for_reception` hear only what comes after they were called, and a virtual drive may have answered
before that. So the ear is there before the frame goes out.
"""

import threading


def boot_up_after_reset(node, patience_s):
    """Resets a node; true if its boot-up came within `patience_s` (CiA 301, 7.3.2.3)."""
    booted = threading.Event()
    node.nmt.add_heartbeat_callback(lambda state: state == 0 and booted.set())
    node.nmt.state = "RESET"
    return booted.wait(patience_s)


def pdo_after(send, pdo, patience_s):
    """Calls `send`; true if the node's `pdo` came within `patience_s`. Its values are those of it then."""
    came = threading.Event()

    def hears(_):
        came.set()

    pdo.add_callback(hears)
    try:
        send()
        return came.wait(patience_s)
    finally:
        pdo.callbacks.remove(hears)
