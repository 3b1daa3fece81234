"""The master of this package, on a virtual bus and over a connection."""

import asyncio
import math
import subprocess
import sys
import threading
import time

import can
import ferrodrive
import pytest


@pytest.fixture
def world():
    world = ferrodrive.World()
    world.add("m4230e17b50", node=1)
    world.add("cia402", node=5)
    return world


def test_a_move_by_an_angle_turns_the_shaft_by_it(world):
    with ferrodrive.Network(world) as network:
        network.wait_for(5)
        drive = network.drive(5, "cia402")
        before = world[5].shaft_angle_rad
        report = drive.move(90, relative=True, speed_rpm=20)
        network.sleep(0.5)
        assert math.degrees(world[5].shaft_angle_rad - before) == pytest.approx(90, abs=0.5)
        # At 20 r/min a quarter turn takes 0.75 s, and the ramps more.
        assert 0.7 <= report["reached_after_s"] < 5
        state = drive.state()
        assert state["fault_code"] == 0 and state["angle_deg"] == pytest.approx(90, abs=0.5)


def test_behind_a_gear_an_angle_is_the_outputs(world):
    with ferrodrive.Network(world) as network:
        network.wait_for(5)
        before = world[5].shaft_angle_rad
        drive = network.drive(5, "cia402", gear_ratio=20)
        report = drive.move(18, relative=True, speed_rpm=2)
        network.sleep(0.5)
        assert math.degrees(world[5].shaft_angle_rad - before) == pytest.approx(360, abs=0.5)
        # A twentieth of a turn at 2 r/min takes 1.5 s.
        assert 1.4 <= report["reached_after_s"] < 6
        assert drive.state()["angle_deg"] == pytest.approx(18, abs=0.05)
        with pytest.raises(ValueError, match="gear ratio of -2"):
            network.drive(5, "cia402", gear_ratio=-2).stop()


def test_sdo_carries_bytes_and_refusals_say_why(world):
    with ferrodrive.Network(world) as network:
        network.wait_for(5)
        assert int.from_bytes(network.upload(5, 0x1000), "little") & 0xFFFF == 402
        network.download(5, 0x1017, 0, (250).to_bytes(2, "little"))
        assert network.upload(5, 0x1017) == b"\xfa\x00"
        with pytest.raises(ferrodrive.MasterError, match="5FFFh") as refusal:
            network.upload(5, 0x5FFF)
        # CiA 301, 7.2.4.3.17: object does not exist in the object dictionary.
        assert (refusal.value.abort_code, refusal.value.node, refusal.value.object) == (0x06020000, 5, (0x5FFF, 0))
        begin = world.now
        with pytest.raises(ferrodrive.MasterError, match="node 9 did not answer"):
            network.upload(9, 0x1000)
        assert world.now - begin == pytest.approx(0.5, abs=0.01)
        with pytest.raises(ferrodrive.MasterError, match="nothing was heard of node 9"):
            network.wait_for(9, within=0.1)
        assert network.seen() == [1, 5]


def test_closing_stops_what_was_moved(world):
    with ferrodrive.Network(world) as network:
        network.wait_for(5)
        network.drive(5, "cia402").velocity(300)
        assert world[5].velocity_rpm == pytest.approx(300, rel=0.05)
    world.run_for(2)
    assert abs(world[5].velocity_rpm) < 1


def test_several_drives_move_at_the_same_time(world):
    async def main():
        joint, servo = network.async_drive(1, "m4230e17b50"), network.async_drive(5, "cia402")
        await network.async_sleep(0.5)
        begin = time.monotonic()
        alone = (await joint.move(90, relative=True, speed_rpm=20))["reached_after_s"]
        middle = time.monotonic()
        await asyncio.gather(joint.move(90, relative=True, speed_rpm=20), servo.velocity(300), asyncio.sleep(0.1))
        return middle - begin, time.monotonic() - middle, alone

    with ferrodrive.virtual_time(world), ferrodrive.Network(world) as network:
        network.wait_for(1)
        first, second, alone = asyncio.run(main())
    assert alone <= first and second < first * 1.5


