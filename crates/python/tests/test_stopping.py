"""Whatever a program forgets, or however it ends: what it has set in motion stops, and the bus is silent after it."""

import asyncio
import math
import pathlib
import subprocess
import sys
import tempfile

import ferrodrive
import pytest

pytest_plugins = ["pytester"]

#: The tests of the master have them all; these are a servo that holds an RPDO back, and a joint that does not.
MODELS = ["zlac8030l", "m4230e17b50"]

#: How long a stop may take: 300 ms of the master's watch over its program, and the drives' own ramps.
SECONDS = 1.5


def velocity(network, model):
    drive = network.drive(1, model)
    drive.velocity(60, wait=False)
    return drive


def opened_group(network, model):
    mode = "ip" if model.startswith("m") else "pv"
    axes = [ferrodrive.Axis(node, model, mode=mode, velocity_rpm=60, acceleration_rpm_s=300) for node in (1, 2)]
    return network.group(axes, period=0.01)


def group(network, model):
    opened = opened_group(network, model)
    # Nothing waits for this.
    opened.moving = opened._native.move_to([36000, 36000], None)
    return opened


def recorded_path(network, model):
    opened = opened_group(network, model)
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "path.csv"
        # A minute back and forth each 4 s, at most 45 r/min and 71 (r/min)/s.
        rows = [(time, 172 * (1 - math.cos(math.tau * time / 4))) for time in (row / 20 for row in range(1201))]
        path.write_text("t_s,1.angle_deg,2.angle_deg\n" + "".join(f"{time},{angle},{angle}\n" for time, angle in rows))
        opened.moving = opened._native.follow_file(str(path), False, True)
    return opened


def base(network, model):
    limits = {"linear_m_s": 0.8, "angular_rad_s": 2, "wheel_m_s": 0.8, "wheel_m_s2": 2}
    opened = network.base(
        (1, model), (2, model), wheel_base_m=0.4, wheel_radius_m=0.1, mode="pv", watchdog=5.0, **limits
    )
    opened.command(0.5, 0)
    return opened


def fastest(world):
    """Within 10 ms: a joint that interpolates may rest between two points."""
    most = 0.0
    for _ in range(10):
        most = max(most, *(abs(world[node].velocity_rpm) for node in (1, 2)))
        world.run_for(0.001)
    return most


def assert_stands(world):
    """It stands in time, and stays so."""
    world.run_for(SECONDS)
    for _ in range(2):
        world.run_for(0.7)
        assert fastest(world) < 1.0


@pytest.fixture(params=MODELS)
def model(request):
    return request.param


@pytest.fixture
def world(model):
    world = ferrodrive.World(bitrate=1_000_000)
    for node in (1, 2):
        world.add(model, node=node)
    world.run_for(1.5)
    return world


def begin(motion, network, world, model):
    try:
        opened = motion(network, model)
    except ferrodrive.MasterError as error:
        # A drive that takes no speeds, or does not show where it is, is not a wheel.
        if motion is not base or "cannot be a wheel" not in str(error):
            raise
        pytest.skip(f"{model} is not a wheel: {error}")
    network.sleep(0.5)
    assert fastest(world) > 20.0
    return opened


@pytest.mark.parametrize("motion", [velocity, group, recorded_path, base])
@pytest.mark.parametrize("error", [None, KeyboardInterrupt])
def test_a_network_that_is_left_stops_what_it_moved_and_is_silent(world, model, motion, error):
    opened = None
    try:
        with ferrodrive.Network(world) as network:
            opened = begin(motion, network, world, model)
            if error is not None:
                raise error("the program has a fault")
    except KeyboardInterrupt:
        pass
    # It was seen to stand before it was left.
    assert fastest(world) < 2.0
    probe = world.add_probe()
    assert_stands(world)
    heard = iter(lambda: world.poll(probe), None)
    # NMT, SYNC, RPDOs and SDO requests are a master's, and the heartbeat of node 127 is this one's.
    identifiers = {message[0] for _, message in heard}
    assert not {i for i in identifiers if i in (0, 0x80, 0x77F) or i & 0x780 in (0x200, 0x300, 0x400, 0x500, 0x600)}
    if motion is not velocity:
        opened.close()
    with pytest.raises(RuntimeError, match="the network is closed"):
        network.drive(1, model).enable()


