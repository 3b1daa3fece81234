"""How evenly a client's SYNC arrives over TCP: intervals as the virtual wire saw them. A figure, not a check.

    python tests/peers/sync_over_tcp.py target/dist/ferrodrive [--tcp-tune] [--period 0.02] [--for 12]

Without --tcp-tune the client is python-can as it comes, with Nagle's algorithm on.
"""

import argparse
import pathlib
import statistics
import subprocess
import tempfile
import time

import can

SYNC = can.Message(arbitration_id=0x80, data=[], is_extended_id=False)
BOOT_TIME_S = 2.0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("binary")
    parser.add_argument("--tcp-tune", action="store_true")
    parser.add_argument("--period", type=float, default=0.02, help="seconds")
    parser.add_argument("--for", type=float, default=12.0, dest="duration", help="seconds")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        log = pathlib.Path(folder) / "bus.log"
        intervals = sorted(measure(arguments, log))
    quantile = lambda part: intervals[min(len(intervals) - 1, int(part * len(intervals)))]
    print(
        f"{len(intervals)} intervals in ms: least {intervals[0]:.1f}, 1 % {quantile(0.01):.1f}, "
        f"median {statistics.median(intervals):.1f}, 99 % {quantile(0.99):.1f}, most {intervals[-1]:.1f}"
    )


def measure(arguments, log):
    """Milliseconds between one SYNC and the next, as `sim --log` has them."""
    command = [arguments.binary, "sim", "--drive", "zlac8030l@4", "--serve", "socketcand://127.0.0.1:0", "--log", str(log)]
    simulator = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    try:
        port = int(simulator.stdout.readline().split(":")[-1])
        bus = can.Bus(
            interface="socketcand", host="127.0.0.1", port=port, channel="can0", tcp_tune=arguments.tcp_tune
        )
        # Until the drive has booted no node acknowledges a frame on the wire, and it is repeated.
        time.sleep(BOOT_TIME_S)
        task = bus.send_periodic(SYNC, arguments.period)
        end = time.monotonic() + arguments.duration
        while time.monotonic() < end:
            bus.recv(0.1)
        task.stop()
        bus.shutdown()
    finally:
        simulator.communicate("quit\n", timeout=30)
    times = [float(line[1 : line.index(")")]) for line in log.read_text().splitlines() if line.endswith(" 080#")]
    return [(later - earlier) * 1e3 for earlier, later in zip(times, times[1:])]


main()
