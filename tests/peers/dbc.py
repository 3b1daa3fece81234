"""Checks of `ferrodrive export dbc`: cantools reads the file, and takes values from PDOs as the manual's table says.

What is expected comes from `tests/data` (type and unit of each object) and from the mapping as canopen-python reads it."""

import subprocess

import cantools

from checks import check, equal, near, true
from drive import ALL, MJOINT, ZLAC8030L
from services.pdo import set_up

#: Objects that have another form in PDOs than by SDO: drive, index, then type and unit.
#: M joint manual, 5.08.3 and 5.10.2: TPDO3 carries the speed in 32 bits of r/min.
OTHER_FORMS = {(MJOINT.name, 0x606C): ("I32", "r/min")}

#: Bytes of frames: each bit once, signs, and the largest and smallest numbers.
PAYLOADS = [bytes(range(1, 9)), bytes(8), b"\xff" * 8, b"\x80\x7f" * 4, b"\xfe\xff\xff\xff" * 2, b"\x00\x00\x00\x80" * 2]


def export(bench):
    bus = f"socketcand://127.0.0.1:{bench.simulator.port()}/can0"
    node = bench.node_id
    words = [bench.program, "--bus", bus, "--timeout", "60s", "--model", f"{node}={bench.drive.model}", "export", "dbc", str(node)]
    done = subprocess.run(words, capture_output=True, text=True, timeout=60)
    equal(done.returncode, 0, f"exit status of {words[1:]}: {done.stdout}{done.stderr}")
    return cantools.database.load_string(done.stdout, "dbc")


def row_of(drive, index, sub):
    rows = [row for row in drive.rows("objects.csv") if int(row["index"], 16) == index and int(row["sub"], 16) == sub]
    true(len(rows) == 1, f"{index:04X}h:{sub:02X} has a row")
    kind, unit = OTHER_FORMS.get((drive.name, index), (rows[0]["type"], rows[0]["unit"]))
    head, _, tail = unit.partition(" ")
    # "0.1 r/min" is a tenth of r/min.
    return (kind, float(head), tail) if head[:1].isdigit() else (kind, 1.0, unit)


def mapping(bench, base, number):
    """The objects that a PDO carries: index, sub-index, bits."""
    count = bench.read(base + number - 1, 0)
    entries = [bench.read(base + number - 1, sub) for sub in range(1, count + 1)]
    return [(entry >> 16, entry >> 8 & 0xFF, entry & 0xFF) for entry in entries]


@check("cantools takes values from transmit PDOs by its DBC as the manual's table has them", *ALL)
def transmit_pdos(bench):
    if bench.drive.name != MJOINT.name:
        set_up(bench, bench.node.tpdo[1], (0x6041, 0x606C), trans_type=255)
        set_up(bench, bench.node.tpdo[2], (0x6064, 0x6061), trans_type=255)
    database = export(bench)
    compared = 0
    for number in (1, 2, 3, 4):
        objects = mapping(bench, 0x1A00, number)
        name = f"TPDO{number}_{bench.node_id}"
        found = [message for message in database.messages if message.name == name]
        equal(len(found), int(bool(objects)), f"messages called {name}")
        for message in found:
            equal(message.frame_id, 0x080 + 0x100 * number + bench.node_id, f"{name}: identifier")
            compared += compare(bench.drive, message, objects)
    true(compared >= 4, f"only {compared} signals were compared")


def compare(drive, message, objects):
    """Holds the signals of a message to the objects that its PDO carries. How many there were."""
    equal(len(message.signals), len(objects), f"{message.name}: signals")
    equal(message.length, sum(bits for _, _, bits in objects) // 8, f"{message.name}: length")
    at = 0
    for (index, sub, bits), signal in zip(objects, sorted(message.signals, key=lambda signal: signal.start)):
        kind, factor, unit = row_of(drive, index, sub)
        what = f"{message.name}, {index:04X}h"
        equal((signal.start, signal.length), (at, bits), f"{what}: place")
        equal(signal.is_signed, kind.startswith("I"), f"{what}: sign")
        equal(signal.unit or "", unit, f"{what}: unit")
        for payload in PAYLOADS:
            data = payload[: message.length]
            number = int.from_bytes(data[at // 8 : (at + bits) // 8], "little", signed=kind.startswith("I"))
            value = message.decode(data, decode_choices=False)[signal.name]
            near(value, number * factor, abs(number) * 1e-12, f"{what}: value of {data.hex()}")
        at += bits
    return len(objects)


#: ZLAC8030L quick start guide V1.00, 9, as the command line spells them, with their sub-indexes.
LONG = (
    "input_terminal_x0_function_selection_02",
    "output_terminal_y0_function_selection_0D",
    "output_terminal_y1_function_selection_0F",
)


@check("cantools has names that are longer than DBC allows, whole and each once", ZLAC8030L)
def long_names(bench):
    identifier = 0x180 + bench.node_id
    mapped = [(0x1A00, place, 0x2030_0010 | sub << 8) for place, sub in enumerate((0x02, 0x0D, 0x0F), start=1)]
    off, on = (0x1800, 1, 1 << 31 | identifier), (0x1800, 1, identifier)
    bench.write_all([off, (0x1A00, 0, 0), *mapped, (0x1A00, 0, len(mapped)), on])
    message = export(bench).get_message_by_name(f"TPDO1_{bench.node_id}")
    equal(tuple(signal.name for signal in message.signals), LONG, "names")
    equal(message.decode(bytes.fromhex("090001000400"), decode_choices=False), dict(zip(LONG, (9, 1, 4))), "values")


@check("cantools reads heartbeat, emergency and NMT of its DBC", *ALL)
def of_every_node(bench):
    database, node = export(bench), bench.node_id
    # CiA 301, 7.2.8.3.2.2: 05h is OPERATIONAL.
    equal(str(database.decode_message(0x700 + node, b"\x05")["nmt_state"]), "operational", "state")
    # CiA 301, 7.2.7.1: error code, error register, five bytes of the maker's.
    emergency = database.decode_message(0x080 + node, bytes.fromhex("1023010000000000"))
    equal((emergency["error_code"], emergency["error_register"]), (0x2310, 1), "emergency")
    command = database.decode_message(0x000, bytes([0x81, node]))
    equal((str(command["command"]), command["node"]), ("reset node", node), "NMT")
