"""Other people's clients, unchanged, over the interface for python-can."""

import io
import multiprocessing
import threading
import time

import can
import canopen
import ferrodrive
import pytest
from canopen.profiles.p402 import BaseNode402
from ferrodrive import turns
from ferrodrive.real_time import REAL


@pytest.fixture(autouse=True)
def nothing_is_left_open():
    """A test that fails must not hand its time on to the next."""
    yield
    if (left := turns.active()) is not None:
        turns.leave(left, for_good=True)


@pytest.fixture
def world():
    world = ferrodrive.World(bitrate=500_000, seed=1)
    world.add("cia402", node=5)
    return world


def connect(world, node_class=canopen.RemoteNode):
    sheet = io.StringIO(ferrodrive.eds("cia402"))
    sheet.name = "cia402.eds"
    network = canopen.Network()
    network.connect(interface="ferrodrive", channel=world)
    node = network.add_node(node_class(5, sheet))
    node.nmt.wait_for_bootup(10)
    return network, node


def test_frames_take_as_long_as_their_bits_on_the_wire():
    """ISO 11898-1, 8.4.2: 44 bits and 8 for each byte, without the interframe space; of 55h none is stuffed."""
    world = ferrodrive.World(bitrate=500_000)
    with can.Bus(interface="ferrodrive", channel=world) as one, can.Bus(interface="ferrodrive", channel=world) as other:
        time.sleep(0.001)  # both have seen the 11 recessive bits of an idle bus
        begin = world.now
        one.send(can.Message(arbitration_id=0x555, is_extended_id=False, data=[0x55] * 8))
        message = other.recv(1)
        assert (message.arbitration_id, bytes(message.data)) == (0x555, b"\x55" * 8)
        # 2 us a bit; at most 3 stuff bits in the checksum.
        assert 108 * 2e-6 - 1e-9 <= world.now - begin <= 111 * 2e-6 + 1e-9
        assert message.timestamp == pytest.approx(time.time(), abs=1e-6)
        assert one.recv(0) is None and other.recv(0.5) is None
        assert world.now == pytest.approx(begin + 0.5, abs=1e-3)


def test_an_sdo_read_is_answered_within_the_time_of_two_frames():
    world = ferrodrive.World(bitrate=500_000, timing="ideal")
    world.add("cia402", node=5)
    network, node = connect(world)
    before = world.now
    assert node.sdo[0x1000].raw & 0xFFFF == 402
    # CiA 301: request and answer of 8 bytes each, at most 135 bits with stuffing, 2 us a bit.
    assert world.now - before <= 2 * 135 * 2e-6
    with pytest.raises(canopen.SdoAbortedError, match="0x06020000"):
        node.sdo.upload(0x5FFF, 0)
    network.disconnect()


def test_a_silent_node_costs_virtual_time_alone(world):
    network, node = connect(world)
    world[5].power_cut()
    begin, real = world.now, REAL.monotonic()
    with pytest.raises(canopen.SdoCommunicationError):
        node.sdo[0x1000].raw
    # canopen-python waits RESPONSE_TIMEOUT, once and again.
    assert world.now - begin >= node.sdo.RESPONSE_TIMEOUT
    assert REAL.monotonic() - real < 60
    network.disconnect()


def test_heartbeats_come_and_are_missed(world):
    network, node = connect(world)
    node.sdo[0x1017].raw = 100
    node.nmt.state = "OPERATIONAL"
    # The first one was on its way when the command came.
    node.nmt.wait_for_heartbeat(1)
    assert node.nmt.wait_for_heartbeat(1) == "OPERATIONAL"
    before = node.nmt.timestamp
    node.nmt.wait_for_heartbeat(1)
    assert node.nmt.timestamp - before == pytest.approx(0.1, abs=1e-3)
    world[5].cut_cable()
    with pytest.raises(canopen.nmt.NmtError):
        node.nmt.wait_for_heartbeat(1)
    network.disconnect()


def test_sync_every_20_ms_is_every_20_ms(world):
    network, node = connect(world)
    at = []
    network.subscribe(0x80, lambda *_: None)
    listener = can.Bus(interface="ferrodrive", channel=world)
    network.sync.start(0.02)
    while len(at) < 50:
        message = listener.recv(1)
        if message.arbitration_id == 0x80:
            at.append(message.timestamp)
    network.sync.stop()
    apart = [later - earlier for earlier, later in zip(at, at[1:])]
    # The clock of python-can has a resolution of 0.24 us at this date.
    assert all(abs(gap - 0.02) < 1e-6 for gap in apart)
    listener.shutdown()
    network.disconnect()


