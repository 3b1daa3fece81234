"""What a frame costs a LocalNode of canopen-python, with the objects of stack.eds.

    python canopen_python_costs.py EXCHANGE COUNT FILE.eds

Makes the same exchange that many times and prints the processor time of one in nanoseconds. A frame goes in where the
library's listener hands it on, and comes out at a bus that keeps it. A receive PDO is kept by the library, and a transmit PDO
is sent by the application.
"""

import sys
import time

import canopen

EXCHANGES = {
    "upload": (0x605, "4000200000000000", "4F0020000F000000"),
    "download": (0x605, "2B01200034120000", "6001200000000000"),
    "rpdo": (0x205, "3412", None),
    "tpdo": (0x080, "", "0F"),
    "foreign": (0x123, "0001020304050607", None),
}


class Bus:
    """A bus that keeps the last frame."""

    sent = None

    def send(self, message, timeout=None):
        self.sent = message

    def shutdown(self):
        pass


def main():
    name, count, eds = sys.argv[1:]
    identifier, data, expected = EXCHANGES[name]
    data = bytearray.fromhex(data)
    network = canopen.Network(Bus())
    node = network.create_node(5, eds)
    node.sdo[0x2000].raw = 15
    for pdo in (node.rpdo[1], node.tpdo[1]):
        pdo.read()
        pdo.enabled = True
        pdo.subscribe()
    network.subscribe(0x080, lambda *_: node.tpdo[1].transmit())
    node.tpdo[1][0].raw = 15
    network.notify(identifier, data, 0.0)
    answer = network.bus.sent.data.hex().upper() if network.bus.sent else None
    if answer != expected or name == "rpdo" and node.rpdo[1].data != data:
        sys.exit(f"{name}: expected {expected}, got {answer}")
    began = time.process_time_ns()
    for _ in range(int(count)):
        network.notify(identifier, data, 0.0)
    print((time.process_time_ns() - began) / int(count))


if __name__ == "__main__":
    main()
