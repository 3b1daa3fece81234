"""Checks of `ferrodrive sim --foxglove`: a WebSocket client and a CDR reader of others take the channels, as a viewer would.

Messages by the protocol's own page ("Foxglove WebSocket Protocol Specification v1"): JSON texts, and data as binaries of the operation code
1, the subscription (32 bits), the time in ns (64 bits) and the message, lowest byte first."""

import base64
import contextlib
import fcntl
import json
import os
import pathlib
import pty
import re
import shutil
import socket
import struct
import subprocess
import tempfile
import termios
import threading
import time

import can

from bench import Bench
from checks import PATIENCE_S, Skip, check, equal, eventually, near, table, true
from drive import ZLAC8030L

MESSAGE_DATA = 1
R_MIN = 60
#: As many samples, each of 1 ms.
SAMPLES = 500
#: The class by which Foxglove Studio and Lichtblick connect, and the sockets that it takes.
CLIENT = ("@foxglove/ws-protocol@0.8.0", "ws@8.18.3")


def of_others():
    """What connects, and what reads a schema and decodes messages by it."""
    try:
        from mcap.records import Schema
        from mcap_ros2.decoder import DecoderFactory
        from websockets.sync.client import connect
    except ImportError as error:
        raise Skip(f"{error.name} is not installed: pip install -r tests/peers/requirements.txt") from error

    def decoder(channel):
        schema = Schema(id=1, name=channel["schemaName"], encoding=channel["schemaEncoding"], data=channel["schema"].encode())
        return DecoderFactory().decoder_for(channel["encoding"], schema)

    return connect, decoder


def place(stderr):
    """Where viewers connect, as a program says on standard error, which a function gives."""
    return eventually(lambda: re.findall(r"ws://[\d.:]+", stderr()), bool, "the address for viewers")[0]


def place_of(live):
    return place(lambda: "\n".join(live.simulator.stderr()))


@contextlib.contextmanager
def viewing(connect, address, **options):
    """A connection, and the operation of the first message."""
    options |= {"open_timeout": PATIENCE_S, "ping_interval": None, "max_size": None, "proxy": None}
    with connect(address, subprotocols=["foxglove.sdk.v1"], **options) as viewer:
        equal(json.loads(viewer.recv(PATIENCE_S))["op"], "serverInfo", "the first message")
        yield viewer


def sample(message):
    """Subscription, time in ns and data of a message."""
    return *struct.unpack_from("<IQ", message, 1), message[13:]


def until_each(viewer, wanted, counts=lambda channel, data: True):
    """Subscribes to what is advertised, when it is, until a message of each of the topics has come that counts: the channel and its data."""
    channels, seen = {}, {}
    end = time.monotonic() + PATIENCE_S
    while not set(wanted) <= set(seen):
        true(time.monotonic() < end, f"a message of each of {wanted}, and not of {sorted(seen)} alone")
        message = viewer.recv(PATIENCE_S)
        if isinstance(message, bytes):
            if message[0] == MESSAGE_DATA:
                number, _, data = sample(message)
                if counts(channels[number], data):
                    seen[channels[number]["topic"]] = (channels[number], data)
        elif (said := json.loads(message))["op"] == "advertise":
            new = {channel["id"]: channel for channel in said["channels"]}
            channels |= new
            viewer.send(json.dumps({"op": "subscribe", "subscriptions": [{"id": it, "channelId": it} for it in new]}))
    return seen


@contextlib.contextmanager
def in_a_terminal(words):
    """Runs a program in a terminal of 80 columns and 24 lines; gives what it has said on standard error and in the terminal, as functions."""
    with tempfile.TemporaryDirectory() as folder:
        said = pathlib.Path(folder) / "stderr"
        ours, theirs = pty.openpty()
        fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 80, 0, 0))
        environment = os.environ | {"TERM": "xterm", "XDG_CACHE_HOME": folder}
        with open(said, "wb") as file:
            child = subprocess.Popen([os.path.abspath(words[0]), *words[1:]], stdin=theirs, stdout=theirs, stderr=file, env=environment, cwd=folder)
        os.close(theirs)

        shown = bytearray()

        def drain():
            with contextlib.suppress(OSError):
                while data := os.read(ours, 4096):
                    shown.extend(data)

        reader = threading.Thread(target=drain)
        reader.start()
        try:
            yield said.read_text, lambda: shown.decode(errors="replace")
        finally:
            child.terminate()
            child.wait()
            reader.join()
            os.close(ours)


