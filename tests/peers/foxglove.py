"""Checks of `ferrodrive sim --foxglove`: a WebSocket client and a CDR reader of others take the channels, as a viewer would.

Messages by the protocol's own page ("Foxglove WebSocket Protocol Specification v1"): JSON texts, and data as binaries of the operation code
1, the subscription (32 bits), the time in ns (64 bits) and the message, lowest byte first."""

import json
import re
import struct

from bench import Bench
from checks import PATIENCE_S, Skip, check, equal, eventually, near, true
from drive import ZLAC8030L

MESSAGE_DATA = 1
R_MIN = 60
#: As many samples, each of 1 ms.
SAMPLES = 500


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


def place(live):
    """Where viewers connect, as the simulator says on standard error."""
    said = eventually(lambda: re.findall(r"ws://\S+", "\n".join(live.simulator.stderr())), bool, "the address for viewers")
    return said[0]


@check("a viewer made of websockets and mcap-ros2-support reads a drive that turns, live", ZLAC8030L)
def turning(bench):
    connect, decoder = of_others()
    node = bench.drive.node_id
    patient = {"open_timeout": PATIENCE_S, "ping_interval": None}
    with Bench(bench.program, bench.drive, extra=("--foxglove", "127.0.0.1:0")) as live:
        live.turn(R_MIN)
        # 606Ch was near for a moment; the ramp ends some 50 ms later.
        live.sleep(0.5)
        steady_ns = live.now() * 1e9
        with connect(place(live), subprotocols=["foxglove.sdk.v1"], max_size=None, proxy=None, **patient) as viewer:
            equal(viewer.subprotocol, "foxglove.sdk.v1", "subprotocol")
            equal(json.loads(viewer.recv(PATIENCE_S))["op"], "serverInfo", "the first message")
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
                        number, at = struct.unpack_from("<IQ", message, 1)
                        # The first batch has also what was sampled shortly before the subscription.
                        if at >= steady_ns:
                            raw[names[number]].append((at, message[13:]))

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
