"""Buses over UDP: python-can's `udp_multicast`, and a peer that speaks cannelloni.

Nothing leaves this machine: multicast goes out with no hop, cannelloni to 127.0.0.1.
"""

import contextlib
import json
import os
import socket
import struct
import subprocess
import time

import can
import canopen
import ears
from ferrodrive import Simulator

from checks import PATIENCE_S, Skip, check, equal, eventually, true
from drive import ZLAC8030L

GROUP = "239.74.163.2"

#: Data of every length, an identifier of 29 bits, remote frames.
MESSAGES = [can.Message(arbitration_id=0x100 + length, data=bytes(range(length)), is_extended_id=False) for length in range(9)]
MESSAGES += [
    can.Message(arbitration_id=0x1ABCDEF0, data=b"\xde\xad", is_extended_id=True),
    can.Message(arbitration_id=0x604, is_remote_frame=True, dlc=3, is_extended_id=False),
]


def free_port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def multicast(port):
    """python-can's bus, or why this machine has none."""
    try:
        return can.Bus(interface="udp_multicast", channel=GROUP, port=port, hop_limit=0)
    except (OSError, can.CanError) as error:
        raise Skip(f"no network of this machine takes a multicast group: {error}") from error


def text(message):
    """A message as candump writes it."""
    identifier = f"{message.arbitration_id:08X}" if message.is_extended_id else f"{message.arbitration_id:03X}"
    if message.is_remote_frame:
        return f"{identifier}#R{message.dlc}"
    return f"{identifier}#{message.data.hex().upper()}"


@check("canopen-python over udp_multicast reads, writes and restarts a drive that joined the group", ZLAC8030L)
def multicast_drive(bench):
    port = free_port()
    multicast(port).shutdown()
    place = f"udp_multicast://{GROUP}:{port}?hops=0"
    with Simulator(["zlac8030l@9"], extra=("--bus", place), path=bench.program) as simulator:
        simulator.wait_until_booted(PATIENCE_S)
        network = canopen.Network()
        network.NOTIFIER_CYCLE = 0.05
        network.connect(interface="udp_multicast", channel=GROUP, port=port, hop_limit=0)
        try:
            node = network.add_node(9, canopen.ObjectDictionary())
            node.sdo.RESPONSE_TIMEOUT = PATIENCE_S
            equal(node.sdo.upload(0x1000, 0), bench.drive.device_type.to_bytes(4, "little"), "1000h")
            node.sdo.download(0x6083, 0, struct.pack("<I", 250))
            equal(node.sdo.upload(0x6083, 0), struct.pack("<I", 250), "6083h after it was written")
            true(ears.boot_up_after_reset(node, PATIENCE_S), "boot-up after the reset")
        finally:
            network.disconnect()


@check("every kind of frame goes both ways between python-can's udp_multicast and a command", ZLAC8030L)
def multicast_frames(bench):
    port = free_port()
    place = f"udp_multicast://{GROUP}:{port}?hops=0"
    with multicast(port) as bus:
        dump = subprocess.Popen([bench.program, "--bus", place, "--json", "dump"], stdout=subprocess.PIPE, text=True)
        try:
            os.set_blocking(dump.stdout.fileno(), False)
            heard = ""

            def lines():
                nonlocal heard
                with contextlib.suppress(TypeError):
                    heard += dump.stdout.read() or ""
                complete = heard.rpartition("\n")[0]
                return [json.loads(line).get("frame") for line in complete.splitlines()]

            def begin():
                bus.send(can.Message(arbitration_id=0x7E5, is_extended_id=False))
                return lines()

            eventually(begin, bool, "dump listens")
            for message in MESSAGES:
                bus.send(message)
            expected = [text(message) for message in MESSAGES]
            others = lambda: [frame for frame in lines() if frame != "7E5#"]
            eventually(others, lambda frames: len(frames) >= len(expected), "all frames are shown")
            equal(others(), expected, "the frames as they were sent")
        finally:
            dump.kill()
            dump.wait()
            # Not communicate(): it takes a pipe that does not block for one that has ended.
            dump.stdout.close()
        # python-can hears what it sent itself, as its socket is one of those that joined the group.
        while bus.recv(0.2):
            pass
        for message in MESSAGES:
            subprocess.run([bench.program, "--bus", place, "send", text(message)], check=True, timeout=60, capture_output=True)
            received = bus.recv(PATIENCE_S)
            same = {"timestamp_delta": None, "check_channel": False, "check_direction": False}
            true(received is not None and received.equals(message, **same), f"{message} came as {received}")
        equal(bus.recv(0.2), None, "a further frame")


