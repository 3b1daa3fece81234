"""Test motions and tuning from Python: the parts of ``ferrodrive test-motion`` and ``ferrodrive tune``."""

import asyncio
from array import array

import ferrodrive
import pytest


@pytest.fixture
def world():
    world = ferrodrive.World(bitrate=1_000_000)
    world.add("zlac8030l", node=4)
    world.add("cia402", node=5)
    return world


def test_a_sine_is_followed_and_captured_in_each_run(world):
    with ferrodrive.Network(world) as network:
        network.wait_for(5)
        runs = network.drive(5, "cia402").test_motion("sine", by=60, periods=1, count=2, velocity_rpm=90)
        assert [run["run"] for run in runs] == [1, 2]
        for run in runs:
            # A period at 1 Hz, and two cycles at rest.
            assert run["followed"]["took_s"] == pytest.approx(1.0, abs=0.05)
            assert run["followed"]["rms_deg"] < 5
            speeds = run["capture"]["values"]["velocity_rpm"]
            # A cosine of 60 degrees to either side: at most 2 pi 60/360 turns/s.
            assert max(speeds) == pytest.approx(60 * 6.2832 * 60 / 360, rel=0.1)
        network.sleep(0.1)
        assert abs(world[5].velocity_rpm) < 1


def test_what_is_true_of_a_drive_is_captured_with_what_it_says(world):
    with ferrodrive.Network(world) as network:
        network.wait_for(4)
        drive = network.drive(4, "zlac8030l")
        capture = drive.capture("velocity", "true_velocity", "true_shaft_angle_rad", duration=0.05)
        values, rows = capture["values"], len(capture["time_s"])
        assert capture["by"]["true_velocity_rpm"] == "world" and values["true_velocity_rpm"] == array("d", [0.0] * rows)
        assert rows > 45 and len(values["true_shaft_angle_rad"]) == rows
        assert values["true_shaft_angle_rad"][-1] == pytest.approx(world[4].shaft_angle_rad, abs=1e-3)
        with pytest.raises(ferrodrive.MasterError, match="no true value 'speeed'"):
            drive.capture("true_speeed")


def test_steps_that_come_too_far_are_stopped_and_their_run_is_kept(world):
    with ferrodrive.Network(world) as network:
        network.wait_for(4)
        drive = network.drive(4, "zlac8030l")
        with pytest.raises(ferrodrive.MasterError, match="turns from where it stood, more than 1") as stopped:
            drive.test_motion("steps", speed_rpm=60, time=10.0, acceleration_rpm_s=300.0, travel_turns=1.0, capture_period=0.01)
        assert stopped.value.kind == "travel_bound"
        assert abs(world[4].velocity_rpm) < 1 and 1.0 <= world[4].shaft_angle_rad / 6.2832 < 1.3
        with pytest.raises(ValueError, match="go 0.250 turns"):
            drive.test_motion("back-and-forth", by=90, travel_turns=0.2)
        with pytest.raises(ValueError, match="expected a shape"):
            drive.test_motion("circle")


def test_a_wheel_is_tuned_and_has_afterwards_what_it_had(world):
    world[4].apply("load inertia 0.05")
    with ferrodrive.Network(world) as network:
        network.wait_for(4)
        drive = network.drive(4, "zlac8030l")
        before = network.upload(4, 0x201D)
        found = drive.tune()
        # The wheel's own 0.014 kg m² (crate plant) and what hangs on it.
        assert found["inertia_kg_m2"] == pytest.approx(0.014 + 0.05, rel=0.05)
        assert found["after"]["stable"] and found["after"]["phase_deg"] >= 40
        assert not found["applied"] and network.upload(4, 0x201D) == before
        with pytest.raises(ValueError, match="a current above 0 A"):
            drive.tune(current_a=0)


def test_a_tuning_that_is_given_up_leaves_the_shaft_at_rest(world):
    world.wait_until_booted()

    async def main(network):
        tuning = asyncio.ensure_future(network.async_drive(4, "zlac8030l").tune())
        await network.async_sleep(3)
        assert not tuning.done() and abs(world[4].velocity_rpm) > 5
        tuning.cancel()
        with pytest.raises(asyncio.CancelledError):
            await tuning
        # With the network left open: it is stopped by what gave it up.
        await network.async_sleep(2)
        assert abs(world[4].velocity_rpm) < 1

    with ferrodrive.virtual_time(world), ferrodrive.Network(world) as network:
        asyncio.run(main(network))
    assert abs(world[4].velocity_rpm) < 1
    world.run_for(2.0)
    assert abs(world[4].velocity_rpm) < 1


def test_a_joint_is_tuned_by_what_its_twin_shows():
    world = ferrodrive.World(bitrate=1_000_000)
    world.add("m4230e17b50", node=1)
    world[1].set_load_inertia(0.15)
    with ferrodrive.Network(world) as network:
        network.wait_for(1)
        found = network.drive(1, "m4230e17b50").tune(position=True)
    # The rotor's inertia of the manual, and the load and the flange (crate plant) behind a ratio of 50.
    assert found["inertia_kg_m2"] == pytest.approx(0.69e-4 + (0.15 + 7e-5) / 2500, rel=0.05)
    assert [gain["object"] for gain in found["gains"]] == ["60F9h:01", "60F9h:02", "60FBh:01"]
    assert found["after"]["stable"] and found["position"]["stable"] and found["frequencies"] == 0
