"""Checks of log files: what this program writes, python-can, tshark and can-utils read, and what those write it reads.

The frames are of one drive's bus, and made by hand where a kind of frame does not come by itself. tshark and can-utils are
Debian packages; a machine without them skips their checks."""

import json
import pathlib
import shutil
import subprocess
import tempfile

import can

from checks import Skip, check, equal, true
from drive import ALL

#: 2023-11-14 22:13:20.123456, and later.
BEGIN = 1_700_000_000.123456

#: An SDO upload of the vendor-ID with its answer, an NMT command, a boot-up, an extended frame, a remote frame, an empty one.
FRAMES = [
    (0x604, False, False, "4018100100000000"),
    (0x584, False, False, "4318100192010000"),
    (0x000, False, False, "0104"),
    (0x704, False, False, "00"),
    (0x18EBFF00, True, False, "0102030405060708"),
    (0x184, False, True, ""),
    (0x080, False, False, ""),
]


def messages():
    return [
        can.Message(
            timestamp=BEGIN + number * 0.25, arbitration_id=identifier, is_extended_id=extended, is_remote_frame=remote,
            data=bytes.fromhex(data), dlc=4 if remote else len(data) // 2, channel=0, is_rx=number % 2 == 1,
        )
        for number, (identifier, extended, remote, data) in enumerate(FRAMES)
    ]


def write_source(path):
    """The frames as candump writes them. python-can's own writer leaves the length of a remote frame away."""
    lines = []
    for number, (identifier, extended, remote, data) in enumerate(FRAMES):
        frame = f"{identifier:0{8 if extended else 3}X}#{'R4' if remote else data}"
        lines.append(f"({BEGIN + number * 0.25:.6f}) can0 {frame} {'T' if number % 2 == 0 else 'R'}\n")
    path.write_text("".join(lines))


def same(read, expected, what, begin=0.0, tolerance=2e-6, directions=True):
    """Holds frames of one reader to those of another; `begin` is what the reader counts its times from."""
    equal(len(read), len(expected), f"{what}: frames")
    for one, other in zip(read, expected):
        equal(
            (one.arbitration_id, one.is_extended_id, one.is_remote_frame, bytes(one.data), one.dlc),
            (other.arbitration_id, other.is_extended_id, other.is_remote_frame, bytes(other.data), other.dlc), what,
        )
        true(abs(one.timestamp + begin - other.timestamp) < tolerance, f"{what}: time {one.timestamp} for {other.timestamp}")
        if directions:
            equal(one.is_rx, other.is_rx, f"{what}: direction")


def ferrodrive(bench, *words):
    done = subprocess.run([bench.program, "--json", *map(str, words)], capture_output=True, text=True, timeout=60)
    equal(done.returncode, 0, f"exit status of {words}: {done.stdout}{done.stderr}")
    return [json.loads(line) for line in done.stdout.splitlines()]


def decoded(bench, path):
    """The frames of a log as `ferrodrive decode` prints them, as messages of python-can."""
    read = []
    for line in ferrodrive(bench, "decode", path):
        identifier, data = line["frame"].split("#")
        remote = data.startswith("R")
        read.append(can.Message(
            timestamp=line["t"], arbitration_id=int(identifier, 16), is_extended_id=len(identifier) == 8,
            is_remote_frame=remote, dlc=int(data[1:] or 0) if remote else len(data) // 2,
            data=b"" if remote else bytes.fromhex(data), is_rx=not line.get("sent", False),
        ))
    return read


#: Extension, what python-can's reader counts times from, what the form cannot say.
FORMS = [
    {"form": "log", "begin": 0.0, "directions": True},
    # python-can gives the times since the begin of an ASC file.
    {"form": "asc", "begin": int(BEGIN * 1000) / 1000, "directions": True},
    {"form": "blf", "begin": 0.0, "directions": True},
]


@check("python-can reads the {form} that it writes", ALL[0], rows=FORMS)
def they_read_ours(bench, row):
    with tempfile.TemporaryDirectory() as folder:
        source, target = pathlib.Path(folder) / "source.log", pathlib.Path(folder) / f"ours.{row['form']}"
        write_source(source)
        report = ferrodrive(bench, "convert", source, target)[0]
        equal((report["frames"], report["passed_over"]), (len(FRAMES), 0), "what was converted")
        with can.LogReader(target) as reader:
            same(list(reader), messages(), row["form"], row["begin"])


@check("It reads the {form} that python-can writes", ALL[0],
       rows=[{"form": "log"}, {"form": "asc"}, {"form": "blf"}, {"form": "trc"}])
def we_read_theirs(bench, row):
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / f"theirs.{row['form']}"
        with can.Logger(path) as writer:
            for message in messages():
                writer.on_message_received(message)
        # python-can's TRC has no remote frames, and its candump form has them without a length.
        expected = [it for it in messages() if not (row["form"] == "trc" and it.is_remote_frame)]
        for message in expected:
            if row["form"] == "log" and message.is_remote_frame:
                message.dlc = 0
        read = decoded(bench, path) if row["form"] != "trc" else trc(bench, path)
        # TRC says a millisecond's thousandth, and its head a day's 1e-10; ASC's head says milliseconds.
        tolerance = {"trc": 1e-3, "asc": 1e-3}.get(row["form"], 2e-6)
        same(read, expected, row["form"], tolerance=tolerance)


