"""How long an SDO read of canopen-python takes: from a virtual drive in virtual time, and from its own LocalNode on python-can's
virtual bus. Both in turns, so that what else the machine does hits both; the least and the median of each, and their ratio.

    python crates/python/benches/sdo_read.py
"""

import io
import statistics
import time

import canopen
import ferrodrive

READS = 200
ROUNDS = 20


def sheet():
    file = io.StringIO(ferrodrive.eds("cia402"))
    file.name = "cia402.eds"
    return file


def timed_ms(read, clock):
    begin = clock()
    for _ in range(READS):
        read()
    return (clock() - begin) / READS * 1000


def of_drive():
    """A round in virtual time, on the clock of the wall."""
    clock = time.perf_counter
    network = canopen.Network()
    world = ferrodrive.World(timing="ideal")
    world.add("cia402", node=5)
    network.connect(interface="ferrodrive", channel=world)
    node = network.add_node(5, sheet())
    node.nmt.wait_for_bootup(5)
    took_ms = timed_ms(lambda: node.sdo[0x1000].raw, clock)
    network.disconnect()
    return took_ms


def of_local_node():
    """A round between two networks of canopen-python."""
    local, remote = canopen.Network(), canopen.Network()
    for network in (local, remote):
        network.NOTIFIER_CYCLE = 0.05
        network.connect(interface="virtual", channel="bench")
    local.create_node(5, sheet())
    node = remote.add_node(5, sheet())
    took_ms = timed_ms(lambda: node.sdo[0x1000].raw, time.perf_counter)
    for network in (remote, local):
        network.disconnect()
    return took_ms


def main():
    rounds = [(of_drive(), of_local_node()) for _ in range(ROUNDS)]
    names = ("virtual drive in virtual time", "LocalNode on the virtual bus")
    for name, times in zip(names, zip(*rounds)):
        print(f"{name}: least {min(times):.3f} ms, median {statistics.median(times):.3f} ms")
    ratio = statistics.median(ours / theirs for ours, theirs in rounds)
    print(f"ratio, median of {ROUNDS} rounds: {ratio:.2f}")


if __name__ == "__main__":
    main()
