"""Every datagram that the manuals print, byte by byte, with python-can alone, and what they command."""

import itertools

from checks import check, equal, table, true
from drive import MJOINT, ZL, ZLAC8030L, ZLIM42C

#: What has to be there before a section's datagrams, how long a printed answer that a move is over may take, and what
#: object then reads what, give or take. Sections that are not here want nothing.
STORIES = {
    "mjoint": table(
        "section world patience index value tolerance",
        ("5.06.1", "", 15, 0x6064, 50_000, 30),
        ("5.06.2", "", 15, 0x6064, 50_000, 30),
        ("5.07.1", "", 15, 0x606C, 0, 30),
        ("5.09", "switch DIR min -15000", 15, 0x6064, 0, 150),
        ("5.10.1", "", 15, 0x6064, 10_000, 30),
        ("5.10.2", "", 15, 0x606C, -6000, 60),
    ),
    "zlim42c": table(
        "section world patience index value tolerance",
        ("5.3.4", "", 0, 0x6064, 3200, 0),
        ("5.3.5", "", 0, 0x606C, 60, 0),
        ("5.3.6", "switch X0 2000 max", 0, 0x606C, 0, 0),
    ),
}
THREE = ("m4230e17b50@1", "m4230e17b50@2", "m4230e17b50@3")
#: The section with three joints, and the SYNC that the manual prints alone.
APART = ("5.10.3", "5.08.4")


def sections(drive):
    stories = {story["section"]: story for story in STORIES.get(drive.name, [])}
    wants = dict.fromkeys(row["section"] for row in drive.rows("datagrams.csv") if row["request"] and row["section"] not in APART)
    nothing = {"world": "", "patience": 0, "index": 0x1000, "value": drive.device_type, "tolerance": 0}
    return [stories.get(section, nothing | {"section": section}) for section in wants]


def masked(got, pattern):
    """The answer with `..` where the pattern leaves a byte open."""
    pairs = itertools.zip_longest(got.split(), pattern.split(), fillvalue="")
    return " ".join(".." if wanted == ".." else byte for byte, wanted in pairs)


def answer_to(bench, row):
    mark = bench.trace.mark()
    bench.send(int(row["request_cob"], 16), bytes.fromhex(row["request"]))
    frame = bench.trace.wait(int(row["response_cob"], 16), mark, f"an answer to {row['request']}")
    return masked(bytes(frame.data).hex(" ").upper(), row["answer"])


def replay(bench, section, patience_s=0):
    """Sends a section's requests in order and compares the drive's answers; NMT and SYNC have none.

    A printed answer may report that a move is over. With patience, its request is sent again until that is so.
    """
    for row in bench.drive.rows("datagrams.csv"):
        if row["section"] != section or not row["request_cob"]:
            continue
        if not row["response_cob"]:
            bench.send(int(row["request_cob"], 16), bytes.fromhex(row["request"]))
            bench.sleep(0.05)
            continue
        got, end = answer_to(bench, row), bench.now() + patience_s
        while got != row["answer"] and bench.now() < end:
            got = answer_to(bench, row)
        equal(got, row["answer"], f"answer to {row['request']} ({row['meaning']})")


@check("manual {section}: the drive answers each datagram as printed, or as CiA 301 demands, and does what they say", *ZL, MJOINT, rows=sections)
def section(bench, row):
    if row["section"] == "5.3.6" and bench.drive is ZLIM42C:
        bench.write(0x2030, 2, sub=2)
    if row["world"]:
        bench.world(row["world"])
    replay(bench, row["section"], row["patience"])
    bench.becomes(row["index"], row["value"], row["tolerance"])
    if row["section"] == "5.3.6":
        bench.status_becomes(1 << 8, 1 << 8, "bit 8 reports that homing is done")


@check("manual 5.10.3: the datagrams of RPDO4 wait for SYNC on three joints", MJOINT, drives=THREE)
def three_joints(bench):
    joints = [bench, bench.other(2), bench.other(3)]
    for joint in joints:
        joint.enable(1)
    *targets, sync = [row for row in bench.drive.rows("datagrams.csv") if row["section"] == "5.10.3"]
    for row in targets:
        equal(answer_to(bench, row), row["answer"], row["meaning"])
    bench.sleep(0.3)
    equal([abs(joint.read(0x6064)) <= 30 for joint in joints], [True] * 3, "no joint moves before SYNC")
    bench.send(int(sync["request_cob"], 16))
    for joint in joints:
        joint.becomes(0x6064, 50_000, 30)


@check("manual 6.1: TPDO0 carries 606Ch on its timer after NMT start, and closes", ZLAC8030L)
def mapped_speed(bench):
    replay(bench, "6.1")
    bench.send(0x000, b"\x01\x04")
    mark = bench.trace.mark()
    equal(bench.trace.wait(0x184, mark, "TPDO0").dlc, 4, "bytes of TPDO0")
    bench.send(0x000, b"\x80\x04")
    bench.sleep(0.1)
    bench.read(0x1000)  # what was sent before the answer has been heard by then
    mark = bench.trace.mark()
    bench.sleep(1.2)
    true(not bench.trace.since(mark, 0x184), "no TPDO0 after closing")
