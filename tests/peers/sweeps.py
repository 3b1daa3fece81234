"""Sweeps over a whole object dictionary, row by row of `objects.csv`. Which rows act when written, the caller knows."""

from checks import equal

READ_ONLY, NO_OBJECT, NO_SUB_INDEX = 0x06010002, 0x06020000, 0x06090011
WRONG_LENGTH, TOO_LONG, TOO_SHORT = 0x06070010, 0x06070012, 0x06070013
BAD_VALUE, TOO_HIGH, TOO_LOW = 0x06090030, 0x06090031, 0x06090032
UNKNOWN_COMMAND = 0x05040001


def defaults(bench):
    """Every object answers with its size, and reads its default unless it is a measurement."""
    wrong = []
    for row in bench.drive.rows("objects.csv"):
        index, sub = place(row)
        try:
            value = bench.read(index, sub)
        except Exception as error:  # gather them all: one wrong row says less than the list
            wrong.append(f"{row['index']}h:{row['sub']} {error}")
            continue
        if row["live"] == "no" and row["default"] and value != int(row["default"], 0):
            wrong.append(f"{row['index']}h:{row['sub']} expected {row['default']}, got {value}")
    equal(wrong, [], "rows that differ")


def read_only(bench):
    for row in bench.drive.rows("objects.csv"):
        if row["access"] == "ro":
            index, sub = place(row)
            data = bytes(int(row["type"][1:]) // 8)
            equal(bench.abort_code(bench.sdo.download, index, sub, data), READ_ONLY, f"write {index:04X}h:{sub:02X}")


def sizes(bench):
    """A byte more and a byte less than an object has is refused, for every object that can be written."""
    wrong = []
    for row in bench.drive.rows("objects.csv"):
        size = int(row["type"][1:]) // 8
        if row["access"] != "rw":
            continue
        index, sub = place(row)
        for length, codes in ((size + 1, (WRONG_LENGTH, TOO_LONG)), (size - 1, (WRONG_LENGTH, TOO_SHORT))):
            if 1 <= length <= 4:
                code = bench.abort_code(bench.sdo.download, index, sub, bytes(length))
                if code not in codes:
                    wrong.append(f"{length} bytes into {index:04X}h:{sub:02X}: abort {code and hex(code)}")
    equal(wrong, [], "lengths that were not refused as they should")


def missing_objects(bench, indexes):
    for index in indexes:
        equal(bench.abort_code(bench.sdo.upload, index, 0), NO_OBJECT, f"read {index:04X}h")
        equal(bench.abort_code(bench.sdo.download, index, 0, b"\0"), NO_OBJECT, f"write {index:04X}h")


def missing_sub_indexes(bench, places):
    for index, sub in places:
        equal(bench.abort_code(bench.sdo.upload, index, sub), NO_SUB_INDEX, f"read {index:04X}h:{sub:02X}")


def limits(bench, acting=(), forgetting=()):
    """The bounds of each row are taken, what lies beyond is refused and changes nothing.

    `acting` objects are left out; `forgetting` ones take a command and read 0 again.
    """
    wrong = []
    for row in bench.drive.rows("objects.csv"):
        index, sub = place(row)
        if row["access"] == "rw" and row["min"] and index not in acting:
            wrong += limit_errors(bench, index, sub, row, index in forgetting)
    equal(wrong, [], "limits that differ")


def limit_errors(bench, index, sub, row, forgets):
    low, high, kind = int(row["min"]), int(row["max"]), row["type"]
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
    # The highest first: the range of 60FFh of the ZLAC8030L follows 202Fh:05, which so ends at 1, as delivered.
    for value in (high, low):
        code = bench.abort_code(bench.write, index, value, sub)
        if code is not None:
            yield f"{index:04X}h:{sub:02X} = {value}: abort {code:#x}"
        elif bench.read(index, sub) != value and not forgets:
            yield f"{index:04X}h:{sub:02X} reads {bench.read(index, sub)} after {value}"


def place(row):
    return int(row["index"], 16), int(row["sub"], 16)