def servo_run(seed=1):
    """canopen-python's CiA 402 client enables a servo and turns it by PDO. Returns the world's digest."""
    world = ferrodrive.World(bitrate=500_000, seed=seed)
    world.add("cia402", node=5)
    network, node = connect(world, BaseNode402)
    node.rpdo.read()
    node.tpdo.read()
    node.setup_402_state_machine(False)
    node.nmt.state = "OPERATIONAL"
    network.sync.start(0.01)
    node.op_mode = "PROFILED VELOCITY"
    node.state = "OPERATION ENABLED"
    node.sdo[0x60FF].raw = 100_000
    time.sleep(1)
    actual, true_rpm = node.sdo[0x606C].raw, world[5].velocity_rpm
    assert true_rpm > 0 and actual == pytest.approx(100_000, rel=0.05)
    node.state = "SWITCHED ON"
    network.sync.stop()
    network.disconnect()
    return world.digest()


def test_the_client_of_canopen_python_moves_a_servo():
    assert servo_run() == servo_run()


def burn(stop):
    while not stop.is_set():
        sum(range(10_000))


def test_runs_are_equal_while_the_machine_is_busy():
    quiet = servo_run()
    context = multiprocessing.get_context("spawn")
    stop = context.Event()
    busy = [context.Process(target=burn, args=(stop,)) for _ in range(3)]
    for process in busy:
        process.start()
    try:
        # Busy inside the process as well: a thread that takes no part wants the interpreter all the time.
        inside = threading.Thread(target=burn, args=(stop,))
        inside.start()
        assert [servo_run() for _ in range(5)] == [quiet] * 5
    finally:
        stop.set()
        inside.join()
        for process in busy:
            process.join()


def test_a_channel_is_named_or_made_of_drives():
    world = ferrodrive.World(channel="line 3")
    with can.Bus(interface="ferrodrive", channel="line 3") as bus:
        assert bus.world is world
    with can.Bus(interface="ferrodrive", channel="zlac8030l@4 m4230e17b50@1", bitrate=500_000) as bus:
        assert bus.world.nodes == [4, 1]
        assert {bus.recv(5).arbitration_id, bus.recv(5).arbitration_id} == {0x701, 0x704}
    for arguments, words in (
        ({"channel": "nowhere"}, "not a channel"),
        ({"channel": world, "bitrate": 250_000}, "500000 bit/s, not 250000"),
        ({"channel": world, "fd": True}, "CAN FD"),
        ({"channel": world, "receive_own_messages": True}, "echo"),
    ):
        with pytest.raises(can.CanInitializationError, match=words):
            can.Bus(interface="ferrodrive", **arguments)
    assert time.sleep is REAL.sleep


def test_a_bus_that_is_shut_down_says_so(world):
    bus = can.Bus(interface="ferrodrive", channel=world)
    bus.shutdown()
    bus.shutdown()
    for use in (lambda: bus.send(can.Message(arbitration_id=1)), lambda: bus.recv(0)):
        with pytest.raises(can.CanOperationError, match="shut down"):
            use()


def test_more_than_the_adapter_holds_is_an_error_not_memory(world):
    with can.Bus(interface="ferrodrive", channel=world) as bus:
        with pytest.raises(can.CanOperationError, match="too many frames"):
            for _ in range(100_000):
                bus.send(can.Message(arbitration_id=0x7FF, is_extended_id=False))


def test_listeners_of_other_kinds_hear_too(world):
    with can.Bus(interface="ferrodrive", channel=world) as bus:
        reader, errors = can.BufferedReader(), []
        with can.Notifier(bus, [reader]):
            assert reader.get_message(5).arbitration_id == 0x705
            assert reader.get_message(0.5) is None
        assert errors == []


def test_a_callback_that_raises_ends_its_notifier_and_not_the_world(world):
    def raises(_):
        raise KeyError("mine")

    class Handled(can.Listener):
        error = None

        def on_message_received(self, _):
            raise KeyError("mine")

        def on_error(self, error):
            self.error = error

    with can.Bus(interface="ferrodrive", channel=world) as bus:
        handled = Handled()
        with can.Notifier(bus, [handled]) as notifier:
            time.sleep(2)
            assert isinstance(notifier.exception, KeyError) and isinstance(handled.error, KeyError)
        time.sleep(1)
        assert world.now >= 3


def test_a_paced_bus_follows_the_clock():
    world = ferrodrive.World(timing="ideal")
    world.add("cia402", node=5)
    begin = time.monotonic()
    with can.Bus(interface="ferrodrive", channel=world, pace=50.0) as bus:
        assert bus.recv(10).arbitration_id == 0x705
        assert bus.recv(0.2) is None
        took_s = time.monotonic() - begin
        assert world.now <= took_s * 50 + 1e-3
        assert world.now >= 0.2 * 50
    with pytest.raises(ValueError, match="not a pace"):
        can.Bus(interface="ferrodrive", channel=ferrodrive.World(), pace=0)
