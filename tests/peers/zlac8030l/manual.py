"""Every datagram that the manual prints, byte by byte, with python-can alone."""

import time

import datagrams
from checks import check, equal
from zlac8030l import DRIVE, rows


def conversation(section):
    """Makes a check that sends a section's requests in order and compares the drive's answers."""

    @check(f"manual {section}: the drive answers each datagram as printed, or as CiA 301 demands")
    def replay(bench):
        datagrams.replay(bench, section)

    return replay


for _section in datagrams.sections(DRIVE):
    conversation(_section)


@check("manual 6.1: TPDO0 carries 606Ch on its timer after NMT start, and closes")
def mapped_speed(bench):
    for row in rows("datagrams.csv"):
        if row["section"] == "6.1" and row["request_cob"] == "0x604":
            bench.ask(bytes.fromhex(row["request"]))
    mark = bench.trace.mark()
    bench.send(0x000, b"\x01\x04")
    frame = bench.trace.wait(0x184, mark, 1.5, "TPDO0")
    equal(frame.dlc, 4, "bytes of TPDO0")
    bench.send(0x000, b"\x80\x04")
    time.sleep(0.1)
    mark = bench.trace.mark()
    time.sleep(1.2)
    equal(len(bench.trace.since(mark, 0x184)), 0, "TPDO0 after closing")


@check("manual 3.2: the drive announces itself with 704h and one zero byte when it is powered on")
def announces(bench):
    mark = bench.trace.mark()
    bench.world("power cycle")
    frame = bench.trace.wait(0x704, mark, 5.0, "boot-up")
    equal(bytes(frame.data), b"\0", "boot-up")
