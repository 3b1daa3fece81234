"""Checks of `ferrodrive fmu`: FMPy validates and steps drive and bus by FMI 3.0.

Operations are written here by the layered standard for buses (fmi-ls-bus 1.0, "CAN, CAN FD, CAN XL"), not by our own code."""

import contextlib
import ctypes
import math
import pathlib
import random
import struct
import subprocess
import sys
import tempfile

import ferrodrive
import fmpy
from fmpy.fmi1 import FMICallException
from fmpy.fmi3 import FMU3Slave
from fmpy.validation import validate_fmu
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from checks import PATIENCE_S, check, equal, near, true
from drive import ZLAC8030L

FORMAT_ERROR, TRANSMIT, CONFIRM, CONFIGURATION, STATUS = 0x01, 0x10, 0x20, 0x40, 0x41


def transmit(identifier, data):
    return struct.pack("<IIIBBH", TRANSMIT, 16 + len(data), identifier, 0, 0, len(data)) + data


def download(node, index, data):
    """An expedited SDO download (CiA 301, 7.2.4.3.3)."""
    return transmit(0x600 + node, bytes([0x23 | (4 - len(data)) << 2]) + struct.pack("<HB", index, 0) + data.ljust(4, b"\0"))


def operations(data):
    while data:
        code, length = struct.unpack_from("<II", data)
        yield code, data[8:length]
        data = data[length:]


def pack(bench, folder, *words):
    path = pathlib.Path(folder) / f"{len(list(pathlib.Path(folder).iterdir()))}.fmu"
    done = subprocess.run([bench.program, "fmu", *words, "-o", str(path)], capture_output=True, text=True, timeout=120)
    equal(done.returncode, 0, f"exit status of {words}: {done.stdout}{done.stderr}")
    return str(path)


class Slave:
    """An instance by FMPy's own classes, its variables by their names."""

    def __init__(self, kind, path, folder, name, guid=None, **options):
        description = fmpy.read_model_description(path)
        self.reference = {variable.name: variable.valueReference for variable in description.modelVariables}
        self.fmu = kind(
            guid=guid or description.guid,
            unzipDirectory=fmpy.extract(path, unzipdir=tempfile.mkdtemp(dir=folder)),
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName=name,
        )
        self.fmu.instantiate(**options)
        self.time = 0.0

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.fmu.freeInstance()


class Instance(Slave):
    """By FMI 3.0."""

    def __init__(self, path, folder, events=False, guid=None):
        super().__init__(FMU3Slave, path, folder, "it", guid, eventModeUsed=events)

    def begin(self):
        self.fmu.enterInitializationMode(startTime=0.0)
        self.fmu.exitInitializationMode()

    def step(self, seconds):
        self.fmu.doStep(self.time, seconds)
        self.time += seconds

    def real(self, name):
        return self.fmu.getFloat64([self.reference[name]])[0]

    def send(self, data):
        self.fmu.setBinary([self.reference["CAN.Rx_Data"]], [data])

    def sent(self):
        return self.fmu.getBinary([self.reference["CAN.Tx_Data"]])[0] or b""


@check("FMPy finds nothing wrong with the FMUs of drives and buses", ZLAC8030L)
def valid(bench):
    with tempfile.TemporaryDirectory() as folder:
        joint = ["m4230e17b50@5", "--rule", "hold", "--clock", "triggered"]
        for words in (["zlac8030l@4"], joint, ["bus", "--nodes", "3"]):
            equal(validate_fmu(pack(bench, folder, *words)), [], f"problems of {words}")


@check("FMPy turns a drive by SDO over its bus terminal, and loads it", ZLAC8030L)
def turned(bench):
    with tempfile.TemporaryDirectory() as folder, Instance(pack(bench, folder, "zlac8030l@4"), folder) as drive:
        drive.begin()
        said = drive.sent()
        for _ in range(1600):
            drive.step(1e-3)
            said += drive.sent()
        codes = list(operations(said))
        true((CONFIGURATION, b"\x01" + struct.pack("<I", 500_000)) in codes, "it states its bit rate")
        true((TRANSMIT, struct.pack("<IBBH", 0x704, 0, 0, 1) + b"\0") in codes, "it boots up")
        for index, data in ((0x6060, b"\3"), (0x6040, b"\6\0"), (0x6040, b"\7\0"), (0x6040, b"\x0f\0"), (0x60FF, b"\x3c\0\0\0")):
            drive.send(download(4, index, data))
            for _ in range(20):
                drive.step(1e-3)
        turn(drive, 1000)
        near(drive.real("velocity"), 2 * math.pi, 0.05, "60 r/min in rad/s")
        before = drive.real("current")
        drive.fmu.setFloat64([drive.reference["load_torque"]], [2.0])
        turn(drive, 500)
        near(drive.real("velocity"), 2 * math.pi, 0.05, "60 r/min under load in rad/s")
        true(drive.real("current") > before + 0.5, "2 N·m take more current")