@pytest.mark.parametrize("motion", [group, base])
def test_a_group_or_base_that_nobody_holds_any_more_stops(world, model, motion):
    with ferrodrive.Network(world) as network:
        opened = begin(motion, network, world, model)
        del opened
        assert_stands(world)


@pytest.mark.parametrize("motion", [velocity, group, recorded_path, base])
def test_a_network_that_nobody_holds_any_more_stops_what_it_moved(world, model, motion):
    network = ferrodrive.Network(world)
    opened = begin(motion, network, world, model)
    del opened, network
    assert_stands(world)


@pytest.mark.parametrize("error", [None, KeyboardInterrupt, asyncio.CancelledError])
def test_a_drive_of_coroutines_stops_with_its_network(world, model, error):
    async def main():
        await network.async_drive(1, model).velocity(60, wait=False)
        await network.async_sleep(0.5)
        assert abs(world[1].velocity_rpm) > 20.0
        if error is not None:
            raise error("the program has a fault")

    try:
        with ferrodrive.virtual_time(world), ferrodrive.Network(world) as network:
            asyncio.run(main())
    except (KeyboardInterrupt, asyncio.CancelledError):
        pass
    assert fastest(world) < 2.0
    assert_stands(world)


def test_a_coroutine_that_is_cancelled_on_the_way_leaves_nothing_turning_behind_its_network(world, model):
    async def main():
        drive = network.async_drive(1, model)
        with pytest.raises(asyncio.TimeoutError):
            await asyncio.wait_for(drive.move(360_000, relative=True, speed_rpm=60), 0.5)

    with ferrodrive.virtual_time(world), ferrodrive.Network(world) as network:
        asyncio.run(main())
    assert fastest(world) < 2.0
    assert_stands(world)


#: Ends with a drive that turns, and that no watch of its own stops; the network is not closed.
PROGRAM = """
import sys, ferrodrive
network = ferrodrive.Network(sys.argv[1])
drive = network.drive(5, "cia402")
drive.velocity(300)
print(drive.state()["velocity_rpm"], flush=True)
"""


@pytest.mark.parametrize("end", ["", "sys.exit(3)", "raise RuntimeError('a fault')", "raise KeyboardInterrupt"])
def test_the_end_of_the_interpreter_stops_what_it_moved(end):
    try:
        path = ferrodrive.simulator.program()
    except ferrodrive.SimulatorError as error:
        pytest.skip(str(error))
    with ferrodrive.Simulator(["cia402@5"], extra=["--timing", "ideal"], path=path) as simulator:
        bus = f"socketcand://127.0.0.1:{simulator.port()}/can0"
        ended = subprocess.run([sys.executable, "-c", PROGRAM + end, bus], capture_output=True, text=True)
        assert float(ended.stdout) == pytest.approx(300, rel=0.1), ended.stderr
        # It was seen to stand before the program ended.
        assert abs(simulator.world("5 get")["velocity_rpm"]) < 2.0


SUITE = """
    import sys, ferrodrive, pytest

    @pytest.fixture
    def network(ferrodrive_world):
        sys.kept = ferrodrive_world
        ferrodrive_world.wait_until_booted()
        with ferrodrive.Network(ferrodrive_world) as network:
            yield network

    @pytest.mark.ferrodrive(drives=["zlac8030l@1", "m4230e17b50@2"])
    def test_it(network):
        network.wait_for(1)
        for node, model in ((1, "zlac8030l"), (2, "m4230e17b50")):
            network.drive(node, model).velocity(60, wait=False)
        network.sleep(0.5)
        print([sys.kept[node].velocity_rpm for node in (1, 2)])
        assert all(abs(sys.kept[node].velocity_rpm) > 20 for node in (1, 2))
        raise KeyboardInterrupt
"""

