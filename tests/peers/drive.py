"""The drives under test: what differs between them for a host, and their objects, from `tests/data`.

A further drive is a further value here, in the tuples of those that it is like.
"""

import collections
import csv
import dataclasses
import pathlib

from canopen import RemoteNode
from canopen.objectdictionary import ODRecord, ODVariable, ObjectDictionary, datatypes
from canopen.profiles.p402 import BaseNode402

from checks import PATIENCE_S

DATA = pathlib.Path(__file__).resolve().parent.parent / "data"
# The library gives states and modes tenths of a second of the wall clock, which a busy machine takes.
for _wait in ("SWITCH_OP_MODE", "SWITCH_STATE_FINAL", "SWITCH_STATE_SINGLE", "CHECK_TPDO", "HOMING_DEFAULT"):
    setattr(BaseNode402, f"TIMEOUT_{_wait}", PATIENCE_S)

TYPES = {
    "U8": datatypes.UNSIGNED8,
    "U16": datatypes.UNSIGNED16,
    "U32": datatypes.UNSIGNED32,
    "I8": datatypes.INTEGER8,
    "I16": datatypes.INTEGER16,
    "I32": datatypes.INTEGER32,
}


@dataclasses.dataclass
class Drive:
    """A model at a node-ID. Objects with a value are triples: index, sub-index, value."""

    #: Its folder in `tests/data`.
    name: str
    model: str
    node_id: int
    #: 1000h.
    device_type: int
    #: What 606Ch reads by SDO at 1 r/min.
    per_rpm: float
    #: Its modes as bits of 6502h, which canopen-python's profile insists on and these drives do not have; `None` where
    #: the power states are not those of CiA 402.
    modes: int | None = None
    #: The state in the heartbeat after the boot-up.
    boots_as: int = 0x7F
    #: How near a target 6064h comes.
    close: int = 0
    #: The object that saves: its index, the value that does it, and what it reads when all is stored.
    save: tuple = ()
    #: What lets the host be silent for longer.
    unwatched: tuple = ()
    #: What has to be set so that a write alone stores nothing.
    hold_store: tuple = ()
    #: Stored objects, with values that are not their defaults.
    stored: tuple = ()
    #: Objects that act when they are written, so that no sweep may.
    acting: tuple = ()
    #: Objects that take a command and read 0 again.
    forgetting: tuple = ()

    def arguments(self, program):
        """The `--drive` arguments that put it on a bus; `program` may have to write something first."""
        return (f"{self.model}@{self.node_id}",)

    def rows(self, name):
        """The rows of one of the data files, as dictionaries."""
        with open(DATA / self.name / name, newline="", encoding="utf-8") as file:
            return list(csv.DictReader(file))

    def node(self, node_id):
        """A remote node of canopen-python with the drive's object dictionary."""
        if self.modes is None:
            return RemoteNode(node_id, self.dictionary())
        node = BaseNode402(node_id, self.dictionary())
        node._op_mode_support = self.modes
        return node

    def dictionary(self):
        od = ObjectDictionary()
        of_index = collections.defaultdict(list)
        for row in self.rows("objects.csv"):
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


ZLAC8030L = Drive(
    "zlac8030l",
    model="zlac8030l",
    node_id=4,
    device_type=0x00040192,
    per_rpm=10,
    modes=1 << 0 | 1 << 2 | 1 << 3,
    close=30,  # 2002h
    save=(0x2009, 2, 0),
    unwatched=((0x2000, 0, 0),),
    hold_store=((0x2010, 0, 1),),
    stored=((0x200A, 0, 500), (0x2008, 0, 7), (0x2014, 0, 77)),
    acting=(0x2009, 0x2010),
    forgetting=(0x2005, 0x2006),
)
ZLIM42C = Drive(
    "zlim42c",
    model="zlim42c",
    node_id=1,
    device_type=0x00040192,
    per_rpm=1,
    modes=1 << 0 | 1 << 2 | 1 << 5,
    save=(0x2010, 2, 0),
    hold_store=((0x200C, 0, 1),),
    stored=((0x1017, 0, 700), (0x2005, 0, 5), (0x2006, 0, 4), (0x2030, 2, 3), (0x2030, 0x0D, 4), (0x204B, 0, 33)),
    acting=(0x2010,),
    forgetting=(0x2011, 0x2012),
)
MJOINT = Drive(
    "mjoint",
    model="m4230e17b50",
    node_id=1,
    device_type=0x00020192,
    per_rpm=10,
    boots_as=0x05,
    close=30,
    save=(0x2614, 1, 2),
    stored=((0x1017, 0, 500), (0x6081, 0, 700), (0x60F9, 1, 2000), (0x260A, 0, 16_384), (0x6098, 0, 21)),
    acting=(0x2601, 0x2614, 0x6060),
)

#: Those whose PDOs can be mapped and whose power states are those of CiA 402.
ZL = (ZLAC8030L, ZLIM42C)
ALL = (*ZL, MJOINT)
