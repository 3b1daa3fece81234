"""SDO reads, writes and aborts (manual 3.3 and chapter 9; CiA 301, 7.2.4)."""

import sweeps
import transfers
from checks import check, equal
from sweeps import BAD_VALUE

transfers.COMMON.into("zlac8030l")


@check("every object of the manual reads its default with its size")
def defaults(bench):
    sweeps.defaults(bench)


@check("read-only objects refuse to be written")
def read_only(bench):
    sweeps.read_only(bench)


@check("objects that the drive lacks are refused as missing objects")
def missing_objects(bench):
    sweeps.missing_objects(bench, (0x1003, 0x1004, 0x1006, 0x1008, 0x100C, 0x1010, 0x1011, 0x1016, 0x2024, 0x6098, 0x6502, 0xFFFF))


@check("sub-indexes that an object lacks are refused as missing sub-indexes")
def missing_sub_indexes(bench):
    sweeps.missing_sub_indexes(bench, ((0x1000, 1), (0x1018, 4), (0x1600, 5), (0x1800, 6), (0x2030, 6), (0x2030, 0x10), (0x6041, 255)))


@check("data of the wrong size is refused")
def sizes(bench):
    sweeps.sizes(bench)


@check("every limit holds: the bounds are taken, what lies beyond is refused and changes nothing")
def limits(bench):
    # 2009h and 2010h act on the parameter store.
    sweeps.limits(bench, acting=(0x2009, 0x2010), forgetting=(0x2005, 0x2006))


@check("modes that the drive lacks are refused")
def modes(bench):
    for mode in (2, 6, 7, 8, -1):
        equal(bench.abort_code(bench.write, 0x6060, mode), BAD_VALUE, f"6060h = {mode}")


@check("an expedited download without a size is taken by the object's own size")
def size_not_indicated(bench):
    equal(bench.ask(bytes.fromhex("22 FF 60 00 64 00 00 00")), bytes.fromhex("60 FF 60 00 00 00 00 00"), "answer")
    equal(bench.read(0x60FF), 100, "60FFh")
