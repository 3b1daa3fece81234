"""Groups of axes and bases from Python, on a virtual bus; what is true is asked of the simulated shafts."""

import ast
import math
import pathlib
import subprocess
import sys

import ferrodrive
import pytest

SERVO = {"mode": "csp", "velocity_rpm": 60, "acceleration_rpm_s": 300, "jerk_rpm_s2": 3000, "following_error_deg": 10}


@pytest.fixture
def world():
    world = ferrodrive.World(bitrate=1_000_000)
    world.add("cia402", node=1)
    world.add("cia402", node=2)
    return world


@pytest.fixture
def network(world):
    with ferrodrive.Network(world) as network:
        network.wait_for(1)
        network.wait_for(2)
        network.sleep(0.5)
        yield network


def servos(**limits):
    return [ferrodrive.Axis(node, "cia402", **{**SERVO, **limits}) for node in (1, 2)]


def test_axes_begin_and_end_together_where_they_were_sent(world, network):
    before = [world[node].shaft_angle_rad for node in (1, 2)]
    with network.group(servos(), period=0.001) as group:
        # 1 turn at 1 turn/s, 5 turns/s^2 and 50 turns/s^3: L/v + v/a + a/j.
        assert group.move([360, -90]) == pytest.approx(1.3, abs=1e-6)
        network.sleep(0.2)
        turned = [math.degrees(world[node].shaft_angle_rad - angle) for node, angle in zip((1, 2), before)]
        assert turned == pytest.approx([360, -90], abs=1)
        assert group.move([0, 0], within=3) == pytest.approx(3)
        state = group.state()
        assert (state["phase"], state["cause"], state["missed_cycles"]) == ("holding", None, 0)
        assert [axis["set_point_deg"] for axis in state["axes"]] == pytest.approx([0, 0], abs=1e-6)
        assert state["axes"][0]["power"] == "Operation enabled"
    assert network.drive(1, "cia402").state()["power"] != "Operation enabled"


@pytest.mark.parametrize("model, mode", [("cia402", 8), ("m4230e17b50", 7), ("zlac8030l", 3)])
def test_an_axis_without_a_mode_has_the_best_of_its_model(model, mode):
    """6060h: cyclic synchronous position, interpolated position, profile velocity (CiA 402-2, 8.4.7)."""
    world = ferrodrive.World(bitrate=1_000_000)
    world.add(model, node=5)
    with ferrodrive.Network(world) as network:
        network.wait_for(5)
        network.sleep(0.5)
        before = world[5].shaft_angle_rad
        with network.group([ferrodrive.Axis(5, model)]) as group:
            assert network.upload(5, 0x6060) == bytes([mode])
            at = group.state()["axes"][0]["set_point_deg"]
            group.move([at + 20], within=2)
            network.sleep(0.3)
            assert math.degrees(world[5].shaft_angle_rad - before) == pytest.approx(20, abs=2)
            axis = group.state()["axes"][0]
            error = abs(axis["angle_deg"] - axis["set_point_deg"])
            assert axis["following_error_deg"] == pytest.approx(error) and error < 2


def test_axes_behind_gears_are_moved_by_what_the_outputs_do(world, network):
    before = [world[node].shaft_angle_rad for node in (1, 2)]
    geared = {**SERVO, "velocity_rpm": SERVO["velocity_rpm"] / 10, "acceleration_rpm_s": SERVO["acceleration_rpm_s"] / 10}
    axes = [ferrodrive.Axis(1, "cia402", gear_ratio=10, **geared), ferrodrive.Axis(2, "cia402", **SERVO)]
    with network.group(axes, period=0.001) as group:
        group.move([36, -90])
        network.sleep(0.2)
        turned = [math.degrees(world[node].shaft_angle_rad - angle) for node, angle in zip((1, 2), before)]
        assert turned == pytest.approx([360, -90], abs=1)


