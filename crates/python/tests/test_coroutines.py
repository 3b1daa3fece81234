"""Coroutines of what is opened and closed, and of parameters, on a virtual bus: they do what the calls that wait do, at the same time."""

import asyncio
import math
import pathlib

import ferrodrive
import pytest

EXAMPLES = pathlib.Path(__file__).resolve().parents[3] / "examples"
SERVO = {"mode": "csp", "velocity_rpm": 60, "acceleration_rpm_s": 300, "jerk_rpm_s2": 3000, "following_error_deg": 10}


def run(world, main):
    with ferrodrive.virtual_time(world), ferrodrive.Network(world) as network:
        return asyncio.run(main(network))


@pytest.fixture
def world():
    world = ferrodrive.World(bitrate=1_000_000)
    world.add("cia402", node=1)
    world.add("cia402", node=2)
    world.wait_until_booted()
    return world


def test_parameters_of_two_nodes_are_read_and_written_at_the_same_time(world, tmp_path):
    wanted = tmp_path / "wanted.toml"
    wanted.write_text('[values]\n"6081h:00" = 100\n', encoding="utf-8")
    journals = {node: tmp_path / f"{node}.journal" for node in (1, 2)}

    async def main(network):
        nodes = [network.async_params(node, "cia402") for node in (1, 2)]
        began = world.now
        await nodes[0].backup()
        alone = world.now - began
        began = world.now
        kept = await asyncio.gather(*(node.backup(tmp_path / f"{node.node}.toml") for node in nodes))
        # An SDO waits for its drive more than for the wire.
        assert world.now - began < 1.5 * alone
        assert [report["node"] for report in kept] == [1, 2] and kept[0]["values"] > 20
        with pytest.raises(FileExistsError):
            await nodes[0].backup(tmp_path / "1.toml")
        assert [step["object"] for step in (await nodes[0].plan(wanted))["steps"]] == ["6081h:00"]
        written = await asyncio.gather(*(node.apply(wanted, journal=journals[node.node]) for node in nodes))
        assert [report["writes"] for report in written] == [1, 1]
        assert (await nodes[1].verify(wanted))["ok"]
        assert [row["object"] for row in (await nodes[1].diff(tmp_path / "2.toml"))["differences"]] == ["6081h:00"]
        with pytest.raises(ferrodrive.MasterError) as raised:
            await nodes[0].rollback(journals[1])
        assert raised.value.kind == "no_journal"

    run(world, main)


def test_a_group_moves_while_the_loop_does_something_else(world, tmp_path):
    axes = [ferrodrive.Axis(node, "cia402", **SERVO) for node in (1, 2)]
    before = [world[node].shaft_angle_rad for node in (1, 2)]

    def turned():
        return [math.degrees(world[node].shaft_angle_rad - angle) for node, angle in zip((1, 2), before)]

    async def main(network):
        async with await network.async_group(axes, period=0.001) as group:
            move = asyncio.ensure_future(group.move([360, -90]))
            await network.async_sleep(0.6)
            assert not move.done() and 90 < turned()[0] < 300
            # 1 turn at 1 turn/s, 5 turns/s^2 and 50 turns/s^3: L/v + v/a + a/j.
            assert await move == pytest.approx(1.3, abs=1e-6)
            await network.async_sleep(0.2)
            assert turned() == pytest.approx([360, -90], abs=1)
            assert group.state()["phase"] == "holding"
            # A move that is given up comes to rest within its limits.
            move = asyncio.ensure_future(group.move([1440, -90]))
            await network.async_sleep(1)
            move.cancel()
            with pytest.raises(asyncio.CancelledError):
                await move
            await group.stop()
            at = turned()[0]
            await network.async_sleep(0.5)
            assert at < 1400 and turned()[0] == pytest.approx(at, abs=1)
            await group.follow([[axis["set_point_deg"] for axis in group.state()["axes"]]] * 20)
            path = tmp_path / "path.csv"
            path.write_text("t_s,1.angle_deg\n0,0\n0.5,-90\n1,-180\n")
            assert await group.follow_file(path, relative=True) == 1.0
            assert turned()[0] == pytest.approx(at - 180, abs=1)
        assert (await network.async_drive(1, "cia402").state())["power"] != "Operation enabled"

    run(world, main)


