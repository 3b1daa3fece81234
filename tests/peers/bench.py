"""What a check works with: a simulator, a canopen-python network and node on it, and a record of every frame."""

import pathlib
import tempfile
import threading
import time

import can
import canopen
from canopen.objectdictionary import ODVariable
from ferrodrive import Simulator, simulator

from checks import PATIENCE_S, eventually

# Of the package: what a busy machine may take is not what a check is about.
simulator.READY_TIMEOUT_S = simulator.ANSWER_TIMEOUT_S = simulator.QUIT_TIMEOUT_S = PATIENCE_S


class Remote:
    """One drive on the bench: its canopen-python node, its objects, its raw frames, its place in the world."""

    def __init__(self, bench, drive, node_id):
        self.bench = bench
        self.drive = drive
        self.node_id = node_id
        self.node = drive.node(node_id)
        self.sdo = self.node.sdo
        self.sdo.RESPONSE_TIMEOUT = 60.0

    def world(self, command):
        """A world command for the drive that was started as this node."""
        return self.bench.simulator.world(f"{self.node_id} {command}")

    def read(self, index, sub=0):
        """Uploads an object and decodes it by its row in objects.csv."""
        od = self._variable(index, sub)
        data = self.sdo.upload(index, sub)
        if len(data) * 8 != len(od):
            raise AssertionError(f"{index:04X}h:{sub:02X}: expected {len(od) // 8} bytes, got {len(data)}")
        return od.decode_raw(data)

    def write(self, index, value, sub=0):
        self.sdo.download(index, sub, self._variable(index, sub).encode_raw(value))

    def _variable(self, index, sub):
        od = self.node.object_dictionary[index]
        return od if isinstance(od, ODVariable) else od[sub]

    def abort_code(self, function, *arguments):
        """The abort code that a transfer ends with, or None when it succeeds."""
        try:
            function(*arguments)
        except canopen.SdoAbortedError as error:
            return error.code
        return None

    def statusword(self):
        return self.read(0x6041)

    def status_becomes(self, mask, expected, what):
        """Waits for bits of the statusword."""
        return eventually(self.statusword, lambda word: word & mask == expected, what)

    def write_all(self, objects):
        """Writes objects with their values: index, sub-index, value."""
        for index, sub, value in objects:
            self.write(index, value, sub)

    def values(self, objects):
        return [self.read(index, sub) for index, sub, _ in objects]

    def becomes(self, index, value, tolerance=0):
        """Waits until an object reads a value, give or take."""
        fits = lambda now: abs(now - value) <= tolerance
        return eventually(lambda: self.read(index), fits, f"{index:04X}h becomes {value} ± {tolerance}")

    def enable(self, mode):
        """Selects a mode and enables operation: by canopen-python's profile where the drive has its power states.

        A host that a busy machine keeps waiting is not taken for lost.
        """
        self.write_all(self.drive.unwatched)
        self.write(0x6060, mode)
        if self.drive.modes is None:
            self.write(0x6040, 0x0F)
            return
        self.node.state = "OPERATION ENABLED"
        self.becomes(0x6061, mode)

    def turn(self, r_min):
        """Profile velocity, up to speed."""
        self.enable(3)
        self.write(0x60FF, r_min)
        self.speed_becomes(r_min)

    def speed_becomes(self, r_min):
        """606Ch, within 2 r/min and 2 %."""
        self.becomes(0x606C, self.drive.per_rpm * r_min, self.drive.per_rpm * max(2, abs(r_min) / 50))

    def move(self, target, relative=False):
        """A set-point of profile position by bits 4 and 12 of CiA 402-2, until bit 10; the joint has no bit 12."""
        ready, acknowledged = 0x0F | relative << 6, 0 if self.drive.modes is None else 1 << 12
        self.write(0x607A, target)
        self.write(0x6040, ready)
        self.status_becomes(acknowledged, 0, "bit 12 falls before the set-point")
        self.write(0x6040, ready | 0x10)
        self.status_becomes(acknowledged, acknowledged, "bit 12 acknowledges the set-point")
        self.write(0x6040, ready)
        self.status_becomes(acknowledged | 1 << 10, 1 << 10, "bit 10 reports that the target is reached")

    def save(self):
        """The drive's command to store, and the time that a real EEPROM takes."""
        index, command, done = self.drive.save
        self.write(index, command)
        self.becomes(index, done)
        self.bench.sleep(0.3)

    def nmt(self, command, node=None):
        self.bench.send(0x000, [command, self.node_id if node is None else node])

    def ask(self, request):
        """Sends a raw SDO request to the drive and returns the raw answer."""
        mark = self.bench.trace.mark()
        self.bench.send(0x600 + self.node_id, request)
        what = f"an answer to {bytes(request).hex(' ')}"
        return bytes(self.bench.trace.wait(0x580 + self.node_id, mark, what).data)

    def answers(self, patience_s=0.5):
        """Whether the drive answers 1000h as its model does. Where it should, read 1000h: a busy machine is late."""
        before, self.sdo.RESPONSE_TIMEOUT = self.sdo.RESPONSE_TIMEOUT, patience_s
        try:
            return self.read(0x1000) == self.drive.device_type
        except canopen.SdoCommunicationError:
            return False
        finally:
            self.sdo.RESPONSE_TIMEOUT = before

    def power_cycle(self):
        """Takes the supply away and gives it back, and waits for the boot-up."""
        mark = self.bench.trace.mark()
        self.world("power cycle")
        self.bench.trace.wait(0x700 + self.node_id, mark, "boot-up after the power cycle", lambda frame: frame.data == b"\0")
        self.bench.sleep(0.05)


