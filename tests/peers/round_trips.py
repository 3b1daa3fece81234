"""How long canopen-python takes for an SDO round trip on a bus, beside `ferrodrive latency` on the same. A figure, not a check.

    python tests/peers/round_trips.py --interface socketcand --host 127.0.0.1 --port 29536 --channel can0 --node 4 [--count 1000]
    python tests/peers/round_trips.py --interface slcan --channel socket://127.0.0.1:3000
"""

import argparse
import time

import canopen


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--interface", default="socketcand")
    parser.add_argument("--host", default=None)
    parser.add_argument("--port", type=int, default=None)
    parser.add_argument("--channel", default="can0")
    parser.add_argument("--node", type=int, default=4)
    parser.add_argument("--count", type=int, default=1000)
    arguments = parser.parse_args()
    place = {"host": arguments.host, "port": arguments.port, "tcp_tune": True} if arguments.host else {}
    network = canopen.Network()
    network.connect(interface=arguments.interface, channel=arguments.channel, **place)
    try:
        node = network.add_node(arguments.node, canopen.ObjectDictionary())
        node.sdo.RESPONSE_TIMEOUT = 2.0
        node.sdo.upload(0x1000, 0)
        print(summary(node, arguments.count))
    finally:
        network.disconnect()


def summary(node, count):
    """`count` round trips to the node, in words."""
    times = sorted(timed(node) for _ in range(count))
    quantile = lambda part: times[min(len(times) - 1, int(part * len(times)))]
    return (
        f"{len(times)} round trips in us: least {times[0]:.0f}, median {quantile(0.5):.0f}, 99 % {quantile(0.99):.0f}, "
        f"99.9 % {quantile(0.999):.0f}, most {times[-1]:.0f}"
    )


def timed(node):
    """Microseconds of one upload of 1000h."""
    began = time.perf_counter()
    node.sdo.upload(0x1000, 0)
    return (time.perf_counter() - began) * 1e6


if __name__ == "__main__":
    main()