def test_a_base_drives_and_stands_after_its_block_and_half_a_base_is_refused():
    world = ferrodrive.World.machine(EXAMPLES / "base.toml")

    async def main(network):
        await network.async_boot()
        async with await network.async_base() as base:
            assert not (await base.drive(0.2, 0.0, seconds=1))["limited"]
            assert base.state()["x_m"] == pytest.approx(0.2, abs=0.06)
            assert not base.command(0.1, 0.0)["limited"]
            await network.async_sleep(0.2)
            await base.stop()
            await base.close()
        with pytest.raises(ValueError, match="a base has two wheels"):
            await network.async_base((4, "zlac8030l"))
        with pytest.raises(TypeError, match="which decides mode"):
            await network.async_base(mode="csv")

    run(world, main)


def test_a_network_is_watched_by_a_coroutine_beside_others(world):
    async def main(network):
        async with await network.async_supervise() as supervisor:
            assert supervisor.report["ok"]
            assert await supervisor.next(within=0.1) is None
            waiting = asyncio.ensure_future(supervisor.wait_for("boot_up", node=2, within=30))
            await network.async_sleep(0.1)
            world[2].power_cycle()
            assert (await waiting)["node"] == 2
            kinds = [event["kind"] async for event in supervisor.events(within=15)]
            assert "recovered" in kinds
            await supervisor.resume(2)
            with pytest.raises(TimeoutError, match="no event 'emcy' within"):
                await supervisor.wait_for("emcy", within=0.2)
        await supervisor.close()

    run(world, main)


def tpdos(network, node):
    """What is set up of a node's first TPDO, which a capture may change."""
    return [network.upload(node, 0x1800, sub) for sub in (1, 2)] + [network.upload(node, 0x1A00, sub) for sub in range(0, 3)]


def test_a_capture_that_is_given_up_puts_back_what_it_has_changed():
    world = ferrodrive.World()
    world.add("zlac8030l", node=4)
    world.wait_until_booted()
    with ferrodrive.Network(world) as network:
        before = tpdos(network, 4)
    changed = []

    async def main(network):
        drive = network.async_drive(4, "zlac8030l")
        capture = asyncio.ensure_future(drive.capture("velocity", duration=60.0))
        await asyncio.sleep(2)
        changed.append(await network.async_upload(4, 0x1A00, 0))
        capture.cancel()
        with pytest.raises(asyncio.CancelledError):
            await capture
        await asyncio.sleep(2)

    run(world, main)
    with ferrodrive.Network(world) as network:
        assert changed != [before[2]]
        assert tpdos(network, 4) == before


def test_a_network_that_is_closed_beside_a_capture_puts_back_what_it_has_changed():
    world = ferrodrive.World()
    world.add("zlac8030l", node=4)
    world.wait_until_booted()
    with ferrodrive.Network(world) as network:
        before = tpdos(network, 4)

    async def main():
        network = ferrodrive.Network(world)
        capture = asyncio.ensure_future(network.async_drive(4, "zlac8030l").capture("velocity", duration=60.0))
        await asyncio.sleep(2)
        capture.cancel()
        await asyncio.sleep(0)
        network.close()

    with ferrodrive.virtual_time(world):
        asyncio.run(main())
    with ferrodrive.Network(world) as network:
        assert tpdos(network, 4) == before


def test_a_capture_that_is_cut_off_reports_what_came_as_a_whole_one_does():
    world = ferrodrive.World()
    drive = world.add("zlac8030l", node=4)
    world.wait_until_booted()

    async def main(network):
        capture = asyncio.ensure_future(network.async_drive(4, "zlac8030l").capture("velocity", duration=60.0))
        await asyncio.sleep(2)
        drive.apply("power off")
        with pytest.raises(ferrodrive.MasterError) as caught:
            await capture
        return caught.value

    error = run(world, main)
    assert error.kind == "capture_cut_off"
    values = error.report["values"]["velocity_rpm"]
    assert len(values) == len(error.report["time_s"]) > 1000
    assert all(abs(value) < 1 for value in values)
    assert math.isclose(error.report["period_s"]["velocity_rpm"], 0.001, rel_tol=0.01)


def test_a_capture_whose_coroutine_is_closed_is_given_up_without_being_awaited(world):
    async def main(network):
        capture = network.async_drive(4, "zlac8030l").capture("velocity", duration=60.0)
        capture.send(None)
        capture.close()

    world.add("zlac8030l", node=4)
    world.wait_until_booted()
    run(world, main)


def test_an_rpdo_is_not_taken_for_a_capture(world):
    with ferrodrive.Network(world) as network, pytest.raises(ValueError, match="'rpdo1' is not a TPDO"):
        network.drive(1, "cia402").capture("velocity", take=["rpdo1"])
