"""CiA's names in the EDS of every model: canopen-python finds the objects of all eight by the same words."""

import pathlib
import tempfile

import canopen

from checks import check, equal, eventually, near, table
from cia402 import DRIVE as CIA402, TURN
from drive import MJOINT, ZLAC8030L, ZLIM42C
from eds import load, write

#: Each model with what 1 r/min is in 60FFh and 606Ch, by the units of its manual or of CiA 402.
MODELS = {
    "zlac8030l": table("model target actual", ("zlac8030l", 1, 10)),
    "zlim42c": table("model target actual", ("zlim42c", 1, 1), ("zlim42c-82", 1, 1)),
    "mjoint": table("model target actual", *((name, 1, 10) for name in (
        "m4230e17b50", "m4230e17b80", "m8025e25b50", "m8025e25b80"))),
    "cia402": table("model target actual", ("cia402", TURN / 60, TURN / 60)),
}


def each(drive):
    if drive is CIA402:
        return MODELS[drive.name]
    return [row | {"drives": (f"{row['model']}@{drive.node_id}",)} for row in MODELS[drive.name]]


@check("the {model} is enabled and turned by the names of its EDS", ZLAC8030L, ZLIM42C, MJOINT, CIA402, rows=each)
def by_name(bench, row):
    with tempfile.TemporaryDirectory() as folder:
        dictionary = load(write(bench, folder, model=row["model"]), bench.node_id)
    bench.write_all(bench.drive.unwatched)
    node = bench.network.add_node(canopen.RemoteNode(bench.node_id, dictionary))
    node.sdo.RESPONSE_TIMEOUT = 60.0
    node.sdo["Modes of operation"].raw = 3
    for controlword in (0x0F,) if bench.drive is MJOINT else (0x06, 0x07, 0x0F):
        node.sdo["Controlword"].raw = controlword
    node.sdo["Target velocity"].raw = round(100 * row["target"])
    speed = lambda: node.sdo["Velocity actual value"].raw / row["actual"]
    eventually(speed, lambda now: abs(now - 100) < 5, "Velocity actual value")
    # A stepper swings about its speed.
    near(bench.world("get")["velocity_rpm"], 100, 15, "speed in the world")
    # Bit 10 comes and goes as the speed swings about its target: the two are read until nothing changed between them.
    by_index = lambda: int.from_bytes(node.sdo.upload(0x6041, 0), "little")
    both = lambda: (by_index(), node.sdo["Statusword"].raw, by_index())
    _, named, index = eventually(both, lambda read: read[0] == read[2], "a statusword that stays")
    equal(named, index, "Statusword")
    equal(node.sdo["Target velocity"].raw, round(100 * row["target"]), "Target velocity")
    node.sdo["Controlword"].raw = 0
    eventually(lambda: bench.world("get")["velocity_rpm"], lambda now: abs(now) < 1, "it stands")


@check("the names of the EDS of the {model} are each of one object", ZLAC8030L, ZLIM42C, MJOINT, CIA402, rows=each)
def each_once(bench, row):
    with tempfile.TemporaryDirectory() as folder:
        path = write(bench, folder, model=row["model"])
        dictionary, text = load(path, bench.node_id), pathlib.Path(path).read_text(encoding="ascii")
    equal(len(dictionary.names), len(dictionary.indices), "names and objects")
    # CiA 301, 7.5.2, and CiA 402-2.
    for index, name in ((0x1000, "Device type"), (0x1018, "Identity object"), (0x6040, "Controlword"),
                        (0x6041, "Statusword"), (0x6060, "Modes of operation"), (0x6064, "Position actual value"),
                        (0x606C, "Velocity actual value"), (0x607A, "Target position"), (0x6081, "Profile velocity"),
                        (0x6083, "Profile acceleration"), (0x60FF, "Target velocity")):
        equal(dictionary[name].index, index, name)
    equal(dictionary["Identity object.Vendor-ID"].index, 0x1018, "a sub-index by both names")
    equal(text.count("ParameterName=Statusword\n"), 1, "Statusword in the file")