#: What the suite's world does once the run was interrupted.
AFTER = """
import sys, pytest
status = pytest.main(["-p", "no:cacheprovider", *sys.argv[1:]])
sys.kept.run_for(1.0)
print("after", int(status), *(round(sys.kept[node].velocity_rpm, 1) for node in (1, 2)))
"""


def test_an_interrupted_run_of_pytest_stops_what_its_fixtures_moved(pytester):
    path = pytester.makepyfile(SUITE)
    result = pytester.run(sys.executable, "-c", AFTER, path)
    # 2: the run was interrupted, by the test and not by an assertion.
    (after,) = (line.split() for line in result.outlines if line.startswith("after"))
    assert after[1] == "2"
    assert all(abs(float(speed)) < 1.0 for speed in after[2:])


def speed_of(world):
    """Now: a world that is run by hand keeps what is moved in cycles waiting."""
    return max(abs(world[node].velocity_rpm) for node in (1, 2))


class OpenedWheels:
    """A base of two hub motors that drives."""

    def __init__(self, **options):
        self.world = ferrodrive.World()
        for node in (1, 2):
            self.world.add("zlac8030l", node=node)
        self.network = ferrodrive.Network(self.world)
        self.network.sleep(1)
        limits = {"linear_m_s": 0.8, "angular_rad_s": 2, "wheel_m_s": 0.8, "wheel_m_s2": 2}
        sides = (1, "zlac8030l"), (2, "zlac8030l")
        # Neither the watchdog nor the lag is what stops it.
        self.base = self.network.base(
            *sides, wheel_base_m=0.4, wheel_radius_m=0.1, watchdog=60.0, lag_m=1000.0, **limits, **options
        )


class OpenedAxes:
    """A group of two axes that moves."""

    def __init__(self, following_error_deg=72.0):
        self.world = ferrodrive.World(bitrate=1_000_000)
        for node in (1, 2):
            self.world.add("cia402", node=node)
        self.network = ferrodrive.Network(self.world)
        self.network.sleep(1)
        limits = {"velocity_rpm": 60, "acceleration_rpm_s": 300, "following_error_deg": following_error_deg}
        axes = [ferrodrive.Axis(node, "cia402", mode="csp", **limits) for node in (1, 2)]
        self.group = self.network.group(axes, period=0.002)


def test_a_stop_of_a_base_ends_when_its_wheels_were_seen_to_stand():
    wheels = OpenedWheels()
    with wheels.network, wheels.base as base:
        for end in (lambda: base.drive(0.5, 0.0, 1.0), lambda: (base.command(0.5, 0.0), wheels.network.sleep(1), base.stop())):
            end()
            assert speed_of(wheels.world) < 1.0


@pytest.mark.parametrize("end", ["stop", "drive"])
def test_a_wheel_that_its_load_takes_away_is_named_once_both_stand(end):
    wheels = OpenedWheels()
    base = wheels.base
    base.command(0.3, 0.0)
    wheels.network.sleep(0.5)
    # More than the motor has: the drive goes to fault, and its brake stops the wheel.
    wheels.world.apply("1 load torque 60")
    with pytest.raises(ferrodrive.MasterError, match="node 1.*at fault") as raised:
        base.stop() if end == "stop" else base.drive(0.3, 0.0, 0.2)
    assert raised.value.kind == "base"
    assert speed_of(wheels.world) < 1.0
    # It is still there, to be asked and closed.
    assert base.state()["linear_m_s"] == 0.0
    base.close()
    wheels.network.close()
    assert speed_of(wheels.world) < 1.0


class Interrupts:
    """Raises KeyboardInterrupt in the calls that wait, as Ctrl-C does, once so much time has passed in the world."""

    def __init__(self, monkeypatch, world, after):
        end, move = world.now + after, ferrodrive.Network._move_world

        def interrupted(world, job):
            while not job.ended:
                if world.now >= end:
                    monkeypatch.setattr(ferrodrive.Network, "_move_world", staticmethod(move))
                    raise KeyboardInterrupt
                world.advance(world.now_ns + 1_000_000, [])

        monkeypatch.setattr(ferrodrive.Network, "_move_world", staticmethod(interrupted))


