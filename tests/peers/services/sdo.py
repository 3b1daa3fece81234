"""SDO (CiA 301, 7.2.4): whole dictionaries row by row of `objects.csv` and `refused.csv`, and transfers by the bytes."""

import canopen

from checks import check, equal, table, true
from drive import ALL, MJOINT

READ_ONLY, WRONG_LENGTH, TOO_LONG, TOO_SHORT = 0x06010002, 0x06070010, 0x06070012, 0x06070013
BAD_VALUE, TOO_HIGH, TOO_LOW, UNKNOWN_COMMAND = 0x06090030, 0x06090031, 0x06090032, 0x05040001


def place(row):
    return int(row["index"], 16), int(row["sub"], 16)


def size(row):
    return int(row["type"][1:]) // 8


def sweep(bench, of, wrong_with):
    """Asks the rows that `of` picks, and shows all that are wrong: one row says less than the list."""
    rows = [row for row in bench.drive.rows("objects.csv") if of(row)]
    true(rows, "there are such rows")
    found = [f"{row['index']}h:{row['sub']} {wrong}" for row in rows for wrong in wrong_with(row)]
    equal(found, [], "rows that differ")


@check("every object of the manual reads its default with its size", *ALL)
def defaults(bench):
    def wrong(row):
        value = bench.read(*place(row))
        if row["live"] == "no" and row["default"] and value != int(row["default"], 0):
            yield f"expected {row['default']}, got {value}"

    sweep(bench, lambda row: True, wrong)


@check("read-only objects refuse to be written, and what can be written refuses a byte more and a byte less", *ALL)
def refused_by_access_and_size(bench):
    def wrong(row):
        cases = [(size(row), (READ_ONLY,))]
        if row["access"] == "rw":
            cases = [(size(row) + 1, (WRONG_LENGTH, TOO_LONG)), (size(row) - 1, (WRONG_LENGTH, TOO_SHORT))]
        for length, codes in cases:
            if 1 <= length <= 4:
                code = bench.abort_code(bench.sdo.download, *place(row), bytes(length))
                if code not in codes:
                    yield f"{length} bytes: abort {code and hex(code)}"

    sweep(bench, lambda row: True, wrong)


@check("every limit holds: the bounds are taken, what lies beyond is refused and changes nothing", *ALL)
def limits(bench):
    def wrong(row):
        (index, sub), low, high = place(row), int(row["min"]), int(row["max"])
        bits, signed = 8 * size(row), row["type"][0] == "I"
        least, most = (-(1 << bits - 1), (1 << bits - 1) - 1) if signed else (0, (1 << bits) - 1)
        before = bench.read(index, sub)
        for value, codes in ((low - 1, (BAD_VALUE, TOO_LOW)), (high + 1, (BAD_VALUE, TOO_HIGH))):
            if least <= value <= most:
                code = bench.abort_code(bench.write, index, value, sub)
                if code not in codes or bench.read(index, sub) != before:
                    yield f"= {value}: abort {code and hex(code)}, then {bench.read(index, sub)} for {before}"
        # The highest first: the range of 60FFh of the ZLAC8030L follows 202Fh:05, which so ends at 1, as delivered.
        for value in (high, low):
            code = bench.abort_code(bench.write, index, value, sub)
            if code is not None or (bench.read(index, sub) != value and index not in bench.drive.forgetting):
                yield f"= {value}: abort {code}, then {bench.read(index, sub)}"
        # What one object has may bound another: 202Eh:04 of the ZLAC8030L is not above 202Eh:03.
        bench.abort_code(bench.write, index, before, sub)

    sweep(bench, lambda row: row["access"] == "rw" and row["min"] and place(row)[0] not in bench.drive.acting, wrong)


@check("objects, sub-indexes and values that the manual does not have are refused, each with its code", *ALL)
def not_in_the_manual(bench):
    known = {place(row): row for row in bench.drive.rows("objects.csv")}
    for row in bench.drive.rows("refused.csv"):
        (index, sub), value = place(row), row["value"]
        if value:
            width = size(known[index, sub]) if (index, sub) in known else 4
            data = int(value).to_bytes(width, "little", signed=int(value) < 0)
            code = bench.abort_code(bench.sdo.download, index, sub, data)
        else:
            code = bench.abort_code(bench.sdo.upload, index, sub)
        equal(code, int(row["abort"], 16), f"abort of {index:04X}h:{sub:02X} {value}")


REQUESTS = table(
    "what request answer",
    ("a command that CiA 301 does not know is refused", "E0 00 10 00 00 00 00 00", "80 00 10 00 01 00 04 05"),
    ("a block upload is refused", "A4 00 10 00 7F 00 00 00", "80 00 10 00 01 00 04 05"),
    ("four bytes are written", "23 83 60 00 E8 03 00 00", "60 83 60 00 00 00 00 00"),
    ("bytes without a size are taken by the object's own", "22 83 60 00 D0 07 00 00", "60 83 60 00 00 00 00 00"),
    ("four bytes are read", "40 83 60 00 00 00 00 00", "43 83 60 00 D0 07 00 00"),
    ("two bytes are written", "2B 17 10 00 F4 01 00 00", "60 17 10 00 00 00 00 00"),
    ("two bytes are read", "40 17 10 00 00 00 00 00", "4B 17 10 00 F4 01 00 00"),
    ("one byte is written", "2F 60 60 00 03 00 00 00", "60 60 60 00 00 00 00 00"),
    ("one byte is read", "40 60 60 00 00 00 00 00", "4F 60 60 00 03 00 00 00"),
)
#: The joint takes requests with as many bytes as they need.
SHORT_REQUESTS = table(
    "what request answer",
    ("a read of four bytes", "40 83 60 00", "43 83 60 00 20 4E 00 00"),
    ("a write of a byte", "2F 98 60 00 12", "60 98 60 00 00 00 00 00"),
    ("a write of two bytes", "2B 17 10 00 F4 01", "60 17 10 00 00 00 00 00"),
)


@check("requests are answered by the bytes of CiA 301", *ALL)
def by_the_bytes(bench):
    for row in (SHORT_REQUESTS if bench.drive is MJOINT else []) + REQUESTS:
        equal(bench.ask(bytes.fromhex(row["request"])).hex(" ").upper(), row["answer"], row["what"])


@check("canopen-python's segmented download arrives, and its block transfer is refused with 0504 0001", *ALL)
def by_library(bench):
    with bench.sdo.open(0x60FF, 0, "wb", size=4, force_segment=True) as stream:
        stream.write((-321).to_bytes(4, "little", signed=True))
    equal(bench.read(0x60FF), -321, "60FFh")
    try:
        bench.sdo.open(0x1000, 0, "rb", block_transfer=True).close()
    except canopen.SdoAbortedError as error:
        equal(error.code, UNKNOWN_COMMAND, "block upload by canopen-python")
    else:
        raise AssertionError("a block upload by canopen-python succeeded")