def test_a_loop_without_virtual_time_is_told_what_to_do(world):
    async def main():
        await network.async_drive(5, "cia402").enable()

    with ferrodrive.Network(world) as network, pytest.raises(RuntimeError, match="virtual_time"):
        asyncio.run(main())


def test_a_cancelled_coroutine_leaves_the_bus_usable(world):
    async def main():
        with pytest.raises(asyncio.TimeoutError):
            await asyncio.wait_for(network.async_upload(9, 0x1000), 0.1)
        return await network.async_upload(5, 0x1000)

    with ferrodrive.virtual_time(world), ferrodrive.Network(world) as network:
        network.wait_for(5)
        assert len(asyncio.run(main())) == 4


def test_master_and_python_can_share_a_bus_and_its_time(world):
    with can.Bus(interface="ferrodrive", channel=world) as bus:
        heard = []
        with can.Notifier(bus, [lambda message: heard.append(message.arbitration_id)]):
            with ferrodrive.Network(world) as network:
                network.wait_for(5)
                before = time.monotonic()
                network.sleep(0.25)
                assert time.monotonic() - before == pytest.approx(0.25)
                network.upload(5, 0x1000)
            time.sleep(0.01)
    assert {0x605, 0x585} <= set(heard)


def test_a_world_with_a_master_in_it_is_not_copied(world):
    with ferrodrive.Network(world), pytest.raises(RuntimeError, match="take the snapshot before"):
        world.snapshot()


def test_wrong_orders_say_what_would_be_right(world):
    with ferrodrive.Network(world) as network:
        drive = network.drive(5, "cia402")
        for order, error, words in (
            (lambda: drive.move(), ValueError, "degrees or in counts"),
            (lambda: drive.velocity(float("nan")), ValueError, "needs a number"),
            (lambda: drive.velocity(60, acceleration_rpm_s=float("nan")), ValueError, "acceleration_rpm_s is NaN"),
            (lambda: drive.velocity(60, deceleration_rpm_s=-600), ValueError, "deceleration_rpm_s is -600"),
            (lambda: drive.move(10, speed_rpm=-60), ValueError, "speed_rpm is -60: expected a finite number above 0"),
            (lambda: drive.home(35, speed_rpm=float("inf")), ValueError, "speed_rpm is inf"),
            (lambda: drive.home(1000), ValueError, "-128 to 127"),
            (lambda: network.nmt("halt"), ValueError, "pre-operational"),
            (lambda: network.drive(5, "zlac"), ValueError, "zlac8030l"),
            (lambda: network.upload(200, 0x1000), ValueError, "1 to 127"),
            (lambda: ferrodrive.Network("nonsense://x"), ValueError, "socketcand"),
            (lambda: ferrodrive.Network("socketcand://127.0.0.1:1/can0"), RuntimeError, "127.0.0.1:1"),
        ):
            with pytest.raises(error, match=words):
                order()


@pytest.fixture
def simulator():
    try:
        path = ferrodrive.simulator.program()
    except ferrodrive.SimulatorError as error:
        pytest.skip(str(error))
    with ferrodrive.Simulator(["cia402@5"], extra=["--timing", "ideal"], path=path) as simulator:
        yield simulator