def turn(drive, steps):
    """Lets it turn; without a message for 1 s (2000h) it would stop by itself."""
    for step in range(steps):
        if step % 200 == 0:
            drive.send(download(4, 0x60FF, b"\x3c\0\0\0"))
        drive.step(1e-3)


SCENARIO = """
title = "a load turns a wheel whose supply sags"
end = "2s"
[machine]
timing = "ideal"
drive = [{ model = "zlac8030l", node = 4 }]
[[step]]
at = "1700ms"
do = ["4 load torque 0.5", "4 supply 40"]
[figures]
velocity = "last 4 velocity"
supply = "last 4 supply"
"""


@check("a load turns the same drive in an FMU, in a scenario and in a world of Python, to the last bit", ZLAC8030L)
def alike(bench):
    world = ferrodrive.World()
    of_python = world.add("zlac8030l", node=4)
    with tempfile.TemporaryDirectory() as folder, Instance(pack(bench, folder, "zlac8030l@4"), folder) as drive:
        drive.begin()
        for _ in range(1700):
            drive.step(1e-3)
        inputs = [drive.reference["load_torque"], drive.reference["supply_voltage"]]
        drive.fmu.setFloat64(inputs, [0.5, 40.0])
        for _ in range(299):
            drive.step(1e-3)
        # The last sample of the scenario is 1 ms before its end.
        (path := pathlib.Path(folder) / "load.toml").write_text(SCENARIO)
        figures = ferrodrive.run(path).figures
        equal(drive.real("velocity"), figures["velocity"] * math.pi / 30, "speed in a scenario")
        equal(drive.real("bus_voltage"), figures["supply"], "supply in a scenario")
        drive.step(1e-3)
        world.run_for(1.7)
        world.apply("4 load torque 0.5")
        world.apply("4 supply 40")
        world.run_for(0.3)
        names = ("angle", "current", "bus_voltage")
        expected = [of_python.shaft_angle_rad, of_python.current_a, of_python.supply_v]
        equal([drive.real(name) for name in names], expected, ", ".join(names))
        equal(drive.fmu.getUInt16([drive.reference["statusword"]])[0], of_python.statusword, "statusword")
        true(of_python.statusword & 0x4F == 0x40 and abs(of_python.velocity_rpm) > 10, "it has booted, and turns")


@check("a joint that FMPy's importer moves gets the torque that Python's exchange gives, to the last bit", ZLAC8030L)
def joint(bench):
    inertia_kg_m2, stiffness_nm_rad, step_s = 0.1, 4.0, 1e-3
    world = ferrodrive.World()
    world.add("zlac8030l", node=4)
    world.external([4])
    with tempfile.TemporaryDirectory() as folder, Instance(pack(bench, folder, "zlac8030l@4", "--rule", "integrate"), folder) as drive:
        drive.begin()
        equal(drive.real("joint_inertia"), world.external_shafts()[0].inertia_kg_m2, "inertia of the drive at the joint")
        angle, velocity, most = 0.0, 0.0, 0.0
        inputs = [drive.reference[name] for name in ("joint_angle", "joint_velocity")]
        for step in range(600):
            drive.fmu.setFloat64(inputs, [angle, velocity])
            drive.step(step_s)
            torque = drive.real("joint_torque")
            equal(torque, world.exchange(step_s, [angle], [velocity])[0], f"torque, step {step}")
            # A spring to 0.5 rad, by semi-implicit Euler.
            velocity += (torque + stiffness_nm_rad * (0.5 - angle)) / inertia_kg_m2 * step_s
            angle += velocity * step_s
            most = max(most, abs(angle))
        # Twice 0.5 rad, less dry friction of 0.1 N·m on the way out (closed form), and half a step of the importer's own.
        near(most, 1.0 - 2 * 0.099 / stiffness_nm_rad, 0.02, "the furthest in rad")
        for value in (math.nan, math.inf, 1e7):
            refused(lambda value=value: drive.fmu.setFloat64(inputs[:1], [value]), f"an angle of {value}")
        refused(lambda: drive.fmu.setFloat64([drive.reference["load_inertia"]], [1.0]), "a parameter while it runs")
        refused(lambda: drive.fmu.doStep(0.0, step_s), "a step backwards")
        drive.fmu.setFloat64(inputs, [angle + 3.0, 0.0])
        refused(lambda: drive.step(step_s), "a joint that was put elsewhere")
        drive.fmu.setFloat64(inputs, [angle, velocity])
        drive.step(step_s)