def test_a_path_of_points_is_followed(world, network):
    # A cycloid of 45 degrees in half a second: from rest and to rest, its acceleration too.
    shares = [cycle / 500 for cycle in range(1, 501)]
    path = [45 * (share - math.sin(math.tau * share) / math.tau) for share in shares]
    before = world[1].shaft_angle_rad
    with network.group(servos(), period=0.001) as group:
        begin = world.now
        group.follow([[angle, -angle] for angle in path])
        # And until both were seen to stand.
        assert 0.5 < world.now - begin < 0.65
        network.sleep(0.2)
        assert math.degrees(world[1].shaft_angle_rad - before) == pytest.approx(45, abs=1)
        with pytest.raises(ferrodrive.MasterError, match="axis 1 would need a velocity"):
            group.follow([[0, 0]])


def path_file(folder, from_deg=(0, 0), by_deg=(45, -45), seconds=0.5):
    """A cycloid of each axis: from rest and to rest, its acceleration too."""
    path = folder / "path.csv"
    shares = [row / 50 for row in range(51)]
    parts = [share - math.sin(math.tau * share) / math.tau for share in shares]
    rows = [[share * seconds, *(begin + by * part for begin, by in zip(from_deg, by_deg))] for share, part in zip(shares, parts)]
    head = ["t_s", *(f"{node}.angle_deg" for node in range(1, len(by_deg) + 1))]
    path.write_text("".join(",".join(map(str, row)) + "\n" for row in [head, *rows]))
    return path


def test_a_recorded_path_is_followed_in_its_time(world, network, tmp_path):
    before = [world[node].shaft_angle_rad for node in (1, 2)]

    def turned():
        network.sleep(0.2)
        return [math.degrees(world[node].shaft_angle_rad - angle) for node, angle in zip((1, 2), before)]

    with network.group(servos(), period=0.001) as group:
        begin = world.now
        assert group.follow_file(path_file(tmp_path)) == pytest.approx(0.5)
        assert 0.5 < world.now - begin < 0.65
        assert turned() == pytest.approx([45, -45], abs=1)
        # It counts from where the axes are held, or they are led to where it begins.
        group.follow_file(path_file(tmp_path, from_deg=(720, 0)), relative=True)
        assert turned() == pytest.approx([90, -90], abs=1)
        group.follow_file(path_file(tmp_path, from_deg=(30, 0)), approach=True)
        assert turned() == pytest.approx([75, -45], abs=1)
        # An axis that it does not name stays where it is.
        group.follow_file(path_file(tmp_path, by_deg=(-45,)), relative=True)
        assert turned() == pytest.approx([30, -45], abs=1)


def test_a_recorded_path_that_cannot_be_followed_moves_nothing(world, network, tmp_path):
    before = [world[node].shaft_angle_rad for node in (1, 2)]
    wrong = tmp_path / "wrong.csv"
    wrong.write_text("t_s,1.angle_deg\n0,0\n0,1\n")
    with network.group(servos(range_deg=(-180, 180)), period=0.001) as group:
        refused = [
            ({"from_deg": (10, 0)}, "not_at_start", "node 1 stands at 0 deg and the path begins at 10 deg"),
            ({"by_deg": (200, 0), "seconds": 5}, "out_of_limits", "outside its software limits"),
            ({"seconds": 0.05}, "out_of_limits", "would need"),
            (wrong, "bad_file", "its times do not rise"),
            (tmp_path / "none.csv", "bad_file", "none.csv"),
        ]
        for path, kind, said in refused:
            path = path_file(tmp_path, **path) if isinstance(path, dict) else path
            with pytest.raises(ferrodrive.MasterError, match=said) as raised:
                group.follow_file(path)
            assert raised.value.kind == kind
        with pytest.raises(ferrodrive.BadRequest, match="positions of node 3, and the axes of the group are 1, 2"):
            group.follow_file(path_file(tmp_path, from_deg=(0, 0, 0), by_deg=(1, 1, 1)))
        assert group.state()["phase"] == "holding"
    assert [world[node].shaft_angle_rad for node in (1, 2)] == pytest.approx(before, abs=1e-3)


