"""A program of the handbook: a test with canopen-python against a drive of `ferrodrive sim`."""

import json
import re
import subprocess
import time

import canopen

PROGRAM = "ferrodrive"
PATIENCE_S = 60  # a busy machine takes its time


def wait_until(is_so, what):
    end = time.monotonic() + PATIENCE_S
    while not is_so():
        assert time.monotonic() < end, what
        time.sleep(0.02)


class Drive:
    """A ZLAC8030L at node 4 that runs as long as the `with` block."""

    def __enter__(self):
        command = [PROGRAM, "sim", "--drive", "zlac8030l@4", "--serve", "socketcand://127.0.0.1:0"]
        self.sim = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        port = int(re.search(r":(\d+)", self.sim.stdout.readline())[1])
        self.network = canopen.Network()
        self.network.connect(interface="socketcand", host="127.0.0.1", port=port, channel="can0", tcp_tune=True)
        self.sdo = self.network.add_node(4, canopen.ObjectDictionary()).sdo
        self.sdo.RESPONSE_TIMEOUT = PATIENCE_S
        wait_until(lambda: self.machine("4 get")["power"] == "on", "it boots")  # which takes a drive about a second
        wait_until(lambda: self.statusword() & 0x4F == 0x40, "switch on disabled (CiA 402)")
        return self

    def __exit__(self, *_):
        self.network.disconnect()
        self.sim.communicate("quit\n")

    def machine(self, command):
        """What happens to the machine, in the words of the terminal; its answer."""
        self.sim.stdin.write(command + "\n")
        self.sim.stdin.flush()
        return json.loads(self.sim.stdout.readline())

    def write(self, index, value, size):
        self.sdo.download(index, 0, value.to_bytes(size, "little", signed=True))

    def statusword(self):
        return int.from_bytes(self.sdo.upload(0x6041, 0), "little")


def test_a_fault_is_seen():
    with Drive() as drive:
        drive.write(0x2000, 0, 2)  # it does not take this host for lost, however long it is silent
        drive.write(0x6060, 3, 1)  # profile velocity
        for controlword in (6, 7, 15):
            drive.write(0x6040, controlword, 2)
        drive.write(0x60FF, 60, 4)
        wait_until(lambda: abs(drive.machine("4 get")["velocity_rpm"] - 60) < 2, "60 r/min")
        drive.machine("4 fault hall on")
        wait_until(lambda: drive.statusword() & 0x4F == 0x08, "fault (CiA 402)")


if __name__ == "__main__":
    test_a_fault_is_seen()
    print("the test passes")