def trc(bench, path):
    lines = [line for line in ferrodrive(bench, "decode", path) if "frame" in line]
    frames = [line["frame"] for line in lines]
    kept = [number for number, frame in enumerate(frames) if not frame.startswith("184#")]
    read = []
    for number in kept:
        identifier, data = frames[number].split("#")
        read.append(can.Message(
            timestamp=lines[number]["t"], arbitration_id=int(identifier, 16), is_extended_id=len(identifier) == 8,
            dlc=len(data) // 2, data=bytes.fromhex(data), is_rx=not lines[number].get("sent", False),
        ))
    return read


@check("An error frame and a CAN FD frame of python-can's {form} are reported, and do not end the log", ALL[0],
       rows=[{"form": "asc"}, {"form": "blf"}, {"form": "log"}])
def passed_over(bench, row):
    error = can.Message(timestamp=BEGIN + 0.1, is_error_frame=True, arbitration_id=0x80, dlc=8, data=bytes(8), channel=0)
    fd = can.Message(timestamp=BEGIN + 0.2, is_fd=True, arbitration_id=0x123, is_extended_id=False, data=bytes(12), channel=0)
    first, *others = messages()
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / f"mixed.{row['form']}"
        with can.Logger(path) as writer:
            for message in [first, error, fd, *others]:
                writer.on_message_received(message)
        lines = ferrodrive(bench, "decode", path)
    equal([line["note"] for line in lines if "note" in line], ["error_frame", "fd_frame"], "notes")
    equal(len([line for line in lines if "frame" in line]), len(FRAMES), "frames")


def program(name):
    found = shutil.which(name)
    if not found:
        raise Skip(f"{name} is not installed")
    return found


@check("tshark's CANopen dissector names the frames of the pcapng that it writes", ALL[0])
def wireshark(bench):
    tshark = program("tshark")
    with tempfile.TemporaryDirectory() as folder:
        source, target = pathlib.Path(folder) / "source.log", pathlib.Path(folder) / "ours.pcapng"
        # An expedited upload and its answer, NMT start, a boot-up, SYNC, a TPDO, an EMCY.
        lines = ["604#4018100100000000 T", "584#4318100192010000 R", "000#0104 T", "704#00 R", "080# T", "184#3706 R",
                 "084#1023010000000000 R"]
        source.write_text("".join(f"({BEGIN + number:.6f}) can0 {line}\n" for number, line in enumerate(lines)))
        ferrodrive(bench, "convert", source, target)
        fields = ["frame.time_epoch", "frame.interface_name", "can.id", "canopen.function_code", "canopen.node_id",
                  "canopen.sdo.main_idx", "canopen.sdo.sub_idx", "_ws.col.Info"]
        words = [tshark, "-r", target, "-d", "can.subdissector,canopen", "-T", "json"]
        for field in fields:
            words += ["-e", field]
        done = subprocess.run(words, capture_output=True, text=True, timeout=60)
        equal(done.returncode, 0, f"tshark: {done.stderr}")
    packets = [packet["_source"]["layers"] for packet in json.loads(done.stdout)]
    equal(len(packets), len(lines), "packets")
    equal([packet["frame.interface_name"][0] for packet in packets], ["can0"] * len(lines), "interfaces")
    info = [packet["_ws.col.Info"][0] for packet in packets]
    for number, word in enumerate(["SDO", "SDO", "NMT", "", "SYNC", "PDO", "EMCY"]):
        true(word in info[number].upper(), f"frame {number} is {word}: {info[number]}")
    equal(int(packets[0]["canopen.sdo.main_idx"][0], 16), 0x1018, "index of the upload")
    true(abs(float(packets[0]["frame.time_epoch"][0]) - BEGIN) < 2e-6, "time of the first packet")


@check("It reads a pcap of another program (tshark's conversion of its pcapng)", ALL[0])
def classic_pcap(bench):
    program("tshark")
    with tempfile.TemporaryDirectory() as folder:
        source, ours, theirs = (pathlib.Path(folder) / name for name in ("source.log", "ours.pcapng", "theirs.pcap"))
        write_source(source)
        ferrodrive(bench, "convert", source, ours)
        done = subprocess.run([program("editcap"), "-F", "pcap", ours, theirs], capture_output=True, text=True, timeout=60)
        equal(done.returncode, 0, f"editcap: {done.stderr}")
        # pcap has no directions.
        same(decoded(bench, theirs), messages(), "pcap", directions=False)


@check("can-utils' asc2log reads the ASC that it writes, and it the ASC of log2asc", ALL[0])
def can_utils(bench):
    asc2log, log2asc = program("asc2log"), program("log2asc")
    with tempfile.TemporaryDirectory() as folder:
        source, ours, back, theirs = (pathlib.Path(folder) / name for name in ("a.log", "b.asc", "c.log", "d.asc"))
        write_source(source)
        ferrodrive(bench, "convert", source, ours)
        subprocess.run([asc2log, "-I", ours, "-O", back], check=True, capture_output=True, timeout=60)
        texts = [line.split()[2].split("#") for line in back.read_text().splitlines()]
        equal([int(text[0], 16) for text in texts], [frame[0] for frame in FRAMES], "identifiers that asc2log reads")
        equal([text[1] for text in texts if not text[1].startswith("R")], [frame[3] for frame in FRAMES if not frame[2]], "data")
        subprocess.run([log2asc, "-I", source, "-O", theirs, "can0"], check=True, capture_output=True, timeout=60)
        # Its head has the start in whole seconds, and its times count from the first frame.
        read = decoded(bench, theirs)
        for message in read:
            message.timestamp += BEGIN - int(BEGIN)
        same(read, messages(), "log2asc", tolerance=2e-3, directions=False)
