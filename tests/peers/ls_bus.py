"""Nodes and buses of others on ours, if there are any: FERRODRIVE_LS_BUS_FMUS names a folder of FMUs by FMI 3.0 with fmi-ls-bus.

Those of the layered standard (modelica/fmi-ls-bus-examples) stand built in grouperenault/fmu_manipulation_toolbox, tests/ls-bus. They
are not ours, and none is kept here. Which of them is a bus its manifest says (`isBusSimulationFMU`)."""

import contextlib
import ctypes
import os
import pathlib
import struct
import tempfile
import zipfile

import fmpy

from checks import Skip, check, equal, true
from drive import ZLAC8030L
from fmu import CONFIRM, TRANSMIT, Instance, operations, pack

BUS_ERROR, ACKNOWLEDGE_ERROR, AS_SENDER = 0x31, 5, 1
STEP_NS, END_NS = 1_000_000, 3_000_000_000
#: At the rate of the demonstration node.
RATE = ("--bitrate", "100k")
DRIVES = (("zlac8030l@4", *RATE), ("zlac8030l@5", *RATE))
#: A frame of eight bytes at 100 kbit/s, and as much again for one that it waits for.
LAST_NS = 3_000_000
#: fmi3IntervalQualifier.
NOT_YET_KNOWN, CHANGED = 0, 2


def fmus(is_bus):
    """Those that run on this system."""
    folder = os.environ.get("FERRODRIVE_LS_BUS_FMUS")
    if not folder:
        raise Skip("FERRODRIVE_LS_BUS_FMUS names no folder")
    found = []
    for path in sorted(pathlib.Path(folder).glob("*.fmu")):
        with zipfile.ZipFile(path) as file:
            manifest = file.read("extra/org.fmi-standard.fmi-ls-bus/fmi-ls-manifest.xml").decode()
        if ('isBusSimulationFMU="true"' in manifest) == is_bus and fmpy.supported_platforms(str(path)):
            found.append(str(path))
    if not found:
        raise Skip(f"there is no {'bus' if is_bus else 'node'} in {folder}")
    return found


class End:
    """A terminal of an instance: its two clocks and what comes with them (FMI 3.0, 2.2.8; fmi-ls-bus, "Network Terminal")."""

    def __init__(self, instance, terminal, is_countdown):
        self.instance, self.is_countdown = instance, is_countdown
        self.rx_data, self.tx_data, self.rx_clock, self.tx_clock = (
            [instance.reference[f"{terminal}.{member}"]] for member in ("Rx_Data", "Tx_Data", "Rx_Clock", "Tx_Clock")
        )
        #: When its countdown ends, in ns.
        self.due = None
        #: What it sent and was given, with the instants.
        self.sent, self.given = [], []

    def look(self, now):
        """Reads its countdown, which is reported once (FMI 3.0, 2.2.8.3)."""
        if self.is_countdown:
            interval, qualifier = (ctypes.c_double * 1)(), (ctypes.c_int * 1)()
            self.instance.fmu.getIntervalDecimal((ctypes.c_uint32 * 1)(*self.tx_clock), interval, qualifier)
            if qualifier[0] == NOT_YET_KNOWN:
                self.due = None
            elif qualifier[0] == CHANGED:
                self.due = now + round(interval[0] * 1e9)

    def ticks(self, now):
        if not self.is_countdown:
            return bool(self.instance.fmu.getClock(self.tx_clock)[0])
        if self.due != now:
            return False
        self.due = None
        self.instance.fmu.setClock(self.tx_clock, [True])
        return True

    def take(self, now):
        data = self.instance.fmu.getBinary(self.tx_data)[0] or b""
        self.sent += [(now, *operation) for operation in operations(data)]
        return data

    def give(self, now, data):
        if data:
            self.given += [(now, *operation) for operation in operations(data)]
            self.instance.fmu.setClock(self.rx_clock, [True])
            self.instance.fmu.setBinary(self.rx_data, [data])

    def frames(self, operations):
        """The frames among what it sent or was given: instant, identifier, data."""
        return [(at, struct.unpack_from("<I", content)[0], content[8:]) for at, code, content in operations if code == TRANSMIT]


