"""canopen-python over Linux's own CAN, `vcan0` or a pair of controllers, against `ferrodrive sim --bus`.

Run by `cargo xtask vcan-test` in a machine that has these interfaces. One line a check: `ok NAME` or `FAILED NAME: why`. Exit
status 1 when a check failed. Figures are those of "ZLAC8030L quick start guide V1.00".

    python on_socketcan.py --program target/debug/ferrodrive
"""

import argparse
import contextlib
import json
import logging
import pathlib
import subprocess
import sys
import tempfile
import time

import canopen
import ears
import round_trips

NODE = 4
#: Round trips for the figures: no check depends on them.
ROUND_TRIPS = 300
#: Longest wait for an answer: a guest without hardware support is slow.
PATIENCE_S = 120
#: The same for `ferrodrive latency`, which listens so long for nodes whose motor is switched on before it sends SYNC.
LISTEN_S = 20


def device_type(node):
    """CiA 402: the lower half of 1000h is the number of the profile."""
    value = node.sdo[0x1000].raw
    assert value & 0xFFFF == 402, f"1000h is {value:X}h"


def value_is_written_and_read_back(node):
    """6083h, profile acceleration, and the abort code of CiA 301, 7.2.4.3.17, for an object that is not there."""
    node.sdo[0x6083].raw = 250
    assert node.sdo[0x6083].raw == 250
    try:
        node.sdo.upload(0x5FFF, 0)
    except canopen.SdoAbortedError as error:
        assert error.code == 0x06020000, f"{error.code:08X}h"
    else:
        raise AssertionError("5FFFh is there")


def reset_is_followed_by_boot_up(node):
    """CiA 301, 7.3.2.3: a node that has restarted reports it."""
    assert ears.boot_up_after_reset(node, PATIENCE_S), "no boot-up"


def sync_is_answered_by_a_pdo(node):
    """TPDO 1, set to each SYNC (transmission type 1) with the statusword in it, by CiA 301, 7.5.2.37."""
    node.nmt.state = "PRE-OPERATIONAL"
    node.tpdo.read()
    pdo = node.tpdo[1]
    pdo.clear()
    pdo.add_variable(0x6041)
    pdo.trans_type, pdo.enabled = 1, True
    pdo.save()
    node.nmt.state = "OPERATIONAL"
    network = node.network
    network.sync.start(0.1)
    try:
        assert pdo.wait_for_reception(PATIENCE_S) is not None, "no PDO"
    finally:
        network.sync.stop()
    assert pdo[0].raw == node.sdo[0x6041].raw


CHECKS = [device_type, value_is_written_and_read_back, reset_is_followed_by_boot_up, sync_is_answered_by_a_pdo]
#: Where the drive is, and where canopen-python is.
BUSES = [("vcan0", "vcan0"), ("can0", "can1")]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", required=True, help="the ferrodrive binary")
    program = parser.parse_args().program
    logging.disable(logging.CRITICAL)
    failed = 0
    with tempfile.TemporaryDirectory() as folder:
        sheet = pathlib.Path(folder) / "drive.eds"
        sheet.write_bytes(subprocess.run([program, "eds", "zlac8030l"], check=True, capture_output=True).stdout)
        for of_drive, ours in BUSES:
            failed += on(program, sheet, of_drive, ours)
    return 1 if failed else 0


def on(program, sheet, of_drive, ours):
    """Runs every check with the drive on one interface and canopen-python on the other; how many failed."""
    failed = 0
    with simulator(program, of_drive):
        network = canopen.Network()
        network.connect(interface="socketcan", channel=ours)
        try:
            node = network.add_node(NODE, str(sheet))
            node.sdo.RESPONSE_TIMEOUT = PATIENCE_S
            for check in CHECKS:
                name = f"canopen-python on {ours}: {check.__name__}"
                try:
                    check(node)
                    print(f"ok {name}", flush=True)
                except Exception as error:  # any error of a check or a library is this check's failure
                    failed += 1
                    print(f"FAILED {name}: {type(error).__name__}: {error}", flush=True)
            print(f"canopen-python on {ours}: {round_trips.summary(node, ROUND_TRIPS)}", flush=True)
        finally:
            network.disconnect()
        ask = [program, "--bus", ours, "--timeout", f"{LISTEN_S}s", "latency", str(NODE), "--count", str(ROUND_TRIPS)]
        latency = subprocess.run(ask, capture_output=True, text=True)
        figures = (latency.stdout or latency.stderr).split("\n\n")[0]
        print(f"ferrodrive latency on {ours}:\n{figures}", flush=True)
    return failed


@contextlib.contextmanager
def simulator(program, bus):
    """A drive that has joined `bus` and has booted."""
    command = [program, "--bus", bus, "sim", "--drive", f"zlac8030l@{NODE},timing=ideal"]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1)
    try:
        ready = process.stdout.readline().strip()
        assert ready == f"ready {bus}", ready
        until = time.monotonic() + PATIENCE_S
        while True:
            process.stdin.write(f"{NODE} get\n")
            if json.loads(process.stdout.readline())["power"] == "on":
                break
            assert time.monotonic() < until, "the drive has not booted"
            time.sleep(0.05)
        yield
    finally:
        process.stdin.write("quit\n")
        process.stdin.close()
        process.wait(PATIENCE_S)


if __name__ == "__main__":
    sys.exit(main())
