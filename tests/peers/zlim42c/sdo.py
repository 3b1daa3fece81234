"""SDO reads, writes and aborts (manual 5.2 and 5.4; CiA 301, 7.2.4)."""

import sweeps
import transfers
from checks import check, equal, true
from sweeps import BAD_VALUE

TOGGLE = 0x05030000

transfers.COMMON.into("zlim42c")


@check("the identity is the one that the manual prints, the ZLAC8030L's")
def identity(bench):
    equal(bench.read(0x1000), 0x00040192, "1000h")
    equal([bench.read(0x1018, sub) for sub in (1, 2)], [0x100, 1], "vendor and product")


@check("every object of the manual reads its default with its size")
def defaults(bench):
    sweeps.defaults(bench)


@check("read-only objects refuse to be written")
def read_only(bench):
    sweeps.read_only(bench)


@check("objects that the drive lacks are refused as missing objects")
def missing_objects(bench):
    # 1006h, 1007h and 1016h stand in the tables of 5.2, and not in the dictionary of 5.4. There is no torque mode.
    absent = (0x1003, 0x1006, 0x1007, 0x1008, 0x100C, 0x1010, 0x1011, 0x1015, 0x1016, 0x1024, 0x2013, 0x6071, 0x6077, 0x6502)
    sweeps.missing_objects(bench, absent)


@check("sub-indexes that an object lacks are refused as missing sub-indexes")
def missing_sub_indexes(bench):
    places = ((0x1000, 1), (0x1018, 4), (0x1600, 5), (0x1800, 6), (0x2030, 6), (0x2030, 0x0B), (0x6099, 3), (0x6041, 255))
    sweeps.missing_sub_indexes(bench, places)


@check("data of the wrong size is refused")
def sizes(bench):
    sweeps.sizes(bench)


@check("every limit holds: the bounds are taken, what lies beyond is refused and changes nothing")
def limits(bench):
    # 2010h acts on the parameter store; 2011h and 2012h are commands.
    sweeps.limits(bench, acting=(0x2010,), forgetting=(0x2011, 0x2012))


@check("modes that the drive lacks are refused, mode 2 of the table in 5.3.3 too")
def modes(bench):
    for mode in (2, 4, 5, 7, 8, -1):
        equal(bench.abort_code(bench.write, 0x6060, mode), BAD_VALUE, f"6060h = {mode}")
        equal(bench.read(0x6060), 0, "6060h")


@check("homing methods other than 0, 17, 18, 24 and 29 are refused")
def methods(bench):
    for method in (1, 16, 19, 23, 25, 28, 35):
        true(bench.abort_code(bench.write, 0x6098, method) is not None, f"6098h = {method} was taken")
    equal(bench.read(0x6098), 0, "6098h")


@check("reads answer 4F, 4B and 43 by the object's size, and writes answer 60")
def commands(bench):
    for request, answer in (
        ("40 61 60 00 00 00 00 00", "4F 61 60 00 00 00 00 00"),
        ("40 84 60 00 00 00 00 00", "43 84 60 00 64 00 00 00"),
        ("40 5A 60 00 00 00 00 00", "4B 5A 60 00 05 00 00 00"),
        ("2F 60 60 00 01 00 00 00", "60 60 60 00 00 00 00 00"),
        ("2B 5A 60 00 06 00 00 00", "60 5A 60 00 00 00 00 00"),
        ("23 84 60 00 C8 00 00 00", "60 84 60 00 00 00 00 00"),
        ("27 84 60 00 C8 00 00 00", "80 84 60 00 10 00 07 06"),
    ):
        got = bench.ask(bytes.fromhex(request)).hex(" ").upper()
        if request.startswith("27"):  # a length that is too short may say so, or only that it is wrong
            got = got.replace("13 00 07 06", "10 00 07 06")
        equal(got, answer, f"answer to {request}")
    equal(bench.read(0x6084), 200, "6084h")


@check("a segmented download with the wrong toggle bit is aborted and stores nothing")
def wrong_toggle(bench):
    equal(bench.ask(bytes.fromhex("21 FF 60 00 04 00 00 00"))[0], 0x60, "answer to the beginning")
    answer = bench.ask(bytes.fromhex("17 64 00 00 00 00 00 00"))
    equal((answer[0], int.from_bytes(answer[4:], "little")), (0x80, TOGGLE), "answer to toggle 1 first")
    equal(bench.read(0x60FF), 0, "60FFh")


@check("a client's abort in the middle of a segmented download leaves the drive answering")
def client_abort(bench):
    equal(bench.ask(bytes.fromhex("21 FF 60 00 04 00 00 00"))[0], 0x60, "answer to the beginning")
    bench.send(0x600 + bench.node_id, bytes.fromhex("80 FF 60 00 00 00 00 08"))
    equal(bench.read(0x60FF), 0, "60FFh")


@check("SDO requests without data, and remote frames, do not disturb the drive")
def empty_requests(bench):
    for length in range(4):
        bench.send(0x600 + bench.node_id, bytes(length))
    bench.send(0x000, b"")
    bench.send(0x000, b"\x01")
    equal(bench.read(0x1000), bench.drive.device_type, "1000h")