def test_the_same_over_a_connection(simulator):
    bus = f"socketcand://127.0.0.1:{simulator.port()}/can0"
    with ferrodrive.Network(bus) as network:
        drive = network.drive(5, "cia402")
        drive.velocity(300)
        assert simulator.world("5 get")["velocity_rpm"] == pytest.approx(300, rel=0.1)
        # Other threads run while one waits.
        states = []
        threads = [threading.Thread(target=lambda: states.append(drive.state())) for _ in range(3)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert len(states) == 3

        async def main():
            return await asyncio.gather(*(network.async_upload(5, 0x1000) for _ in range(3)))

        assert len(asyncio.run(main())) == 3
    deadline = time.monotonic() + 20
    while abs(simulator.world("5 get")["velocity_rpm"]) > 1:
        assert time.monotonic() < deadline, "the end of the network did not stop the drive"
        time.sleep(0.05)
    with pytest.raises(RuntimeError, match="closed"):
        network.upload(5, 0x1000)


def test_a_connection_that_goes_and_comes_is_a_warning_and_the_cause_of_what_fails(simulator):
    port = simulator.port()
    with ferrodrive.Network(f"socketcand://127.0.0.1:{port}/can0") as network:
        assert len(network.upload(5, 0x1000)) == 4
        simulator.quit()
        with pytest.warns(ferrodrive.BusWarning, match="the connection to the bus is lost"):
            with pytest.raises(ferrodrive.MasterError, match="node 5.*the connection to the bus is lost"):
                for _ in range(100):
                    network.upload(5, 0x1000)
        again = ferrodrive.Simulator(
            ["cia402@5"], extra=["--timing", "ideal", "--serve", f"socketcand://127.0.0.1:{port}"], path=simulator.command_line[0]
        )
        with again, pytest.warns(ferrodrive.BusWarning, match="the connection to the bus is back"):
            deadline = time.monotonic() + 30
            while True:
                try:
                    assert len(network.upload(5, 0x1000)) == 4
                    break
                except ferrodrive.MasterError:
                    assert time.monotonic() < deadline, "the bus did not come back"


CAPTURES = """
import sys
import ferrodrive

with ferrodrive.Network(sys.argv[1]) as network:
    network.drive(5, "cia402").capture("velocity", duration=3600.0, period=0.01)
"""


def test_a_program_that_is_killed_while_it_captures_leaves_the_way_back(simulator, tmp_path):
    bus, journal = f"socketcand://127.0.0.1:{simulator.port()}/can0", tmp_path / "ferrodrive-node5.journal"
    with ferrodrive.Network(bus) as network:

        def tpdos():
            return [network.upload(5, index, sub) for at in range(4) for index, sub in ((0x1800 + at, 1), (0x1800 + at, 2), (0x1A00 + at, 0))]

        before = tpdos()
        # Nothing is read while it works: a node has one SDO channel, and two clients take each other's answers. Its first SYNC says
        # that its PDOs are mapped.
        with can.Bus(**simulator.can_arguments()) as listener:
            program = subprocess.Popen([sys.executable, "-c", CAPTURES, bus], cwd=tmp_path)
            try:
                while (frame := listener.recv(0.05)) is None or frame.arbitration_id != 0x80:
                    assert program.poll() is None, "it ended"
            finally:
                program.kill()
                program.wait()
        assert tpdos() != before
        assert journal.exists()
        network.params(5, "cia402").rollback(journal)
        assert tpdos() == before
        assert not journal.exists()


def test_a_simulator_that_ends_is_an_error_not_a_hang(simulator):
    with ferrodrive.Network(f"socketcand://127.0.0.1:{simulator.port()}/can0") as network:
        assert len(network.upload(5, 0x1000)) == 4
        simulator.kill()
        with pytest.raises((RuntimeError, ferrodrive.MasterError)):
            for _ in range(100):
                network.upload(5, 0x1000)
    with pytest.raises(ferrodrive.SimulatorError):
        simulator.world("now")


def test_a_drive_that_booted_long_ago_and_says_nothing_is_waited_for():
    world = ferrodrive.World()
    world.add("zlac8030l", node=4)
    world.run_for(5)
    with ferrodrive.Network(world) as network:
        network.wait_for(4, within=3)
        assert world.now < 5 + 2.1
        with pytest.raises(ferrodrive.NoAnswer):
            network.wait_for(9, within=2.5)
        assert 7.5 < world.now < 5 + 2.1 + 2.6
