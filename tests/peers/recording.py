"""Checks of `ferrodrive sim --record`: the MCAP reader that Foxglove's tools are made of takes the file, and finds in it
what canopen-python saw on the bus."""

import pathlib
import tempfile
import time

from ferrodrive import Simulator
from mcap.reader import NonSeekingReader, make_reader
from mcap_ros2.decoder import DecoderFactory

from checks import check, equal, near, true
from drive import ALL


@check("The mcap reader takes its record and finds signals with units, frames and events", *ALL)
def records(bench):
    node_id = bench.drive.node_id
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "run.mcap"
        extra = ("--record", str(path), "--record-period", "2ms")
        with Simulator([f"{bench.drive.model}@{node_id}"], extra=extra, path=bench.program) as simulator:
            # A drive takes a second or so to boot.
            while simulator.world("now")["t"] < 2.0:
                time.sleep(0.05)
            answer = simulator.world(f"{node_id} get")
            # From then on the shaft of a stepper without current turns, and feeds its supply.
            simulator.world(f"{node_id} load torque 0.1")
            simulator.quit()
        with open(path, "rb") as file:
            reader = make_reader(file, validate_crcs=True)
            summary = reader.get_summary()
            topics = {channel.topic: channel for channel in summary.channels.values()}
            counts = {topic: summary.statistics.channel_message_counts[it.id] for topic, it in topics.items()
                      if it.id in summary.statistics.channel_message_counts}
            factory = DecoderFactory()
            messages = [(channel.topic, message, factory.decoder_for("cdr", schema)(message.data))
                        for schema, channel, message in reader.iter_messages()]
            later = [message.log_time for _, _, message in reader.iter_messages(starting_at=1_500_000_000)]
            file.seek(0)
            # From its begin to its end, without the index, each check sum on the way.
            straight = NonSeekingReader(file, validate_crcs=True)
            equal(sum(1 for _ in straight.iter_messages()), len(messages), "messages without the index")
        equal({chunk.compression for chunk in summary.chunk_indexes}, {"zstd"}, "compression")
        equal(later, [message.log_time for _, message, _ in messages if message.log_time >= 1_500_000_000],
              "messages after 1.5 s, by the index")
        equal(sorted(topics), ["/can", "/events", f"/node/{node_id}"], "topics")
        schema = summary.schemas[topics[f"/node/{node_id}"].schema_id]
        true("float64 velocity_rpm  # r/min" in schema.data.decode().splitlines(), "unit of the speed")
        equal({channel.message_encoding for channel in topics.values()}, {"cdr"}, "encoding")
        samples = [(message.log_time, values) for topic, message, values in messages if topic.startswith("/node")]
        equal(len(samples), counts[f"/node/{node_id}"], "messages, as the summary counts them")
        equal({later[0] - earlier[0] for earlier, later in zip(samples, samples[1:])}, {2_000_000}, "period, in ns")
        before = [values for at, values in samples if at <= answer["t"] * 1e9]
        near(before[-1].supply_v, answer["supply_v"], 0.5, "the supply of the sample before `get`")
        frames = [(frame.id, bytes(frame.data[:frame.dlc])) for topic, _, frame in messages if topic == "/can"]
        true((0x700 + node_id, b"\0") in frames, "the boot-up is among the frames")
        said = [line.message for topic, _, line in messages if topic == "/events"]
        true(any(line.startswith("load torque 0.1") for line in said), f"the world command is among the events: {said}")
