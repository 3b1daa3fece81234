"""Checks of `ferrodrive fmu`: FMPy validates and steps drive and bus by FMI 3.0.

Operations are written here by the layered standard for buses (fmi-ls-bus 1.0, "CAN, CAN FD, CAN XL"), not by our own code."""

import contextlib
import ctypes
import math
import pathlib
import struct
import subprocess
import sys
import tempfile

import fmpy
from fmpy.fmi3 import FMU3Slave
from fmpy.validation import validate_fmu

from checks import check, equal, near, true
from drive import ZLAC8030L

TRANSMIT, CONFIRM, BAUDRATE, STATUS = 0x10, 0x20, 0x40, 0x41


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


class Instance:
    """An instance by FMPy's own classes, its variables by their names."""

    def __init__(self, path, folder, events=False, token=None):
        description = fmpy.read_model_description(path)
        self.reference = {variable.name: variable.valueReference for variable in description.modelVariables}
        self.messages = []
        self.fmu = FMU3Slave(
            guid=token or description.instantiationToken,
            unzipDirectory=fmpy.extract(path, unzipdir=tempfile.mkdtemp(dir=folder)),
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName="it",
        )
        self.fmu.instantiate(eventModeUsed=events)
        self.time = 0.0

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

    def close(self):
        self.fmu.freeInstance()


@contextlib.contextmanager
def opened(path, folder, **options):
    instance = Instance(path, folder, **options)
    try:
        yield instance
    finally:
        instance.close()


@check("FMPy finds nothing wrong with the FMUs of drives and buses", ZLAC8030L)
def valid(bench):
    with tempfile.TemporaryDirectory() as folder:
        for words in (["zlac8030l@4"], ["m4230e17b50@5", "--clock", "triggered"], ["bus", "--nodes", "3"]):
            equal(validate_fmu(pack(bench, folder, *words)), [], f"problems of {words}")


@check("FMPy turns a drive by SDO over its bus terminal, and loads it", ZLAC8030L)
def turned(bench):
    with tempfile.TemporaryDirectory() as folder, opened(pack(bench, folder, "zlac8030l@4"), folder) as drive:
        drive.begin()
        said = drive.sent()
        for _ in range(1600):
            drive.step(1e-3)
            said += drive.sent()
        codes = list(operations(said))
        true((BAUDRATE, b"\x01" + struct.pack("<I", 500_000)) in codes, "it states its bit rate")
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


@check("a state that FMPy takes back, also from bytes, goes on alike", ZLAC8030L)
def states(bench):
    with tempfile.TemporaryDirectory() as folder, opened(pack(bench, folder, "zlac8030l@4"), folder) as drive:
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
        refused(lambda: Instance(path, folder, token="of another"), "a wrong token")
        with opened(path, folder) as drive:
            refused(lambda: drive.step(1e-3), "a step before initialization")
            drive.begin()
            drive.step(1e-3)
            refused(lambda: drive.fmu.doStep(0.0, 1e-3), "a step backwards")
            refused(lambda: drive.fmu.getFloat64([12345]), "a variable that is not there")
            refused(lambda: drive.fmu.getUInt16([drive.reference["angle"]]), "a variable of another type")
            refused(lambda: drive.fmu.setFloat64([drive.reference["load_torque"]], [math.nan]), "not a number")
            refused(lambda: drive.fmu.setFMUState(ctypes.c_void_p(99)), "a state that is not one")
            drive.step(1e-3)


def refused(call, what):
    try:
        call()
    except Exception:  # FMPy's own for a status, a plain one for an instance that was not made
        return
    raise AssertionError(f"{what} was taken")


@check("the program of the handbook's page on FMI runs", ZLAC8030L)
def page(bench):
    text = (pathlib.Path(__file__).resolve().parents[2] / "docs/handbook/fmu.md").read_text()
    program = text.split("```python\n")[1].split("```")[0]
    with tempfile.TemporaryDirectory() as folder:
        pathlib.Path(pack(bench, folder, "zlac8030l@4")).rename(pathlib.Path(folder) / "wheel.fmu")
        done = subprocess.run([sys.executable, "-c", program], cwd=folder, capture_output=True, text=True, timeout=120)
        equal((done.stdout, done.returncode), ("48 V\n", 0), f"what it prints ({done.stderr})")