@check("a viewer made of websockets and mcap-ros2-support reads a drive that turns, live", ZLAC8030L)
def turning(bench):
    connect, decoder = of_others()
    node = bench.drive.node_id
    with Bench(bench.program, bench.drive, extra=("--foxglove", "127.0.0.1:0")) as live:
        live.turn(R_MIN)
        # 606Ch was near for a moment; the ramp ends some 50 ms later.
        live.sleep(0.5)
        steady_ns = live.now() * 1e9
        with viewing(connect, place_of(live)) as viewer:
            equal(viewer.subprotocol, "foxglove.sdk.v1", "subprotocol")
            advertised = json.loads(viewer.recv(PATIENCE_S))
            equal(advertised["op"], "advertise", "the second message")
            channels = {channel["topic"]: channel for channel in advertised["channels"]}
            equal(sorted(channels), ["/can", "/events", f"/node/{node}"], "topics")
            equal({channel["encoding"] for channel in channels.values()}, {"cdr"}, "encoding")
            equal({channel["schemaEncoding"] for channel in channels.values()}, {"ros2msg"}, "encoding of schemas")
            equal(channels["/can"]["schemaName"], "can_msgs/msg/Frame", "schema of frames")
            lines = channels[f"/node/{node}"]["schema"].splitlines()
            true("float64 velocity_rpm  # r/min" in lines, "unit of the speed in the schema")

            names = dict(enumerate(channels, 10))
            wanted = [{"id": number, "channelId": channels[topic]["id"]} for number, topic in names.items()]
            viewer.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))
            raw = {topic: [] for topic in channels}

            def until(topic, count):
                while len(raw[topic]) < count:
                    message = viewer.recv(PATIENCE_S)
                    if isinstance(message, bytes) and message[0] == MESSAGE_DATA:
                        number, at, data = sample(message)
                        # The first batch has also what was sampled shortly before the subscription.
                        if at >= steady_ns:
                            raw[names[number]].append((at, data))

            until(f"/node/{node}", 1)
            # Counted after the subscription: the upload is among the frames.
            speed = live.read(0x606C) / bench.drive.per_rpm
            until(f"/node/{node}", SAMPLES)
    # Decoded when all is there: a viewer that reads too slowly loses samples.
    decoders = {topic: decoder(channel) for topic, channel in channels.items()}
    seen = {topic: [(at, decoders[topic](data)) for at, data in messages] for topic, messages in raw.items()}
    samples = seen[f"/node/{node}"]
    equal({later[0] - earlier[0] for earlier, later in zip(samples, samples[1:])}, {1_000_000}, "time between samples, in ns")
    for at, values in samples:
        near(values.velocity_rpm, R_MIN, 3, f"speed at {at} ns")
        near(values.velocity_rpm, speed, 3, f"speed at {at} ns beside 606Ch")
    frames = [(frame.id, bytes(frame.data[:frame.dlc])) for _, frame in seen["/can"]]
    true((0x600 + node, bytes([0x40, 0x6C, 0x60, 0, 0, 0, 0, 0])) in frames, "the request for 606Ch is among the frames")
    true(any(identifier == 0x580 + node for identifier, _ in frames), "and its answer")


@check("viewers of {command} see the drive that turns, and frames", ZLAC8030L, rows=table(
    "command words field",
    ("record", ("record", "4", "606C", "-o", "run.csv"), "velocity_actual_value_rpm"),
    ("studio", ("studio", "--listen", "127.0.0.1:0"), "velocity_rpm"),
    ("top", ("top",), "velocity_rpm"),
))
def watched(bench, row):
    connect, decoder = of_others()
    bench.turn(R_MIN)
    # 606Ch was near for a moment; the ramp ends some 50 ms later.
    bench.sleep(0.5)
    bus = f"socketcand://127.0.0.1:{bench.simulator.port()}"
    # From here on it is the command that asks the drive.
    words = (bench.program, "--bus", bus, "--model", "4=zlac8030l", *row["words"], "--foxglove", "127.0.0.1:0")
    with in_a_terminal(words) as (stderr, _), viewing(connect, place(stderr)) as viewer:
        seen = until_each(viewer, ("/node/4", "/can"))
    values, frame = (decoder(channel)(data) for channel, data in (seen["/node/4"], seen["/can"]))
    near(getattr(values, row["field"]), R_MIN, 3, f"speed, {row['field']}")
    true(frame.id & 0x7F == 4, f"a frame of node 4: {frame.id:03X}h")


SERVED = """
limit = "60min"
machine = { drive = [{ model = "zlac8030l", node = 4, heartbeat = "100ms" }] }
[[expect]]
that = "4 velocity > 5"
"""


@check("viewers of run --serve see its drive and its frames", ZLAC8030L)
def served(bench):
    connect, decoder = of_others()
    with tempfile.TemporaryDirectory() as folder:
        (path := pathlib.Path(folder) / "served.toml").write_text(SERVED)
        words = (bench.program, "run", str(path), "--serve", "socketcand://127.0.0.1:0", "--foxglove", "127.0.0.1:0")
        with in_a_terminal(words) as (stderr, terminal), viewing(connect, place(stderr)) as viewer:
            # Its time begins when a host is on its bus.
            ready = eventually(lambda: re.findall(r"ready socketcand://127.0.0.1:(\d+)", terminal()), bool, "the bus")
            # Again and again: the viewer may have subscribed to nothing yet when the first ones pass.
            asks = can.Message(arbitration_id=0x604, data=[0x40, 0, 0x10, 0, 0, 0, 0, 0], is_extended_id=False)
            with can.Bus(interface="socketcand", host="127.0.0.1", port=int(ready[0]), channel="can0") as host:
                host.send_periodic(asks, 0.1)
                seen = until_each(viewer, ("/node/4", "/can"), lambda channel, data: channel["topic"] != "/can" or decoder(channel)(data).id == 0x584)
    values, frame = (decoder(channel)(data) for channel, data in (seen["/node/4"], seen["/can"]))
    near(values.supply_v, 48, 1, "supply")
    # The device type, by its number of the profile (CiA 402-1).
    equal(bytes(frame.data[:6]), bytes([0x43, 0, 0x10, 0, 0x92, 0x01]), "answer to the upload of 1000h")