@check("a state that FMPy takes back, also from bytes, goes on alike", ZLAC8030L)
def states(bench):
    with tempfile.TemporaryDirectory() as folder, Instance(pack(bench, folder, "zlac8030l@4"), folder) as drive:
        drive.begin()
        for _ in range(200):
            drive.step(1e-3)
        state = drive.fmu.getFMUState()
        data = drive.fmu.serializeFMUState(state)
        begin = drive.time

        def onward():
            drive.time = begin
            drive.fmu.setFloat64([drive.reference["supply_voltage"]], [30.0])
            seen = []
            for _ in range(300):
                drive.step(1e-3)
                seen.append((drive.real("bus_voltage"), drive.sent()))
            return seen

        first = onward()
        drive.fmu.setFMUState(state)
        equal(onward(), first, "from the state")
        drive.fmu.setFMUState(drive.fmu.deserializeFMUState(data))
        equal(onward(), first, "from its bytes")
        refused(lambda: drive.fmu.deserializeFMUState(data[:-1]), "a torn state")


@check("wrong calls are answered with the standard's status, and the process lives", ZLAC8030L)
def wrong(bench):
    with tempfile.TemporaryDirectory() as folder:
        path = pack(bench, folder, "zlac8030l@4")
        refused(lambda: Instance(path, folder, guid="of another"), "a wrong token")
        with Instance(path, folder) as drive:
            refused(lambda: drive.step(1e-3), "a step before initialization")
            drive.begin()
            drive.step(1e-3)
            refused(lambda: drive.fmu.doStep(0.0, 1e-3), "a step backwards")
            refused(lambda: drive.fmu.getFloat64([12345]), "a variable that is not there")
            refused(lambda: drive.fmu.getUInt16([drive.reference["angle"]]), "a variable of another type")
            refused(lambda: drive.fmu.setFloat64([drive.reference["load_torque"]], [math.nan]), "not a number")
            refused(lambda: drive.fmu.setFMUState(ctypes.c_void_p(99)), "a state that is not one")
            refused(lambda: drive.fmu.setBinary([drive.reference["CAN.Tx_Data"]], [b""]), "an output that is set")
            refused(lambda: drive.fmu.setBinary([drive.reference["load_torque"]], [bytes(8)]), "bytes for a number")
            drive.step(1e-3)


@check("10,000 mutated buffers to a drive and to a bus are answered by format errors, and the importing process lives", ZLAC8030L)
def mutated(bench):
    chance = random.Random(27)
    seeds = [download(4, 0x6040, b"\6\0"), struct.pack("<IIBI", CONFIGURATION, 13, 1, 500_000), struct.pack("<IIB", STATUS, 9, 3)]
    with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as stack:
        words = (["zlac8030l@4,timing=ideal", "--clock", "triggered"], ["bus", "--nodes", "3", "--clock", "triggered"])
        both = [stack.enter_context(Instance(pack(bench, folder, *each), folder)) for each in words]
        answers = 0
        for each, terminal in zip(both, ("CAN", "Node1")):
            each.begin()
            for _ in range(10_000):
                data = bytearray(b"".join(chance.choices(seeds, k=chance.randint(1, 3))))
                for _ in range(chance.randint(0, 4)):
                    data[chance.randrange(len(data))] = chance.randrange(256)
                del data[chance.randint(0, len(data)) :: chance.choice((1, len(data)))]
                each.fmu.setBinary([each.reference[f"{terminal}.Rx_Data"]], [bytes(data)])
                each.step(1e-4)
                said = each.fmu.getBinary([each.reference[f"{terminal}.Tx_Data"]])[0] or b""
                answers += sum(code == FORMAT_ERROR for code, _ in operations(said))
        true(answers > 1000, f"{answers} format errors")


