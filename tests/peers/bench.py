"""What a check works with: a simulator, a canopen-python network and node on it, and a record of every frame."""

import collections
import csv
import pathlib
import threading
import time

import can
import canopen
from canopen.objectdictionary import ODRecord, ODVariable, ObjectDictionary, datatypes
from canopen.profiles.p402 import BaseNode402

from checks import eventually
from simulator import Simulator

DATA = pathlib.Path(__file__).resolve().parent.parent / "data" / "zlac8030l"
NODE_ID = 4
TYPES = {
    "U8": datatypes.UNSIGNED8,
    "U16": datatypes.UNSIGNED16,
    "U32": datatypes.UNSIGNED32,
    "I8": datatypes.INTEGER8,
    "I16": datatypes.INTEGER16,
    "I32": datatypes.INTEGER32,
}


def rows(name):
    """The rows of one of the data files, as dictionaries."""
    with open(DATA / name, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def dictionary():
    """The object dictionary that canopen-python needs, from objects.csv."""
    od = ObjectDictionary()
    od.bitrate = 500_000
    of_index = collections.defaultdict(list)
    for row in rows("objects.csv"):
        of_index[int(row["index"], 16)].append(row)
    for index, group in of_index.items():
        if len(group) == 1:
            od.add_object(variable(index, group[0]))
            continue
        record = ODRecord(f"Object {index:04X}h", index)
        for row in group:
            record.add_member(variable(index, row))
        od.add_object(record)
    return od


def variable(index, row):
    sub = int(row["sub"], 16)
    # Names must differ within a dictionary; the manual repeats some.
    result = ODVariable(f"{row['name']} ({index:04X}h:{sub:02X})", index, sub)
    result.data_type = TYPES[row["type"]]
    result.access_type = row["access"]
    result.pdo_mappable = row["pdo_mappable"] == "yes"
    if row["default"]:
        result.default = int(row["default"], 0)
    return result


class Bench:
    """One drive, one network, one node. Use it with `with`."""

    def __init__(self, program, extra=()):
        self.simulator = Simulator(program, extra=extra)
        self.trace = Trace()

    def __enter__(self):
        self.simulator.__enter__()
        try:
            self.network = canopen.Network()
            # How long disconnecting may wait for the reader thread.
            self.network.NOTIFIER_CYCLE = 0.05
            self.network.listeners.append(self.trace)
            self.network.connect(interface="socketcand", host="127.0.0.1", port=self.simulator.port, channel="can0")
            self.node = BaseNode402(NODE_ID, dictionary())
            # The drive has no 6502h (supported modes), which this library insists on. Modes 1, 3, 4 by the manual.
            self.node._op_mode_support = 1 << 0 | 1 << 2 | 1 << 3
            self.network.add_node(self.node)
            self.sdo = self.node.sdo
            self.sdo.RESPONSE_TIMEOUT = 1.0
            self._wait_until_booted()
        except BaseException:
            self.simulator.__exit__(None, None, None)
            raise
        return self

    def __exit__(self, *_):
        try:
            self.network.disconnect()
        finally:
            self.simulator.__exit__(None, None, None)

    def _wait_until_booted(self):
        """The boot-up may have gone before we were on the bus, so ask until the node answers."""
        def answers():
            try:
                return self.read(0x1000) == 0x00040192
            except canopen.SdoCommunicationError:
                return False

        eventually(answers, bool, "the drive answers 1000h", timeout_s=5)

    def world(self, command):
        return self.simulator.world(f"{NODE_ID} {command}")

    def read(self, index, sub=0):
        """Uploads an object and decodes it by its row in objects.csv."""
        od = self.node.object_dictionary[index]
        od = od if isinstance(od, ODVariable) else od[sub]
        data = self.sdo.upload(index, sub)
        if len(data) * 8 != len(od):
            raise AssertionError(f"{index:04X}h:{sub:02X}: expected {len(od) // 8} bytes, got {len(data)}")
        return od.decode_raw(data)

    def write(self, index, value, sub=0):
        od = self.node.object_dictionary[index]
        od = od if isinstance(od, ODVariable) else od[sub]
        self.sdo.download(index, sub, od.encode_raw(value))

    def abort_code(self, function, *arguments):
        """The abort code that a transfer ends with, or None when it succeeds."""
        try:
            function(*arguments)
        except canopen.SdoAbortedError as error:
            return error.code
        return None

    def statusword(self):
        return self.read(0x6041)

    def enable(self, mode):
        """The manual's enabling steps (4.1): mode, 6, 7, Fh."""
        self.write(0x6060, mode)
        self.node.state = "OPERATION ENABLED"
        eventually(lambda: self.read(0x6061), lambda shown: shown == mode, "6061h shows the mode")

    def send(self, cob_id, data):
        """Sends a raw frame with python-can."""
        self.network.bus.send(can.Message(arbitration_id=cob_id, data=bytes(data), is_extended_id=False))

    def nmt(self, command, node=NODE_ID):
        self.send(0x000, [command, node])

    def ask(self, request, timeout_s=1.0):
        """Sends a raw SDO request to the drive and returns the raw answer."""
        mark = self.trace.mark()
        self.send(0x600 + NODE_ID, request)
        return bytes(self.trace.wait(0x580 + NODE_ID, mark, timeout_s, f"an answer to {bytes(request).hex(' ')}").data)

    def last_words(self):
        """What to show when a check failed: the last frames, and what the simulator said."""
        frames = [f"({message.timestamp:.6f}) {message.arbitration_id:03X}#{message.data.hex().upper()}" for message in self.trace.last(12)]
        return frames + self.simulator.stderr()


class Trace(can.Listener):
    """Every frame that others sent, in order. A mark is a place in it."""

    def __init__(self):
        self.messages = []
        self.arrived = threading.Condition()

    def on_message_received(self, msg):
        with self.arrived:
            self.messages.append(msg)
            self.arrived.notify_all()

    def on_error(self, exc):
        """The socket closes while the reader waits: that is how a network ends."""

    def mark(self):
        with self.arrived:
            return len(self.messages)

    def since(self, mark, cob_id):
        with self.arrived:
            return [message for message in self.messages[mark:] if message.arbitration_id == cob_id]

    def last(self, count):
        with self.arrived:
            return self.messages[-count:]

    def wait(self, cob_id, mark, timeout_s, what, accept=lambda message: True):
        """The first accepted frame with that identifier after the mark."""
        end = time.monotonic() + timeout_s
        with self.arrived:
            while True:
                for message in self.messages[mark:]:
                    if message.arbitration_id == cob_id and accept(message):
                        return message
                left = end - time.monotonic()
                if left <= 0:
                    raise AssertionError(f"{what}: no such frame {cob_id:03X}h within {timeout_s} s")
                self.arrived.wait(left)