class Bench(Remote):
    """The folder's drive behind a simulator, and the network to it. Use it with `with`.

    `drives` are other `--drive` arguments than the folder's own, `extra` more of the command line. With `state` the
    parameter stores are kept in a folder, so that `restart` finds them again. With `absent` the drive is not waited for.
    """

    def __init__(self, program, drive, drives=(), extra=(), state=False, absent=False):
        self.drives = drives or drive.arguments(program)
        super().__init__(self, drive, int(self.drives[0].partition("@")[2].partition(",")[0]))
        self.others = {}
        self.program, self.extra, self.absent = program, list(extra), absent
        self.folder = tempfile.TemporaryDirectory() if state else None
        if state:
            self.extra += ["--state", self.folder.name]
        self.trace = Trace()

    def __enter__(self):
        try:
            self.start()
        except BaseException:
            if self.folder:
                self.folder.cleanup()
            raise
        return self

    def __exit__(self, *_):
        try:
            self.stop()
        finally:
            if self.folder:
                self.folder.cleanup()

    def restart(self, kill=False, drives=None):
        """Ends the simulator, by `quit` or by force, and starts it again with the same command line."""
        self.stop(kill)
        self.drives = drives or self.drives
        self.start()

    def state_files(self):
        return [path for path in pathlib.Path(self.folder.name).rglob("*") if path.is_file()]

    def start(self):
        self.simulator = Simulator(self.drives, extra=self.extra, path=self.program)
        self.simulator.__enter__()
        try:
            self.simulator.wait_until_booted(PATIENCE_S)
            self.network = canopen.Network()
            # How long disconnecting may wait for the reader thread.
            self.network.NOTIFIER_CYCLE = 0.05
            self.network.listeners.append(self.trace)
            self.network.connect(interface="socketcand", host="127.0.0.1", port=self.simulator.port(), channel="can0")
            self.network.add_node(self.node)
            if not self.absent:
                # The boot-up may have gone before we were on the bus, so ask until the node answers.
                eventually(lambda: self.answers(10.0), bool, "the drive answers 1000h")
        except BaseException:
            self.simulator.__exit__(None, None, None)
            raise

    def stop(self, kill=False):
        try:
            self.network.disconnect()
            for node_id in tuple(self.network):
                del self.network[node_id]
        finally:
            self.simulator.kill() if kill else self.simulator.quit()

    def other(self, node_id, drive=None):
        """A further drive of the command line, or the same one under another node-ID."""
        remote = Remote(self, drive or self.drive, node_id)
        self.network.add_node(remote.node)
        self.others[node_id] = remote
        return remote

    def send(self, cob_id, data=b""):
        """Sends a raw frame with python-can."""
        self.network.bus.send(can.Message(arbitration_id=cob_id, data=bytes(data), is_extended_id=False))

    def now(self):
        """The simulated time in seconds, which stands still while a busy machine does not get round to it."""
        return self.simulator.world("now")["t"]

    def sleep(self, duration_s):
        """Waits for simulated time to pass."""
        end = self.now() + duration_s
        while (left := end - self.now()) > 0:
            time.sleep(max(left, 0.001))

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

    def wait(self, cob_id, mark, what, accept=lambda message: True):
        """The first accepted frame with that identifier after the mark."""
        end = time.monotonic() + PATIENCE_S
        with self.arrived:
            while True:
                for message in self.messages[mark:]:
                    if message.arbitration_id == cob_id and accept(message):
                        return message
                left = end - time.monotonic()
                if left <= 0:
                    raise AssertionError(f"{what}: no such frame {cob_id:03X}h")
                self.arrived.wait(left)