def refused(call, what):
    """fmi2Error or fmi3Error, or an instance that was not made, for which FMPy has a plain exception of one of these texts."""
    try:
        call()
    except FMICallException as error:
        equal(error.status, 3, f"status of {what}")
    except Exception as error:
        equal((type(error), str(error)[:22]), (Exception, "Failed to instantiate "), what)
    else:
        raise AssertionError(f"{what} was taken")


class Network:
    """A bus and its nodes, stepped from event to event by their countdowns (FMI 3.0, 4.2; fmi-ls-bus, "Time-based Tx Clocks")."""

    def __init__(self, bus, nodes, script=None):
        self.script = script
        self.heard = [[] for _ in nodes]
        self.ends = [(bus, f"Node{number}", node, "CAN") for number, node in enumerate(nodes, 1)]
        self.instances = [*nodes, bus]
        self.now = 0
        for instance in self.instances:
            instance.fmu.enterInitializationMode(startTime=0.0)
            if "CAN.BusNotifications" in instance.reference:
                instance.fmu.setBoolean([instance.reference["CAN.BusNotifications"]], [True])
            instance.fmu.exitInitializationMode()

    def run(self, until):
        """To `until`, in ns."""
        while self.now < until:
            after = min([self.event(), until])
            flags = []
            for instance in self.instances:
                instance.fmu.enterStepMode()
                flags.append(instance.fmu.doStep(self.now / 1e9, (after - self.now) / 1e9)[0])
                instance.fmu.enterEventMode()
            self.now = after
            due = [any(self.left(instance, name) == 0 for name in self.clocks(instance)) for instance in self.instances]
            equal(flags, due, f"who needs an event at {self.now} ns")

    def clocks(self, instance):
        return [name for name in instance.reference if name.endswith(".Tx_Clock")]

    def left(self, instance, name):
        """ns until a clock ticks; None for never."""
        interval, qualifier = (ctypes.c_double * 1)(), (ctypes.c_int * 1)()
        instance.fmu.getIntervalDecimal((ctypes.c_uint32 * 1)(instance.reference[name]), interval, qualifier)
        return None if qualifier[0] == 0 else round(interval[0] * 1e9)

    def taken(self, instance, terminal):
        """What has to be sent at this instant, and in how many ns the next will be."""
        left = self.left(instance, f"{terminal}.Tx_Clock")
        if left != 0:
            return None, left
        instance.fmu.setClock([instance.reference[f"{terminal}.Tx_Clock"]], [True])
        return instance.fmu.getBinary([instance.reference[f"{terminal}.Tx_Data"]])[0] or b"", None

    def event(self):
        """All rounds at this instant; when the next one is, in ns."""
        for _ in range(100):
            moves, lefts = [], []
            for place, (bus, node, drive, can) in enumerate(self.ends):
                for source, terminal, sink, other in ((drive, can, bus, node), (bus, node, drive, can)):
                    data, left = self.taken(source, terminal)
                    lefts.append(left)
                    if data is not None:
                        moves.append((sink, other, data))
                    if data and source is bus:
                        self.heard[place] += [(self.now, *operation) for operation in operations(data)]
            if self.script:
                data, left = self.taken(self.instances[-1], self.script.terminal)
                lefts += [left, self.script.left(self.now)]
                if data is not None:
                    moves.append((None, "", b""))
                    self.script.receive(self.now, data)
                if data := self.script.due(self.now):
                    moves.append((self.instances[-1], self.script.terminal, data))
            if not moves:
                return self.now + min([left for left in lefts if left is not None], default=10**9)
            for sink, terminal, data in moves:
                if data:
                    sink.fmu.setClock([sink.reference[f"{terminal}.Rx_Clock"]], [True])
                    sink.fmu.setBinary([sink.reference[f"{terminal}.Rx_Data"]], [data])
            for instance in self.instances:
                instance.fmu.updateDiscreteStates()
        raise AssertionError(f"the event at {self.now} ns has no end")