def countdowns(path):
    """The variables that are clocks with countdown, which their importer sets; all others tick by themselves."""
    return {variable.name for variable in fmpy.read_model_description(path).modelVariables if variable.intervalVariability == "countdown"}


def terminals(path):
    names = (variable.name for variable in fmpy.read_model_description(path).modelVariables)
    return [name.removesuffix(".Tx_Clock") for name in names if name.endswith(".Tx_Clock")]


def initialize(instance, path):
    """With notifications of what becomes of its frames; a structural parameter is set in a mode of its own (FMI 3.0, 2.4.8)."""
    fmu = instance.fmu
    wanted = [it for it in fmpy.read_model_description(path).modelVariables if it.name.endswith("BusNotifications")]
    structural = [it.valueReference for it in wanted if it.causality == "structuralParameter"]
    if structural:
        fmu.enterConfigurationMode()
        fmu.setBoolean(structural, [True] * len(structural))
        fmu.exitConfigurationMode()
    fmu.enterInitializationMode(startTime=0.0)
    if plain := [it.valueReference for it in wanted if it.causality == "parameter"]:
        fmu.setBoolean(plain, [True] * len(plain))
    fmu.exitInitializationMode()


class Mixed:
    """A bus and its nodes, ours or others', stepped by 1 ms and to each countdown."""

    def __init__(self, stack, folder, bus, nodes):
        self.now = 0
        self.instances = []
        ends = []
        for path in (*nodes, bus):
            instance = stack.enter_context(Instance(path, folder, events=True))
            self.instances.append(instance)
            clocks = countdowns(path)
            ends.append([End(instance, name, f"{name}.Tx_Clock" in clocks) for name in terminals(path)])
            initialize(instance, path)
        of_bus = ends.pop()
        self.nodes = [of_node[0] for of_node in ends]
        self.pairs = list(zip(self.nodes, of_bus))
        equal(len(of_bus), len(self.nodes), "terminals of the bus")

    def run(self, until):
        self.event()
        while self.now < until:
            grid = (self.now // STEP_NS + 1) * STEP_NS
            after = min([grid, *(end.due for pair in self.pairs for end in pair if end.due is not None)])
            for instance in self.instances:
                instance.fmu.enterStepMode()
                instance.fmu.doStep(self.now / 1e9, (after - self.now) / 1e9)
                instance.fmu.enterEventMode()
            self.now = after
            self.event()

    def event(self):
        """All rounds of this instant. The bus has all its inputs, and all its clocks have ticked, before its data are read."""
        for _ in range(100):
            ends = [end for pair in self.pairs for end in pair]
            for end in ends:
                end.look(self.now)
            ticking = [end for end in ends if end.ticks(self.now)]
            if not ticking:
                return
            for node, of_bus in self.pairs:
                if node in ticking:
                    of_bus.give(self.now, node.take(self.now))
            for node, of_bus in self.pairs:
                if of_bus in ticking:
                    node.give(self.now, of_bus.take(self.now))
            for instance in self.instances:
                instance.fmu.updateDiscreteStates()
        raise AssertionError(f"the event at {self.now} ns has no end")


@contextlib.contextmanager
def network(bus, nodes):
    """Paths of FMUs, which are made by a function of a folder."""
    with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as stack:
        yield Mixed(stack, folder, bus(folder), [node(folder) for node in nodes])


def given(end, code):
    return [content for _, got, content in end.given if got == code]


def ours(bench, *words):
    return lambda folder: pack(bench, folder, *words)


def in_time(frames):
    """Those that the bus had time to carry."""
    return [frame for frame in frames if frame[0] <= END_NS - LAST_NS]


@check("nodes of others on our bus: what they send arrives at our drives, acknowledged from when these have booted", ZLAC8030L)
def on_our_bus(bench):
    for path in fmus(is_bus=False):
        with network(ours(bench, "bus", "--nodes", "3", *RATE), [lambda _: path, *(ours(bench, *drive) for drive in DRIVES)]) as mixed:
            mixed.run(END_NS)
            other, *drives = mixed.nodes
            sent = [(identifier, data) for _, identifier, data in in_time(other.frames(other.sent))]
            true(sent, f"{path} sends something")
            own = {identifier for identifier, _ in sent}
            confirmed = [(at, struct.unpack_from("<I", content)[0]) for at, code, content in other.given if code == CONFIRM]
            equal([identifier for _, identifier in confirmed[: len(sent)]], [identifier for identifier, _ in sent], "what is confirmed to it")
            for drive in drives:
                boot = min(at for at, code, _ in drive.given if code == CONFIRM)
                expected = [frame for frame, (at, _) in zip(sent, confirmed) if at > boot]
                came = [(identifier, data) for _, identifier, data in drive.frames(drive.given) if identifier in own]
                equal(came[: len(expected)], expected, f"what arrives of {path} from {boot} ns on, in its order")
                true(len(expected) > 0, "something does")
            boots = [(at, identifier) for at, identifier, _ in other.frames(other.given) if identifier in (0x704, 0x705)]
            equal({identifier for _, identifier in boots}, {0x704, 0x705}, "boot-ups that it hears")
            # A node alone has none to acknowledge what it sends (ISO 11898-1, 10.4.2.4).
            failed = [content for at, code, content in other.given if code == BUS_ERROR]
            before = any(at < min(boots)[0] - LAST_NS for at, *_ in other.frames(other.sent))
            equal(bool(failed), before, "errors before a drive has booted")
            equal({content[4:7:2] for content in failed} | {bytes([ACKNOWLEDGE_ERROR, AS_SENDER])}, {bytes([ACKNOWLEDGE_ERROR, AS_SENDER])}, "which errors")
            at = max((at for at, code, _ in other.given if code == BUS_ERROR), default=0)
            true(at < min(boots)[0], "with a drive on the bus there are no errors any more")


@check("two equal nodes of others on our bus: one frame at one instant is one frame, and nothing passes without a third", ZLAC8030L)
def twice(bench):
    for path in fmus(is_bus=False):
        for drives in ((), DRIVES[:1]):
            bus, own = ours(bench, "bus", "--nodes", str(2 + len(drives)), *RATE), [ours(bench, *drive) for drive in drives]
            with network(bus, [lambda _: path, lambda _: path, *own]) as mixed:
                mixed.run(END_NS)
                first, second, *third = mixed.nodes
                sent = in_time(first.frames(first.sent))
                confirmed = [len(given(node, CONFIRM)) for node in (first, second)]
                if not third:
                    # Both send, and a sender does not acknowledge.
                    equal(confirmed, [0, 0], f"frames of {path} that are confirmed without a third node")
                    continue
                equal([it >= len(sent) > 0 for it in confirmed], [True, True], f"each frame of {path} is confirmed to both: {confirmed}")
                came = [frame for frame in third[0].frames(third[0].given) if frame[1] == sent[0][1]]
                equal(len(came), confirmed[0], "frames that the drive hears")


@check("our drive and a node of others on a bus of others: all its frames arrive, and our boot-up is confirmed and heard", ZLAC8030L)
def on_their_bus(bench):
    for bus in fmus(is_bus=True):
        for path in fmus(is_bus=False):
            for clock in ("countdown", "triggered"):
                with network(lambda _: bus, [ours(bench, *DRIVES[0], "--clock", clock), lambda _: path]) as mixed:
                    mixed.run(END_NS)
                    drive, other = mixed.nodes
                    sent = [(identifier, data) for _, identifier, data in in_time(other.frames(other.sent))]
                    true(sent, f"{path} sends something")
                    came = [(identifier, data) for _, identifier, data in drive.frames(drive.given)]
                    equal(came[: len(sent)], sent, f"what arrives of {path} on {bus}, {clock}")
                    true(struct.pack("<I", 0x704) in given(drive, CONFIRM), f"the boot-up is confirmed, {clock}")
                    heard = [(identifier, data) for _, identifier, data in other.frames(other.given)]
                    true((0x704, b"\0") in heard, f"the boot-up is heard, {clock}")
