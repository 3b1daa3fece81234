"""An arm of six joints as one group, by a machine file: it arrives, stops in the middle of a move, and a cut cable stops all."""

import threading
import time

import ferrodrive
import pytest

MACHINE = "six_axis_arm.toml"
JOINTS = range(1, 7)
#: Angles of the output shafts in degrees, from the base to the wrist.
REACH = [30, -20, 45, 60, -30, 90]

pytestmark = pytest.mark.ferrodrive(machine=MACHINE)


@pytest.fixture
def network(ferrodrive_world):
    ferrodrive_world.wait_until_booted()
    with ferrodrive.Network(ferrodrive_world, machine=ferrodrive_world.machine_file) as network:
        yield network


def turning(world):
    """The joints whose motor turns."""
    return [joint for joint in JOINTS if abs(world[joint].velocity_rpm) > 0.5]


def in_background(move):
    """Begins a move in a thread, which takes part in the virtual time, and lets 1 s pass. Its error comes out of `join()`."""
    errors = []

    def run():
        try:
            move()
        except ferrodrive.MasterError as error:
            errors.append(str(error))

    thread = threading.Thread(target=run)
    thread.start()
    time.sleep(1)
    return thread, errors


def test_all_joints_arrive_together(network, ferrodrive_world):
    with network.group("arm") as arm:
        arm.move(REACH, within=4)
        angles = [axis["angle_deg"] for axis in arm.state()["axes"]]
    assert angles == pytest.approx(REACH, abs=0.1)
    assert turning(ferrodrive_world) == []


def test_an_angle_beyond_its_range_moves_nothing(network, ferrodrive_world):
    with network.group("arm") as arm:
        with pytest.raises(ferrodrive.MasterError, match="axis 2 would be at 95 deg"):
            arm.move([0, 95, 0, 0, 0, 0])
        assert turning(ferrodrive_world) == []


def test_an_emergency_stop_in_the_middle_of_a_move(network, ferrodrive_world):
    with network.group("arm") as arm:
        thread, errors = in_background(lambda: arm.move(REACH, within=4))
        assert turning(ferrodrive_world) == list(JOINTS)
        arm.stop()  # returns when all were seen to stand
        assert turning(ferrodrive_world) == []
        thread.join()
        assert errors == ["the group was stopped by command"]


def test_a_cable_that_breaks_at_one_joint_stops_the_others(network, ferrodrive_world):
    with network.group("arm") as arm:
        thread, errors = in_background(lambda: arm.move(REACH, within=4))
        ferrodrive_world[5].cut_cable()
        thread.join()
        assert "node 5" in errors[0]
        time.sleep(0.5)
        assert [joint for joint in turning(ferrodrive_world) if joint != 5] == []
        # Nothing reaches joint 5 any more: it watches for the heartbeat of its host, for 2 s.
        time.sleep(2)
        assert turning(ferrodrive_world) == []
        assert ferrodrive_world[5].error_code == 0x20
        ferrodrive_world[5].join_cable()