def test_what_breaks_a_limit_moves_nothing(world, network):
    with network.group(servos(range_deg=(-180, 180)), period=0.001) as group:
        for wrong in [{1: 30, 2: -20}, "12"]:
            with pytest.raises(TypeError, match="in the order of the group"):
                group.move(wrong)
        for wrong, said in [([181, 0], "outside its software limits"), ([0], "2 axes"), ([math.nan, 0], "finite number")]:
            with pytest.raises(ferrodrive.MasterError, match=said):
                group.move(wrong)
        with pytest.raises(ferrodrive.MasterError, match="give more time"):
            group.move([180, 0], within=0.1)
        rest = [[0.0, 0.0]] * 20
        for wrong, said in [([0.0], "2 axes"), ([90.0, 0.0], "would need a velocity"), ([math.nan, 0.0], "finite number")]:
            with pytest.raises(ferrodrive.MasterError, match=said):
                group.follow([*rest, wrong, *rest])
            state = group.state()
            assert (state["phase"], state["cause"]) == ("holding", None)
        group.move([90, 0])
    with pytest.raises(ferrodrive.MasterError, match="it was closed"):
        group.move([0, 0])
    with pytest.raises(ferrodrive.MasterError, match="state a finite number above 0"):
        network.group(servos(velocity_rpm=0))
    with pytest.raises(ValueError, match="not a mode of operation"):
        network.group(servos(mode="fast"))


def test_a_blocked_shaft_stops_the_others_and_is_named(world, network):
    with network.group(servos(), period=0.001) as group:
        world[2].lock_rotor()
        with pytest.raises(ferrodrive.MasterError, match="axis 2, node 2, is .* deg from its set-point"):
            group.move([360, 360])
        assert "axis 2" in group.state()["cause"]
        network.sleep(0.5)
        assert abs(world[1].velocity_rpm) < 1


def test_a_base_goes_the_way_of_its_twist_and_stops_without_one():
    world = ferrodrive.World()
    world.add("zlac8030l", node=4)
    world.add("zlac8030l", node=5)
    with ferrodrive.Network(world) as network:
        network.wait_for(4)
        network.wait_for(5)
        network.sleep(1)
        limits = {"linear_m_s": 0.8, "angular_rad_s": 2, "wheel_m_s": 0.8, "wheel_m_s2": 0.8}
        sides = (4, "zlac8030l"), (5, "zlac8030l")
        with network.base(*sides, wheel_base_m=0.4, wheel_radius_m=0.084, **limits) as base:
            base.drive(0.3, 0.2, 3)
            network.sleep(0.5)
            state = base.state()
            # 0.6 rad on a circle of 1.5 m: the ramps up and down are alike.
            assert state["heading_deg"] == pytest.approx(math.degrees(0.6), abs=1.5)
            assert state["x_m"] == pytest.approx(1.5 * math.sin(0.6), abs=0.02)
            base.command(0.3, 0)
            network.sleep(0.2)
            assert base.state()["linear_m_s"] > 0.1
            # The watchdog's 0.3 s, and the ramp's.
            network.sleep(1)
            state = base.state()
            assert state["linear_m_s"] == 0 and "no new twist came for 300 ms" in state["cause"]
            with pytest.raises(ferrodrive.MasterError, match="finite numbers"):
                base.command(math.inf, 0)


def test_the_example_of_the_handbook_ends_where_it_was_sent():
    example = pathlib.Path(__file__).resolve().parents[3] / "examples" / "group_of_two.py"
    ended = subprocess.run([sys.executable, example], capture_output=True, text=True, timeout=120)
    assert ended.returncode == 0, ended.stderr
    joint, stepper = ast.literal_eval(ended.stdout)
    # The joint by cyclic positions, the stepper by speeds, which are steps of 1 r/min.
    assert joint["angle_deg"] == pytest.approx(90, abs=0.5)
    assert stepper["angle_deg"] == pytest.approx(-45, abs=2)
