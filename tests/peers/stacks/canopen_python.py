"""A LocalNode of canopen-python on a bus of `ferrodrive sim`, for the conformance test.

    python canopen_python.py HOST PORT NODE FILE.eds

Runs until its standard input ends. Nothing is added to what the library does by itself: what an application has to do
(PDOs, a reset of the application) stays undone, and shows as it would to a user.
"""

import sys

import canopen
import can


def main():
    host, port, node_id, eds = sys.argv[1:]
    bus = can.Bus(interface="socketcand", host=host, port=int(port), channel="can0")
    network = canopen.Network(bus)
    network.connect()
    node = network.create_node(int(node_id), eds)
    node.nmt.send_command(0)
    print("running", flush=True)
    sys.stdin.read()
    network.disconnect()


if __name__ == "__main__":
    main()
