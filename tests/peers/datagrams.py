"""The datagrams that a manual prints, byte by byte, with python-can alone."""

import itertools
import time

from checks import equal


def replay(bench, section, patience_s=0):
    """Sends a section's requests in order and compares the drive's answers; NMT and SYNC have none.

    A printed answer may tell that a move is over. With patience, its request is sent again until that is so.
    """
    for row in bench.drive.rows("datagrams.csv"):
        if row["section"] != section or not row["request_cob"]:
            continue
        request = bytes.fromhex(row["request"])
        cob = int(row["request_cob"], 16)
        if not row["response_cob"]:
            bench.send(cob, request)
            time.sleep(0.05)
            continue
        ask = lambda: masked(answer_to(bench, row, request), row["answer"])
        got = ask()
        end = bench.now() + patience_s
        while got != row["answer"] and bench.now() < end:
            got = ask()
        equal(got, row["answer"], f"answer to {row['request']} ({row['meaning']})")
    equal(bench.read(0x1000), bench.drive.device_type, "1000h at the end")


def answer_to(bench, row, request):
    mark = bench.trace.mark()
    bench.send(int(row["request_cob"], 16), request)
    frame = bench.trace.wait(int(row["response_cob"], 16), mark, 3.0, f"an answer to {row['request']}")
    return bytes(frame.data).hex(" ").upper()


def sections(drive):
    return dict.fromkeys(row["section"] for row in drive.rows("datagrams.csv") if row["request"])


def masked(got, pattern):
    """The answer with `..` where the pattern leaves a byte open."""
    return " ".join(".." if wanted == ".." else byte for byte, wanted in itertools.zip_longest(got.split(), pattern.split(), fillvalue=""))
