"""A scenario that is served: canopen-python is the host that it waits for."""

import json
import pathlib
import subprocess
import tempfile

import canopen
from checks import check, equal
from drive import ZLAC8030L

#: The supply breaks down when the wheel has come to its speed; 0002h is under-voltage (ZLAC8030L quick start guide V1.00, 8).
SCENARIO = """
title = "Brown-out under a host outside"
limit = "60s"
machine = { drive = [{ model = "zlac8030l", node = 4 }] }
[[step]]
name = "brown-out"
when = "4 event target reached"
do = "4 supply 12"
[[expect]]
that = "4 event fault 0x0002"
after = "brown-out"
within = "200ms"
[[expect]]
that = "frame 604#23FF60"
[[expect]]
that = "4 velocity = 60 +- 6"
"""

#: Longest wait for the end of a scenario, on a busy machine.
PATIENCE_S = 600


@check("a scenario that is served waits for canopen-python, meets it as its host, and ends with what it expects", ZLAC8030L)
def served(bench):
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "scenario.toml"
        path.write_text(SCENARIO, encoding="utf-8")
        words = [bench.program, "--json", "run", str(path), "--serve", "socketcand://127.0.0.1:0"]
        with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
            try:
                report = turn_until_the_end(process)
                equal((process.wait(PATIENCE_S), report["ok"]), (0, True), f"exit status and verdict of {report}")
            finally:
                process.kill()


def turn_until_the_end(process):
    """Turns the wheel of the scenario, and returns its report."""
    (address,) = json.loads(process.stdout.readline())["ready"]
    network = canopen.Network()
    port = int(address.rsplit(":", 1)[1])
    network.connect(interface="socketcand", host="127.0.0.1", port=port, channel="can0", tcp_tune=True)
    try:
        sdo = network.add_node(4, canopen.ObjectDictionary()).sdo
        sdo.RESPONSE_TIMEOUT = 60.0
        # As delivered it stops when it has heard nothing for a second.
        sdo.download(0x2000, 0, (0).to_bytes(2, "little"))
        sdo.download(0x6060, 0, b"\x03")
        for controlword in (6, 7, 15):
            sdo.download(0x6040, 0, controlword.to_bytes(2, "little"))
        sdo.download(0x60FF, 0, (60).to_bytes(4, "little"))
        return json.loads(process.stdout.readline())
    finally:
        try:
            network.disconnect()
        except OSError:
            pass  # the scenario is over, and its bus with it
