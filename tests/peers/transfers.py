"""SDO transfers in which no drive differs from another (CiA 301, 7.2.4). 60FFh is four signed bytes on each."""

import canopen

from checks import Common, equal
from sweeps import UNKNOWN_COMMAND

COMMON = Common()
check = COMMON.check


@check("a command that CiA 301 does not know, and block transfer, are refused with 0504 0001")
def unknown_commands(bench):
    expected = bytes.fromhex("80 00 10 00 01 00 04 05")
    equal(bench.ask(bytes.fromhex("E0 00 10 00 00 00 00 00")), expected, "answer to E0h")
    equal(bench.ask(bytes.fromhex("A4 00 10 00 7F 00 00 00")), expected, "answer to a block upload")
    try:
        bench.sdo.open(0x1000, 0, "rb", block_transfer=True).close()
    except canopen.SdoAbortedError as error:
        equal(error.code, UNKNOWN_COMMAND, "block upload by canopen-python")
    else:
        raise AssertionError("a block upload by canopen-python succeeded")


@check("a segmented download of four bytes arrives")
def segmented(bench):
    with bench.sdo.open(0x60FF, 0, "wb", size=4, force_segment=True) as stream:
        stream.write((-321).to_bytes(4, "little", signed=True))
    equal(bench.read(0x60FF), -321, "60FFh")
