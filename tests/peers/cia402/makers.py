"""Servos made from makers' files, if there are any: FERRODRIVE_EDS_FILES names the folder."""

import configparser
import contextlib
import io
import os
import pathlib
import time

import canopen
from canopen.profiles.p402 import BaseNode402
from ferrodrive import Simulator

from checks import PATIENCE_S, Skip, check, eventually, true
from cia402 import DRIVE

#: Bits of 6502h.
MODES = {"PROFILED POSITION": 0, "PROFILED VELOCITY": 2, "HOMING": 5, "CYCLIC SYNCHRONOUS POSITION": 7}
#: What a file may leave at 0, and what the host then writes.
OPEN = (
    (0x6081, 20_000), (0x6083, 200_000), (0x6084, 200_000), (0x607F, 1_000_000), (0x6080, 3_000),
    (0x6072, 1_000), (0x60E0, 1_000), (0x60E1, 1_000),
)


def files():
    folder = os.environ.get("FERRODRIVE_EDS_FILES")
    if not folder:
        raise Skip("FERRODRIVE_EDS_FILES names no folder")
    return sorted(path for path in pathlib.Path(folder).iterdir() if path.suffix in (".eds", ".dcf"))


def dictionary(path):
    """The library's own reading of a file; a file that it cannot read leaves an empty one, which SDO does not need."""
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            return canopen.import_od(str(path), 5)
    except (UnicodeDecodeError, ValueError, KeyError, configparser.Error):
        return canopen.ObjectDictionary()


@contextlib.contextmanager
def servo(program, path):
    """A servo made from a file as node 5, and canopen-python's node from the same file."""
    with Simulator([f"{path}@5"], path=program) as simulator:
        simulator.wait_until_booted(PATIENCE_S)
        network = canopen.Network()
        network.NOTIFIER_CYCLE = 0.05
        network.connect(interface="socketcand", host="127.0.0.1", port=simulator.port(), channel="can0")
        try:
            node = BaseNode402(5, dictionary(path))
            network.add_node(node)
            yield simulator, node
        finally:
            network.disconnect()


def supported(node):
    eventually(lambda: node.sdo.upload(0x1000, 0), bool, "it answers")
    bits = int.from_bytes(node.sdo.upload(0x6502, 0), "little")
    return [mode for mode, bit in MODES.items() if bits >> bit & 1]


def write(node, index, value, sub=0):
    size = len(node.sdo.upload(index, sub))
    node.sdo.download(index, sub, int(value).to_bytes(size, "little", signed=value < 0))


def number(node, index):
    return int.from_bytes(node.sdo.upload(index, 0), "little", signed=True)


def host_sets(node):
    """Speeds, ramps and torque limits that a file leaves at 0 are for the host to set."""
    for index, value in OPEN:
        with contextlib.suppress(canopen.SdoAbortedError):
            if number(node, index) == 0:
                write(node, index, value)


def enable(node, mode):
    """By SDO alone: a maker's PDOs are as they are."""
    write(node, 0x6060, {"PROFILED POSITION": 1, "PROFILED VELOCITY": 3, "HOMING": 6, "CYCLIC SYNCHRONOUS POSITION": 8}[mode])
    for word in (0x80, 0x06, 0x07, 0x0F):
        write(node, 0x6040, word)
    eventually(lambda: number(node, 0x6041) & 0x6F, lambda bits: bits == 0x27, "operation enabled")


def drive(simulator, node, mode):
    """One motion in a mode; what is seen at the shaft."""
    rpm = lambda: simulator.world("5 get")["velocity_rpm"]
    host_sets(node)
    enable(node, mode)
    start = number(node, 0x6064)
    if mode == "PROFILED VELOCITY":
        write(node, 0x60FF, 1000)
        eventually(rpm, lambda seen: abs(seen) > 0.001, "it turns")
        write(node, 0x60FF, 0)
    elif mode == "PROFILED POSITION":
        write(node, 0x607A, start + 1000)
        write(node, 0x6040, 0x1F)
        eventually(lambda: number(node, 0x6064), lambda at: abs(at - start - 1000) <= 20, "6064h")
    elif mode == "HOMING":
        write(node, 0x6098, 35)
        write(node, 0x6040, 0x1F)
        eventually(lambda: number(node, 0x6041) & 0x3000, lambda bits: bits == 0x1000, "attained")
    else:
        for step in range(1, 60):
            write(node, 0x607A, start + min(step, 50) * 20)
            time.sleep(0.005)
        eventually(lambda: number(node, 0x6064), lambda at: abs(at - start - 1000) <= 20, "6064h")
    write(node, 0x6040, 0x06)
    eventually(lambda: abs(rpm()), lambda seen: seen < 5, "it stands")


@check("servos made from makers' files are driven in the modes that they say they have", DRIVE)
def makers(bench):
    driven = {}
    for path in files():
        try:
            with servo(bench.program, path) as (simulator, node):
                modes = supported(node)
                for mode in modes:
                    drive(simulator, node, mode)
                driven[path.name] = modes
        except canopen.SdoAbortedError as error:
            # No drive, or a file without 6502h.
            true(error.code in (0x06020000, 0x06090011, 0x06010001), f"{path.name}: {error}")
        except AssertionError as error:
            raise AssertionError(f"{path.name}: {error}") from error
    true(any("CYCLIC SYNCHRONOUS POSITION" in modes for modes in driven.values()), "some file has csp")
