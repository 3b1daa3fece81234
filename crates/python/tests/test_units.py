"""What stands behind a shaft by the machine file: a drive, a group and a base of a world that is made of the file, and of a bus."""

import math

import ferrodrive
import pytest

#: A joint of 65536 counts a turn of its output, without and with a gear of 50 behind it, and two wheels behind gears of 10.
FILE = """
bitrate = "1M"
[[drive]]
model = "cia402"
node = 1
units = { gear_ratio = 50 }
[[drive]]
model = "cia402"
node = 2
[[drive]]
model = "zlac8030l"
node = 4
units = { gear_ratio = 10 }
[[drive]]
model = "zlac8030l"
node = 5
units = { gear_ratio = 10 }
"""


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "machine.toml"
    path.write_text(FILE, encoding="utf-8")
    return path


@pytest.fixture
def world(file):
    return ferrodrive.World.machine(file)


@pytest.fixture
def network(world):
    with ferrodrive.Network(world) as network:
        for node in (1, 2, 4, 5):
            network.wait_for(node)
        network.sleep(0.5)
        yield network


def turned(world, node, before):
    return math.degrees(world[node].shaft_angle_rad - before)


def test_a_drive_of_the_file_is_moved_by_what_its_output_does(world, network):
    before = world[1].shaft_angle_rad
    drive = network.drive(1)
    assert (drive.model, drive.gear_ratio) == ("cia402", None)
    drive.move(3, relative=True)
    assert turned(world, 1, before) == pytest.approx(150, abs=1)
    # What is given at the call overrules the file.
    network.drive(1, "cia402", gear_ratio=1).move(30, relative=True)
    assert turned(world, 1, before) == pytest.approx(180, abs=1)


def test_a_copy_of_a_world_is_of_the_same_file(world):
    copy = world.snapshot()
    with ferrodrive.Network(copy) as network:
        network.wait_for(1)
        network.sleep(0.5)
        before = copy[1].shaft_angle_rad
        network.drive(1).move(3, relative=True)
        assert turned(copy, 1, before) == pytest.approx(150, abs=1)


def test_a_group_and_a_base_are_behind_the_same_gears(world, network):
    limits = {"mode": "csp", "velocity_rpm": 12, "acceleration_rpm_s": 60, "following_error_deg": 10}
    before = world[1].shaft_angle_rad
    with network.group([ferrodrive.Axis(1, "cia402", **limits)], period=0.002) as group:
        group.move([group.state()["axes"][0]["set_point_deg"] + 3])
        network.sleep(0.2)
    assert turned(world, 1, before) == pytest.approx(150, abs=1)
    before = world[4].shaft_angle_rad
    size = {"wheel_base_m": 0.4, "wheel_radius_m": 0.1}
    limits = {"linear_m_s": 0.1, "angular_rad_s": 1, "wheel_m_s": 0.1, "wheel_m_s2": 0.5}
    with network.base((4, "zlac8030l"), (5, "zlac8030l"), **size, **limits) as base:
        base.drive(0.1, 0, seconds=1.0)
        way_m = base.state()["x_m"]
    # 0.1 m/s for a second, and the ramps; each metre is 1 / (tau 0.1) turns of the wheel and ten times that of the shaft.
    assert way_m == pytest.approx(0.1, abs=0.02)
    assert turned(world, 4, before) == pytest.approx(360 * 10 * way_m / (math.tau * 0.1), rel=0.05)


def test_a_file_that_is_given_to_the_network_counts_instead_of_the_world_s(file):
    bare = ferrodrive.World()
    bare.add("cia402", node=1)
    with ferrodrive.Network(bare, machine=file) as network:
        network.wait_for(1)
        network.sleep(0.5)
        before = bare[1].shaft_angle_rad
        network.drive(1).move(3, relative=True)
        assert turned(bare, 1, before) == pytest.approx(150, abs=1)