class Script:
    """A node of the test's own, from the layered standard's text: it states its bit rate, sends frames at their instants (ns, identifier,
    data), and keeps each operation that it receives with its instant."""

    def __init__(self, terminal, bitrate, frames):
        self.terminal = terminal
        self.operations = [(0, struct.pack("<IIBI", CONFIGURATION, 13, 1, bitrate))]
        self.operations += [(at, transmit(identifier, data)) for at, identifier, data in frames]
        self.received = []

    def left(self, now):
        return self.operations[0][0] - now if self.operations else None

    def due(self, now):
        due = b"".join(operation for at, operation in self.operations if at == now)
        self.operations = [(at, operation) for at, operation in self.operations if at > now]
        return due

    def receive(self, now, data):
        self.received += [(now, code, content) for code, content in operations(data)]

    def confirmations(self):
        """When which identifier was confirmed."""
        return [(at, content) for at, code, content in self.received if code == CONFIRM]

    def frames(self):
        """What it heard as a frame: instant, identifier, data."""
        plain = ((at, *struct.unpack_from("<I", content), content[8:]) for at, code, content in self.received if code == TRANSMIT)
        return list(plain)


#: At which ms who gets what: node 4 turns at 60 r/min, is asked for its identity, and is halted; node 5 is reset meanwhile.
TALK = [
    (1600, 0x604, "2F60600003000000"), (1610, 0x604, "2B40600006000000"), (1620, 0x604, "2B40600007000000"),
    (1630, 0x604, "2B4060000F000000"), (1640, 0x604, "23FF60003C000000"), (1650, 0x605, "4041600000000000"),
    (1700, 0x000, "0104"), (1701, 0x080, ""), (1710, 0x604, "4018100100000000"), (1900, 0x604, "2B4060000F010000"),
    (1950, 0x000, "8105"), (2100, 0x604, "4064600000000000"),
]  # fmt: skip

TALKED = """
title = "what a host says to two drives"
end = "2201ms"
[machine]
timing = "ideal"
drive = [{ model = "zlac8030l", node = 4 }, { model = "m4230e17b50", node = 5 }]
bitrate = "500k"
[[host]]
start = "1600ms"
do = [%s]
[figures]
velocity = "last 4 velocity"
current = "last 4 current"
supply = "last 4 supply"
"""


@check("frames, shafts and voltages of FMUs on a bus, of `ferrodrive run` and of a world of Python are the same to the last bit", ZLAC8030L)
def same_bus(bench):
    frames = [(ms * 1_000_000, identifier, bytes.fromhex(data)) for ms, identifier, data in TALK]
    end_ms = 2200
    world = ferrodrive.World(bitrate=500_000, timing="ideal")
    of_python = [world.add("zlac8030l", node=4), world.add("m4230e17b50", node=5)]
    probe = world.add_probe()
    for at, identifier, data in frames:
        world.run_ns(at - world.now_ns)
        world.send(probe, (identifier, False, False, len(data), data))
    world.run_ns(end_ms * 1_000_000 - world.now_ns)
    expected = []
    while heard := world.poll(probe):
        expected.append((heard[0], heard[1][0], bytes(heard[1][4])))
    with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as stack:
        words = (["bus", "--nodes", "3"], ["zlac8030l@4,timing=ideal"], ["m4230e17b50@5,timing=ideal"])
        paths = [pack(bench, folder, *each) for each in words]
        bus, *drives = [stack.enter_context(Instance(path, folder, events=True)) for path in paths]
        script = Script("Node3", 500_000, frames)
        network = Network(bus, drives, script)
        network.run(end_ms * 1_000_000)
        equal(script.frames(), expected, "frames with their instants")
        true(len(expected) > 12, f"{len(expected)} frames")
        equal([content for _, content in script.confirmations()], [struct.pack("<I", identifier) for _, identifier, _ in frames], "confirmations of what was sent")
        for drive, other in zip(drives, of_python):
            got = [drive.real(name) for name in ("angle", "current", "bus_voltage")]
            equal(got, [other.shaft_angle_rad, other.current_a, other.supply_v], f"node {other.node_id}")
        true(drives[0].real("angle") > 1.0, "it has turned")
        # The last sample of the scenario is 1 ms before its end: here.
        (path := pathlib.Path(folder) / "talk.toml").write_text(TALKED % said())
        figures = ferrodrive.run(path).figures
        equal(drives[0].real("velocity"), figures["velocity"] * math.pi / 30, "speed in a scenario")
        equal([drives[0].real(name) for name in ("current", "bus_voltage")], [figures["current"], figures["supply"]], "in a scenario")
        sent = [(at, identifier, data) for (at, *_), (_, identifier, data) in zip(script.confirmations(), frames)]
        whole = sorted([*expected, *sent])
        equal(whole, [frame for frame in run_frames(bench, path) if frame[0] <= end_ms * 1_000_000], "frames of `ferrodrive run`")


