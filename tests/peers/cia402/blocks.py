"""SDO block transfer (CiA 301, 7.2.4.3.9 to 7.2.4.3.16) with canopen-python: its client both ways, its server that has none, and a
program that it sends (CiA 302-3).
"""

import zlib

import canopen
import ferrodrive
from canopen.objectdictionary import DOMAIN, ObjectDictionary, ODVariable

from checks import check, equal

from cia402 import TURN, FileDrive

#: A domain that can be read, too; and the objects of one program.
OBJECTS = """
[2F00]
ParameterName=Scratch
ObjectType=7
DataType=0xF
AccessType=rw
[1F50]
ParameterName=Program data
ObjectType=8
SubNumber=2
[1F50sub0]
ParameterName=n
DataType=5
AccessType=ro
DefaultValue=1
[1F50sub1]
ParameterName=Program 1
DataType=0xF
AccessType=rw
[1F51]
ParameterName=Program control
ObjectType=8
SubNumber=2
[1F51sub0]
ParameterName=n
DataType=5
AccessType=ro
DefaultValue=1
[1F51sub1]
ParameterName=Program control 1
DataType=5
AccessType=rw
DefaultValue=1
[1F56]
ParameterName=Program identification
ObjectType=8
SubNumber=2
[1F56sub0]
ParameterName=n
DataType=5
AccessType=ro
DefaultValue=1
[1F56sub1]
ParameterName=Program identification 1
DataType=7
AccessType=ro
DefaultValue=0
"""


class ProgrammedDrive(FileDrive):
    """The servo of the file with some more objects."""

    def arguments(self, program):
        arguments = super().arguments(program)
        with self.path.open("a", encoding="ascii") as file:
            file.write(OBJECTS)
        return arguments


DRIVE = ProgrammedDrive("cia402", model="cia402", node_id=5, device_type=0x00020192, per_rpm=TURN / 60)


def data(length):
    """Bytes of which no two segments are alike."""
    return bytes((7 * at + (at >> 8)) & 0xFF for at in range(length))


def download(sdo, index, sub, content, **options):
    with sdo.open(index, sub, "wb", size=len(content), block_transfer=True, **options) as file:
        file.write(content)


def upload(sdo, index, sub, **options):
    with sdo.open(index, sub, "rb", block_transfer=True, **options) as file:
        return file.read()


@check("canopen-python writes and reads {length} bytes in blocks, with and without a checksum", DRIVE,
       rows=lambda drive: [{"length": length} for length in (1, 7, 8, 889, 890, 1024)])
def both_ways(bench, row):
    for checksum in (True, False):
        content = data(row["length"]) if checksum else data(row["length"])[::-1]
        download(bench.sdo, 0x2F00, 0, content, request_crc_support=checksum)
        equal(upload(bench.sdo, 0x2F00, 0, request_crc_support=checksum), content, f"what is read, checksum {checksum}")
        equal(bench.sdo.upload(0x2F00, 0), content, "what is read in segments")


@check("a program of 20,000 bytes that canopen-python sends in blocks is there, by its CRC-32", DRIVE)
def program(bench):
    content = data(20_000)
    try:
        download(bench.sdo, 0x1F50, 1, content)
    except canopen.SdoAbortedError as error:
        equal(error.code, 0x08000022, "the abort code while the program runs")
    else:
        raise AssertionError("a program was taken while the one before it ran")
    bench.sdo.download(0x1F51, 1, b"\0")
    download(bench.sdo, 0x1F50, 1, content)
    equal(int.from_bytes(bench.sdo.upload(0x1F56, 1), "little"), zlib.crc32(content), "1F56h:01")
    bench.sdo.download(0x1F51, 1, b"\1")
    equal(upload(bench.sdo, 0x1F50, 1), content, "1F50h:01")


#: canopen-python's own node beside the drive.
LOCAL = 9


def local_node(bench):
    """A node of canopen-python with a long value, 2F00h, that is there from the start."""
    objects = ObjectDictionary()
    variable = ODVariable("Scratch", 0x2F00)
    variable.data_type, variable.access_type = DOMAIN, "rw"
    objects.add_object(variable)
    node = bench.network.create_node(LOCAL, objects)
    node.set_data(0x2F00, 0, data(1))
    return node


@check("{length} bytes reach canopen-python's server and come back, in blocks as far as it has them", DRIVE,
       rows=lambda drive: [{"length": length} for length in (63, 64, 255, 256, 1024)])
def served(bench, row):
    content = data(row["length"])
    node, mark = local_node(bench), bench.trace.mark()
    with ferrodrive.Network(f"socketcand://127.0.0.1:{bench.simulator.port()}/can0") as ours:
        ours.download(LOCAL, 0x2F00, 0, content)
        equal(bytes(node.get_data(0x2F00, 0)), content, "what its server has")
        equal(ours.upload(LOCAL, 0x2F00), content, "what is read from it")
        equal(ours.upload(LOCAL, 0x2F00), content, "what is read from it again")
    asked = [bytes(frame.data)[0] for frame in bench.trace.since(mark, 0x600 + LOCAL)]
    # From 64 bytes on a download is begun in blocks, which this server refuses with 0504 0001h; after that it is not asked again.
    blocks = [command for command in asked if command >> 5 in (5, 6)]
    equal(blocks, [0xC6] if row["length"] >= 64 else [], "requests for blocks")


@check("an upload that canopen-python's server answers in segments although blocks were asked for is whole", DRIVE)
def answered_in_segments(bench):
    content = data(1024)
    local_node(bench).set_data(0x2F00, 0, content)
    mark = bench.trace.mark()
    with ferrodrive.Network(f"socketcand://127.0.0.1:{bench.simulator.port()}/can0") as ours:
        equal(ours.upload(LOCAL, 0x2F00), content, "what is read from it")
    asked = [bytes(frame.data)[0] for frame in bench.trace.since(mark, 0x600 + LOCAL)]
    # The size in its first answer leads to blocks; it answers their request by the size once more.
    equal(asked[:4], [0x40, 0x80, 0xA4, 0x60], "the first requests")
