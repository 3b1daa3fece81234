"""SDO reads, writes and aborts (manual 3.3 and chapter 9; CiA 301, 7.2.4)."""

import canopen

from zlac8030l import rows
from checks import check, equal, true

READ_ONLY, NO_OBJECT, NO_SUB_INDEX = 0x06010002, 0x06020000, 0x06090011
WRONG_LENGTH, TOO_LONG, TOO_SHORT = 0x06070010, 0x06070012, 0x06070013
BAD_VALUE, TOO_HIGH, TOO_LOW = 0x06090030, 0x06090031, 0x06090032
UNKNOWN_COMMAND = 0x05040001


@check("every object of the manual reads its default with its size")
def defaults(bench):
    wrong = []
    for row in rows("objects.csv"):
        index, sub = int(row["index"], 16), int(row["sub"], 16)
        try:
            value = bench.read(index, sub)
        except Exception as error:  # gather them all: one wrong row says less than the list
            wrong.append(f"{row['index']}h:{row['sub']} {error}")
            continue
        if row["live"] == "no" and value != int(row["default"], 0):
            wrong.append(f"{row['index']}h:{row['sub']} expected {row['default']}, got {value}")
    equal(wrong, [], "rows that differ")


@check("read-only objects refuse to be written")
def read_only(bench):
    for row in rows("objects.csv"):
        if row["access"] == "ro":
            index, sub = int(row["index"], 16), int(row["sub"], 16)
            data = bytes(int(row["type"][1:]) // 8)
            equal(bench.abort_code(bench.sdo.download, index, sub, data), READ_ONLY, f"write {index:04X}h:{sub:02X}")


@check("objects that the drive lacks are refused as missing objects")
def missing_objects(bench):
    for index in (0x1003, 0x1004, 0x1006, 0x1008, 0x100C, 0x1010, 0x1011, 0x1016, 0x2024, 0x6098, 0x6502, 0xFFFF):
        equal(bench.abort_code(bench.sdo.upload, index, 0), NO_OBJECT, f"read {index:04X}h")
        equal(bench.abort_code(bench.sdo.download, index, 0, b"\0"), NO_OBJECT, f"write {index:04X}h")


@check("sub-indexes that an object lacks are refused as missing sub-indexes")
def missing_sub_indexes(bench):
    for index, sub in ((0x1000, 1), (0x1018, 4), (0x1600, 5), (0x1800, 6), (0x2030, 6), (0x2030, 0x10), (0x6041, 255)):
        equal(bench.abort_code(bench.sdo.upload, index, sub), NO_SUB_INDEX, f"read {index:04X}h:{sub:02X}")


@check("data of the wrong size is refused")
def sizes(bench):
    for index, size, codes in (
        (0x6040, 4, (WRONG_LENGTH, TOO_LONG)),
        (0x6060, 2, (WRONG_LENGTH, TOO_LONG)),
        (0x6040, 1, (WRONG_LENGTH, TOO_SHORT)),
        (0x6081, 2, (WRONG_LENGTH, TOO_SHORT)),
    ):
        code = bench.abort_code(bench.sdo.download, index, 0, bytes(size))
        true(code in codes, f"{size} bytes into {index:04X}h: abort {code and hex(code)}, one of {[hex(c) for c in codes]}")


@check("every limit holds: the bounds are taken, what lies beyond is refused and changes nothing")
def limits(bench):
    wrong = []
    for row in rows("objects.csv"):
        if row["access"] != "rw" or not row["min"]:
            continue
        index, sub = int(row["index"], 16), int(row["sub"], 16)
        if index in (0x2009, 0x2010):
            continue  # these act on the parameter store
        wrong += limit_errors(bench, index, sub, int(row["min"]), int(row["max"]), row["type"])
    equal(wrong, [], "limits that differ")


def limit_errors(bench, index, sub, low, high, kind):
    signed, bits = kind[0] == "I", int(kind[1:])
    least, most = (-(1 << bits - 1), (1 << bits - 1) - 1) if signed else (0, (1 << bits) - 1)
    for value, codes in ((low - 1, (BAD_VALUE, TOO_LOW)), (high + 1, (BAD_VALUE, TOO_HIGH))):
        if not least <= value <= most:
            continue
        before = bench.read(index, sub)
        code = bench.abort_code(bench.write, index, value, sub)
        if code not in codes:
            yield f"{index:04X}h:{sub:02X} = {value}: abort {code and hex(code)}"
        if bench.read(index, sub) != before:
            yield f"{index:04X}h:{sub:02X} changed by a refused write"
    # The highest first: the range of 60FFh follows 202Fh:05, which so ends at 1, as delivered.
    for value in (high, low):
        code = bench.abort_code(bench.write, index, value, sub)
        if code is not None:
            yield f"{index:04X}h:{sub:02X} = {value}: abort {code:#x}"
        elif bench.read(index, sub) != value and index not in (0x2005, 0x2006):
            yield f"{index:04X}h:{sub:02X} reads {bench.read(index, sub)} after {value}"


@check("modes that the drive lacks are refused")
def modes(bench):
    for mode in (2, 6, 7, 8, -1):
        equal(bench.abort_code(bench.write, 0x6060, mode), BAD_VALUE, f"6060h = {mode}")


@check("a command that CiA 301 does not know, and block transfer, are refused with 0504 0001")
def unknown_commands(bench):
    expected = bytes.fromhex("80 00 10 00 01 00 04 05")
    equal(bench.ask(bytes.fromhex("E0 00 10 00 00 00 00 00")), expected, "answer to command E0h")
    equal(bench.ask(bytes.fromhex("A4 00 10 00 7F 00 00 00")), expected, "answer to a block upload")
    try:
        bench.sdo.open(0x1000, 0, "rb", block_transfer=True).close()
    except canopen.SdoAbortedError as error:
        equal(error.code, UNKNOWN_COMMAND, "block upload by canopen-python")
    else:
        raise AssertionError("a block upload by canopen-python succeeded")


@check("an expedited download without a size is taken by the object's own size")
def size_not_indicated(bench):
    equal(bench.ask(bytes.fromhex("22 FF 60 00 64 00 00 00")), bytes.fromhex("60 FF 60 00 00 00 00 00"), "answer")
    equal(bench.read(0x60FF), 100, "60FFh")


@check("a segmented download of four bytes arrives")
def segmented(bench):
    with bench.sdo.open(0x60FF, 0, "wb", size=4, force_segment=True) as stream:
        stream.write((-321).to_bytes(4, "little", signed=True))
    equal(bench.read(0x60FF), -321, "60FFh")