@check("the client of Foxglove Studio and Lichtblick reads a drive that turns", ZLAC8030L)
def of_studio(bench):
    _, decoder = of_others()
    modules = client_modules()
    node = bench.drive.node_id
    with Bench(bench.program, bench.drive, extra=("--foxglove", "127.0.0.1:0")) as live:
        live.turn(R_MIN)
        live.sleep(0.5)
        program = pathlib.Path(__file__).with_name("foxglove_client.cjs")
        words = ("node", str(program), place_of(live), "50", f"/node/{node}")
        done = subprocess.run(words, env=os.environ | {"NODE_PATH": str(modules)}, capture_output=True, text=True, timeout=PATIENCE_S)
        equal((done.returncode, done.stderr), (0, ""), "what the client says")
    channels = {channel["topic"]: channel for channel in json.loads(done.stdout)}
    equal(sorted(channels), ["/can", "/events", f"/node/{node}"], "topics")
    decode = decoder(channels[f"/node/{node}"])
    for message in channels[f"/node/{node}"]["messages"]:
        near(decode(base64.b64decode(message["data"])).velocity_rpm, R_MIN, 3, f"speed at {message['at']} ns")


def client_modules():
    """The folder of the client, installed now if need be."""
    if not shutil.which("npm"):
        raise Skip("npm is missing: apt install npm")
    folder = pathlib.Path(__file__).resolve().parents[2] / "target" / "npm" / "foxglove"
    folder.mkdir(parents=True, exist_ok=True)
    stamp = folder / "installed.txt"
    with open(folder / "lock", "w", encoding="ascii") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not stamp.exists() or stamp.read_text(encoding="ascii") != " ".join(CLIENT):
            words = ("npm", "install", "--no-save", "--no-audit", "--no-fund", "--prefix", str(folder), *CLIENT)
            done = subprocess.run(words, capture_output=True, text=True, timeout=PATIENCE_S)
            if done.returncode != 0:
                raise Skip(f"npm could not install {' '.join(CLIENT)} (no network?): {done.stderr.strip().splitlines()[-1:]}")
            stamp.write_text(" ".join(CLIENT), encoding="ascii")
    return folder / "node_modules"


#: Between two samples of a drive that are shown, so that a viewer that reads nothing soon has more than 2 MiB to read.
FAST_NS = 200_000


@check("a viewer that reads nothing does not hold the bus, and learns the number of the samples that it missed", ZLAC8030L)
def stalled(bench):
    connect, _ = of_others()
    node = bench.drive.node_id
    with Bench(bench.program, bench.drive, extra=("--foxglove", "127.0.0.1:0", "--record-period", f"{FAST_NS // 1000}us")) as live:
        host, port = place_of(live).removeprefix("ws://").split(":")
        narrow = socket.socket()
        narrow.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        narrow.connect((host, int(port)))
        # The library reads ahead by a message or two, and no further.
        with viewing(connect, f"ws://{host}:{port}", sock=narrow, max_queue=1) as viewer:
            advertised = json.loads(viewer.recv(PATIENCE_S))["channels"]
            number = next(channel["id"] for channel in advertised if channel["topic"] == f"/node/{node}")
            viewer.send(json.dumps({"op": "subscribe", "subscriptions": [{"id": 1, "channelId": number}]}))
            times, reported, is_behind = [], 0, False

            def read():
                nonlocal reported, is_behind
                message = viewer.recv(PATIENCE_S)
                if isinstance(message, bytes):
                    if message[0] == MESSAGE_DATA:
                        times.append(sample(message)[1])
                elif found := re.match(r"(\d+) (\w+).* were left out", json.loads(message).get("message", "")):
                    reported += int(found[1])
                    is_behind |= found[2] != "messages"

            while not times:
                read()
            # It reads nothing for four seconds of the bus and more, and the drive answers all the same: a bus that is held answers nothing.
            begin, answers = live.now(), 0
            while answers < 100 or live.now() < begin + 4:
                equal(live.read(0x1000), live.drive.device_type, "1000h, while a viewer reads nothing")
                answers += 1

            def missed():
                return sum((later - earlier) // FAST_NS - 1 for earlier, later in zip(times, times[1:]))

            # Where the server's own thread had no time, it counts frames and events too.
            while not (reported > 0 and (reported == missed() or is_behind and reported > missed() > 0)):
                for _ in range(1000):
                    read()