@pytest.mark.parametrize("after", [0.5, 1.1, 1.3])
def test_an_interrupted_drive_of_a_base_comes_to_rest_and_the_base_is_still_there(monkeypatch, after):
    wheels = OpenedWheels()
    with wheels.network:
        Interrupts(monkeypatch, wheels.world, after)
        with pytest.raises(KeyboardInterrupt):
            wheels.base.drive(0.5, 0.0, 1.0)
        wheels.network.sleep(1.0)
        assert speed_of(wheels.world) < 1.0
        # It goes on by the next command.
        wheels.base.drive(0.2, 0.0, 0.5)
        wheels.base.close()


@pytest.mark.parametrize("after", [0.1, 0.4])
def test_an_interrupted_close_goes_on_and_the_next_one_waits_for_it(monkeypatch, after):
    wheels = OpenedWheels()
    with wheels.network:
        wheels.base.command(0.5, 0.0)
        wheels.network.sleep(1)
        Interrupts(monkeypatch, wheels.world, after)
        with pytest.raises(KeyboardInterrupt):
            wheels.base.close()
        wheels.base.close()
        assert speed_of(wheels.world) < 1.0
        assert wheels.network.drive(1, "zlac8030l").state()["power"] != "Operation enabled"
        with pytest.raises(ferrodrive.MasterError, match="it was closed"):
            wheels.base.command(0.1, 0.0)


@pytest.mark.parametrize("motion", ["move", "points", "file, on its way", "file, while it is approached"])
def test_an_interrupted_motion_of_a_group_comes_to_rest_and_the_group_goes_on(monkeypatch, tmp_path, motion):
    axes = OpenedAxes()
    path = tmp_path / "path.csv"
    path.write_text("t_s,1.angle_deg,2.angle_deg\n0,0,0\n5,500,500\n10,1000,1000\n")
    far = [[1000.0 * (1 - math.cos(math.pi * cycle / 5000)) / 2] * 2 for cycle in range(5001)]
    motions = {
        "move": lambda: axes.group.move([36000, 36000]),
        "points": lambda: axes.group.follow(far),
        "file, on its way": lambda: axes.group.follow_file(path),
        "file, while it is approached": lambda: (path.write_text("t_s,1.angle_deg\n0,36000\n9,36001\n"), axes.group.follow_file(path, approach=True)),
    }
    with axes.network:
        Interrupts(monkeypatch, axes.world, 1.5)
        with pytest.raises(KeyboardInterrupt):
            motions[motion]()
        assert speed_of(axes.world) > 5.0
        axes.network.sleep(1.0)
        assert speed_of(axes.world) < 1.0
        assert axes.group.move([0, 0]) > 0.0
        assert speed_of(axes.world) < 1.0
        axes.group.close()


def test_a_group_has_a_state_while_it_explains_its_stop():
    axes = OpenedAxes()
    # Behind a broken encoder no standstill is seen, also at the end.
    with pytest.raises(ferrodrive.MasterError, match="node 2 may still be moving.*does not see its shaft"), axes.network:
        job = axes.group._native.move_to([360, 360], None)
        axes.world.apply("2 fault encoder on")
        causes = set()
        while not job.ended:
            axes.world.advance(axes.world.now_ns + 100_000, [])
            causes.add(axes.group.state()["cause"])
        assert any(cause and "axis 2, node 2" in cause for cause in causes)
        with pytest.raises(ferrodrive.MasterError, match="axis 2, node 2.*[Ee]ncoder"):
            job.result()


def test_closing_twice_is_closing_once():
    with ferrodrive.Network(ferrodrive.World.machine(pathlib.Path(__file__).resolve().parents[3] / "examples" / "base.toml")) as network:
        network.boot()
        with network.base() as base:
            base.close()
            base.close()