class Cannelloni:
    """The other end of a cannelloni, in the layout of its datagrams: version 2, operation code 0 (data), sequence
    number, count of frames (two bytes, the most significant first); then for each frame the identifier with the flags of
    `linux/can.h` (four bytes, the most significant first), the length, and the data, which a remote frame has none of."""

    EXTENDED, REMOTE = 0x80000000, 0x40000000

    def __init__(self, peer):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.settimeout(0.5)
        self.peer = ("127.0.0.1", peer)
        self.port = self.socket.getsockname()[1]
        self.sequence = 0

    def send(self, *messages):
        """All of them in one datagram."""
        body = b""
        for message in messages:
            flags = self.EXTENDED * message.is_extended_id | self.REMOTE * message.is_remote_frame
            body += struct.pack(">IB", message.arbitration_id | flags, message.dlc) + bytes(message.data)
        self.socket.sendto(struct.pack(">BBBH", 2, 0, self.sequence, len(messages)) + body, self.peer)
        self.sequence = (self.sequence + 1) & 0xFF

    def receive(self):
        """The frames of the next datagram, and its sequence number."""
        datagram = self.socket.recv(65536)
        version, operation, sequence, count = struct.unpack_from(">BBBH", datagram)
        equal((version, operation), (2, 0), "version and operation code")
        place, messages = 5, []
        for _ in range(count):
            word, length = struct.unpack_from(">IB", datagram, place)
            is_remote = bool(word & self.REMOTE)
            data = b"" if is_remote else datagram[place + 5 : place + 5 + length]
            place += 5 + len(data)
            messages.append(
                can.Message(
                    arbitration_id=word & 0x1FFFFFFF,
                    is_extended_id=bool(word & self.EXTENDED),
                    is_remote_frame=is_remote,
                    dlc=length,
                    data=None if is_remote else data,
                )
            )
        equal(place, len(datagram), "bytes of the datagram")
        return sequence, messages


@check("a peer that speaks cannelloni asks a drive several things in one datagram and gets every answer", ZLAC8030L)
def cannelloni_drive(bench):
    here = free_port()
    peer = Cannelloni(here)
    place = f"cannelloni://127.0.0.1:{peer.port}?local={here}"
    with Simulator(["zlac8030l@9"], extra=("--bus", place), path=bench.program) as simulator:
        simulator.wait_until_booted(PATIENCE_S)
        ask = lambda index: can.Message(arbitration_id=0x609, is_extended_id=False, data=struct.pack("<BHB4x", 0x40, index, 0))
        # A frame that the drive has no use for, two of the same node, one with an identifier of 29 bits.
        stranger = can.Message(arbitration_id=0x1ABCDEF0, data=b"\x01", is_extended_id=True)
        device_type = bench.drive.device_type.to_bytes(4, "little")
        answers, numbers, end = [], [], time.monotonic() + PATIENCE_S
        peer.send(stranger, ask(0x1000), stranger)
        while not answers and time.monotonic() < end:
            with contextlib.suppress(TimeoutError):
                number, messages = peer.receive()
                numbers.append(number)
                answers += [bytes(message.data) for message in messages if message.arbitration_id == 0x589]
        equal(answers, [b"\x43\x00\x10\x00" + device_type], "answers")
        peer.send(can.Message(arbitration_id=0x000, is_extended_id=False, data=[0x81, 9]))
        booted = False
        while not booted and time.monotonic() < end:
            with contextlib.suppress(TimeoutError):
                number, messages = peer.receive()
                numbers.append(number)
                booted = any(message.arbitration_id == 0x709 and message.data == b"\0" for message in messages)
        true(booted, "no boot-up after NMT reset node")
        equal(numbers, [(numbers[0] + place) & 0xFF for place in range(len(numbers))], "sequence numbers")
    peer.socket.close()