def run_frames(bench, path):
    """All frames of a scenario as the command line records them: when their last bit ended, identifier, data."""
    record = path.with_suffix(".mcap")
    done = subprocess.run([bench.program, "run", str(path), "--record", str(record)], capture_output=True, text=True, timeout=PATIENCE_S)
    equal(done.returncode, 0, f"exit status of the scenario: {done.stdout}{done.stderr}")
    with open(record, "rb") as file:
        messages = list(make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages(topics=["/can"]))
    return [(message.log_time, frame.id, bytes(frame.data[: frame.dlc])) for _, _, message, frame in messages]


def said():
    """The same frames as lines of a scenario's host."""
    lines, before = [], TALK[0][0]
    for ms, identifier, data in TALK:
        lines += [f'"wait {ms - before}ms"'] * (ms > before) + [f'"send {identifier:03X}#{data}"']
        before = ms
    return ", ".join(lines)


@check("two drives on a bus hear each other's boot-up, stepped by FMPy from countdown to countdown", ZLAC8030L)
def joined(bench):
    with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as stack:
        words = (["bus", "--nodes", "2"], ["zlac8030l@4,timing=ideal"], ["m4230e17b50@5,timing=ideal"])
        paths = [pack(bench, folder, *each) for each in words]
        bus, *drives = [stack.enter_context(Instance(path, folder, events=True)) for path in paths]
        network = Network(bus, drives)
        network.run(20_000_000)
        frames = {}
        for node, other, heard in zip((4, 5), (5, 4), network.heard):
            ids = [(code, struct.unpack_from("<I", data)[0]) for _, code, data in heard if code in (TRANSMIT, CONFIRM)]
            expected = {(CONFIRM, 0x700 + node), (TRANSMIT, 0x700 + other)}
            equal(set(ids), expected, f"what node {node} is notified of")
            equal(len(ids), 2, f"how often node {node} is notified")
            for at, code, data in heard:
                frames.setdefault(struct.unpack_from("<I", data)[0], set()).add(at)
        equal([len(frames[it]) for it in (0x704, 0x705)], [1, 1], "each frame ends for both nodes at one instant")
        # 47 bits, 8 of data, stuff bits (at most 1 in 4 of 42 bits), 2 us each.
        between = min(frames[0x705]) - min(frames[0x704])
        true(110_000 <= between <= 130_000, f"one frame behind the other: {between} ns")
        equal(bus.fmu.getUInt64([bus.reference["frames"]])[0], 2, "frames on the bus")


@check("the programs of the handbook's page on FMI run", ZLAC8030L)
def page(bench):
    text = (pathlib.Path(__file__).resolve().parents[2] / "docs/handbook/fmu.md").read_text()
    programs = [block.split("```")[0] for block in text.split("```python\n")[1:]]
    with tempfile.TemporaryDirectory() as folder:
        for name, words in (("wheel", []), ("moved", ["--rule", "integrate"]), ("driven", ["--fmi", "2"])):
            pathlib.Path(pack(bench, folder, "zlac8030l@4", *words)).rename(pathlib.Path(folder) / f"{name}.fmu")
        said = []
        for program in programs:
            done = subprocess.run([sys.executable, "-c", program], cwd=folder, capture_output=True, text=True, timeout=120)
            equal(done.returncode, 0, f"its exit status ({done.stderr})")
            said.append(done.stdout.splitlines()[-1])
        equal(said, ["48 V", "0.95 rad", "6.3 rad/s"], "what they print")
