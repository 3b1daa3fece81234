"""A model under test, and its object dictionary as canopen-python wants it, from `tests/data`."""

import collections
import csv
import pathlib

from canopen.objectdictionary import ODRecord, ODVariable, ObjectDictionary, datatypes

DATA = pathlib.Path(__file__).resolve().parent.parent / "data"
TYPES = {
    "U8": datatypes.UNSIGNED8,
    "U16": datatypes.UNSIGNED16,
    "U32": datatypes.UNSIGNED32,
    "I8": datatypes.INTEGER8,
    "I16": datatypes.INTEGER16,
    "I32": datatypes.INTEGER32,
}


class Drive:
    """What the checks of a folder run on: a model at a node-ID, and how it is told to be there."""

    def __init__(self, folder, model, node_id, device_type, node_class, per_rpm):
        self.folder = folder
        self.model = model
        self.node_id = node_id
        self.device_type = device_type
        self.node_class = node_class
        #: What 606Ch reads by SDO at 1 r/min.
        self.per_rpm = per_rpm

    def arguments(self, program):
        """The `--drive` arguments that put it on a bus; `program` may have to write something first."""
        return (f"{self.model}@{self.node_id}",)

    def rows(self, name):
        """The rows of one of the data files, as dictionaries."""
        with open(DATA / self.folder / name, newline="", encoding="utf-8") as file:
            return list(csv.DictReader(file))

    def node(self, node_id):
        """A remote node of canopen-python with the drive's object dictionary."""
        return self.node_class(node_id, self.dictionary())

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
