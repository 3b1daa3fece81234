"""SDO: sizes, lengths of frames, aborts (manual 5.04 and 5.05; CiA 301, 7.2.4)."""

import sweeps
import transfers
from checks import check, equal, true
from sweeps import BAD_VALUE, READ_ONLY, TOO_HIGH

transfers.COMMON.into("mjoint")


@check("every object of the manual reads its default with its size")
def defaults(bench):
    sweeps.defaults(bench)


@check("read-only objects refuse to be written, the fixed PDO mappings among them")
def read_only(bench):
    sweeps.read_only(bench)
    for index in (0x1600, 0x1601, 0x1602, 0x1603, 0x1A00, 0x1A01, 0x1A02, 0x1A03):
        for sub in (0, 1):
            equal(bench.abort_code(bench.write, index, 0, sub), READ_ONLY, f"write {index:04X}h:{sub:02X}")


@check("objects that the joint lacks are refused as missing objects")
def missing_objects(bench):
    absent = (0x1003, 0x1008, 0x1010, 0x1014, 0x1200, 0x2000, 0x2602, 0x260D, 0x603F, 0x6061, 0x607C, 0x6084, 0x6099, 0x609A, 0x6502)
    sweeps.missing_objects(bench, absent)


@check("sub-indexes that an object lacks are refused as missing sub-indexes")
def missing_sub_indexes(bench):
    sweeps.missing_sub_indexes(bench, ((0x1000, 1), (0x1016, 2), (0x1018, 5), (0x1600, 4), (0x1603, 2), (0x60F9, 3), (0x6041, 1)))


@check("data of the wrong size is refused")
def sizes(bench):
    sweeps.sizes(bench)


@check("every limit holds: the bounds are taken, what lies beyond is refused and changes nothing")
def limits(bench):
    # 2601h and 2614h are commands; a write of 6060h starts homing.
    sweeps.limits(bench, acting=(0x2601, 0x2614, 0x6060))


@check("modes other than 1, 3, 6 and 7, and methods other than 17 to 22, are refused")
def modes(bench):
    for mode in (2, 4, 5):
        equal(bench.abort_code(bench.write, 0x6060, mode), BAD_VALUE, f"6060h = {mode}")
    for mode in (0, 8, -1):
        true(bench.abort_code(bench.write, 0x6060, mode) is not None, f"6060h = {mode} was taken")
    for method in (16, 23, 35, 0):
        true(bench.abort_code(bench.write, 0x6098, method) is not None, f"6098h = {method} was taken")
    code = bench.abort_code(bench.write, 0x6083, 65536)
    true(code in (BAD_VALUE, TOO_HIGH), f"6083h = 65536: abort {code and hex(code)}")


@check("requests are taken with as many bytes as they need, and with eight; answers always have eight")
def lengths(bench):
    for request, answer in (
        ("40 83 60 00", "43 83 60 00 20 4E 00 00"),
        ("40 83 60 00 00 00 00 00", "43 83 60 00 20 4E 00 00"),
        ("2F 98 60 00 12", "60 98 60 00 00 00 00 00"),
        ("2F 98 60 00 13 00 00 00", "60 98 60 00 00 00 00 00"),
        ("2B 17 10 00 F4 01", "60 17 10 00 00 00 00 00"),
        ("2B 17 10 00 F4 01 00 00", "60 17 10 00 00 00 00 00"),
        ("23 81 60 00 E8 03 00 00", "60 81 60 00 00 00 00 00"),
        ("40 98 60 00", "4F 98 60 00 13 00 00 00"),
        ("40 17 10 00", "4B 17 10 00 F4 01 00 00"),
        ("40 18 10 00", "4F 18 10 00 04 00 00 00"),
        ("40 18 10 01", "43 18 10 01 31 03 00 00"),
        ("40 41 60 00", "4B 41 60 00 04 04 00 00"),
    ):
        equal(bench.ask(bytes.fromhex(request)).hex(" ").upper(), answer, f"answer to {request}")


@check("a request whose data is cut off stores nothing")
def cut_off(bench):
    for request in ("23 81 60 00 E8 03", "2B 40 60 00 0F", "2F 60 60 00", "2B 40 60", "40", ""):
        bench.send(0x601, bytes.fromhex(request))
    bench.sleep(0.1)
    equal([bench.read(0x6081), bench.read(0x6040), bench.read(0x6060)], [1500, 0, 1], "6081h, 6040h and 6060h")


@check("6079h reads the supply in 1/327 V, and 2612h the temperature in degrees")
def measurements(bench):
    for volts in (36, 30):
        bench.world(f"supply {volts}")
        bench.sleep(0.3)
        true(abs(bench.read(0x6079) / 327 - volts) < 0.5, f"6079h = {bench.read(0x6079)} at {volts} V")
    bench.world("temperature driver 60")
    bench.world("temperature motor 60")
    bench.sleep(0.3)
    equal(bench.read(0x2612), 60, "2612h")
