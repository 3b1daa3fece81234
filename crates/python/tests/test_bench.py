"""Test motions and tuning from Python: the parts of ``ferrodrive test-motion`` and ``ferrodrive tune``."""

import asyncio
import cmath
import math
import statistics
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
            # A cosine of 60 degrees to either side has an amplitude of 2 pi 60/360 turns/s. Single readings are off by a tenth where
            # SYNC comes beside a tick of the drive.
            readings = zip(run["capture"]["time_s"], run["capture"]["values"]["velocity_rpm"])
            period = [rpm * cmath.exp(2j * math.pi * time_s) for time_s, rpm in readings if time_s <= 1]
            assert 2 * abs(sum(period)) / len(period) == pytest.approx(60 * 6.2832 * 60 / 360, rel=0.02)
        network.sleep(0.1)
        assert abs(world[5].velocity_rpm) < 1


# 20 degrees and back in a second.
SWING = [(at / 20, 10 - 10 * math.cos(math.tau * at / 20)) for at in range(21)]


@pytest.mark.parametrize(
    ("shape", "how"),
    [
        ("chirp", {"by": 20, "frequency": 0.5, "to_frequency": 2.0, "time": 2.0}),
        ("prbs", {"speed_rpm": 15, "time": 2.0}),
        ("path", {"path": SWING, "acceleration_rpm_s": 900.0}),
    ],
)
def test_each_shape_moves_the_shaft_as_it_says_and_leaves_it_at_rest(world, shape, how):
    with ferrodrive.Network(world) as network:
        network.wait_for(5)
        (run,) = network.drive(5, "cia402").test_motion(shape, count=1, velocity_rpm=90, **how)
        times, speeds = run["capture"]["time_s"], run["capture"]["values"]["velocity_rpm"]
        assert min(speeds) < -5 and max(speeds) > 5
        if shape == "chirp":
            # A cosine of 20 degrees at 2 Hz, where it ends.
            fastest = 2 * math.tau * 20 / 360 * 60
            assert max(speeds) == pytest.approx(fastest, rel=0.2) and -min(speeds) == pytest.approx(fastest, rel=0.2)
        elif shape == "prbs":
            assert statistics.median(map(abs, speeds)) == pytest.approx(15, rel=0.2)
        else:
            ways = [6 * rpm * (later - at) for at, later, rpm in zip(times, times[1:], speeds)]
            assert sum(way for way in ways if way > 0) == pytest.approx(20, rel=0.1)
            assert sum(ways) == pytest.approx(0, abs=1)
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


def test_a_trigger_keeps_what_was_before_it_and_a_capture_is_a_file_that_reads_back(world, tmp_path):
    # Its load turns the wheel: 1 N m on 0.514 kg m² reach 30 r/min after a second and a half.
    world[4].apply("load inertia 0.5")
    with ferrodrive.Network(world) as network:
        network.wait_for(4)
        world[4].apply("load torque -1")
        drive = network.drive(4, "zlac8030l")
        capture = drive.capture("velocity", "position", duration=0.05, trigger="velocity > 30", pre_trigger=0.02)
    assert capture["trigger_s"] == pytest.approx(0.02, abs=0.002) and capture["parameters"]["1800h:02"]
    for at, speed in zip(capture["time_s"], capture["values"]["velocity_rpm"]):
        assert (speed > 30) == (at >= capture["trigger_s"] - 1e-9), (at, speed)
    capture["notes"] = "cold"
    for name in ("step.mcap", "step.csv"):
        ferrodrive.save_capture(capture, tmp_path / name)
        read = ferrodrive.load_capture(tmp_path / name)
        assert (read["notes"], read["node"], read["model"], read["trigger_s"]) == ("cold", 4, "zlac8030l", capture["trigger_s"])
        assert read["values"] == capture["values"] and read["units"] == capture["units"] and read["parameters"] == capture["parameters"]
        assert read["by"]["velocity_rpm"] == "file"
    with pytest.raises(ferrodrive.MasterError, match="not the name of a capture"):
        ferrodrive.save_capture(capture, tmp_path / "step.txt")
    with pytest.raises(ferrodrive.MasterError, match="no values of node 5 are in it"):
        ferrodrive.load_capture(tmp_path / "step.csv", 5)
    with pytest.raises(ferrodrive.MasterError, match="no current in A: current_demand_a"):
        ferrodrive.tune_capture(tmp_path / "step.csv")
    other = tmp_path / "letter.csv"
    other.write_text("Dear reader")
    with pytest.raises(OSError):
        ferrodrive.save_capture(capture, other)
    assert other.read_text() == "Dear reader"


def test_an_excited_drive_is_known_by_its_capture_as_a_file(world, tmp_path):
    # An inertia of which 1 A makes 50 rad/s², in a loop of 2 A/(rad/s) that is computed each millisecond.
    random, time_s, asked, current, angle = 1, [], [], [], []
    speed = turned = target = 0.0
    for number in range(9000):
        if number % 7 == 0:
            random = (random * 1103515245 + 12345) % 2**31
            target = 10.0 + (2.0 if random & 0x10000 else -2.0)
        amps = 2.0 * (target - speed)
        time_s.append(number * 1e-3)
        asked.append(target * 60 / math.tau)
        current.append(amps)
        angle.append(math.degrees(turned))
        turned += (speed + 0.5e-3 * 50.0 * amps) * 1e-3
        speed += 1e-3 * 50.0 * amps
    traces = {"velocity_demand_rpm": asked, "current_demand_a": current, "position_deg": angle}
    units = {"velocity_demand_rpm": "r/min", "current_demand_a": "A", "position_deg": "°"}
    values = {name: array("d", trace) for name, trace in traces.items()}
    capture = {"name": "", "notes": "", "node": 4, "model": "", "trigger_s": None, "time_s": array("d", time_s), "values": values, "units": units}
    ferrodrive.save_capture({**capture, "parameters": {}}, tmp_path / "excited.csv")
    found = ferrodrive.tune_capture(tmp_path / "excited.csv", torque_constant=0.5)
    assert found["gain_rad_s2_a"] == pytest.approx(50.0, rel=0.03) and found["inertia_kg_m2"] == pytest.approx(0.01, rel=0.03)
    assert found["proportional_a_s_rad"] == pytest.approx(2.0, rel=0.1)
    rows = [row for row in found["response"] if row["coherence"] > 0.9 and 5 < row["hz"] < 50]
    assert len(rows) > 12
    for row in rows:
        # 50 / (2 pi f), in dB.
        assert row["drive"]["db"] == pytest.approx(20 * math.log10(50 / (math.tau * row["hz"])), abs=1.0) and row["twin"] is None


def test_steps_that_come_too_far_are_stopped_and_their_run_is_kept(world):
    with ferrodrive.Network(world) as network:
        network.wait_for(4)
        drive = network.drive(4, "zlac8030l")
        with pytest.raises(ferrodrive.MasterError, match="turns from where it stood, more than 1") as stopped:
            drive.test_motion("steps", speed_rpm=60, time=10.0, acceleration_rpm_s=300.0, travel_turns=1.0, capture_period=0.01)
        assert stopped.value.kind == "travel_bound"
        # In the form of runs that were made.
        (run,) = stopped.value.report
        assert max(run["capture"]["values"]["velocity_rpm"]) == pytest.approx(60, rel=0.1)
        assert abs(world[4].velocity_rpm) < 1 and 1.0 <= world[4].shaft_angle_rad / 6.2832 < 1.3
        with pytest.raises(ValueError, match="go 0.250 turns"):
            drive.test_motion("back-and-forth", by=90, travel_turns=0.2)
        with pytest.raises(ValueError, match="expected a shape"):
            drive.test_motion("circle")


def test_a_wheel_is_tuned_and_has_afterwards_what_it_had(world, tmp_path):
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
        coherent = [row for row in found["response"] if row["coherence"] >= 0.5]
        assert len(coherent) == found["coherent"] and len(found["response"]) == found["frequencies"]
        # Where one mass alone turns, the wheel: torque constant over inertia and frequency, within 1 dB.
        for row in (row for row in coherent if 8 < row["hz"] < 20):
            gain = found["torque_constant_nm_a"] / (0.014 + 0.05) / (math.tau * row["hz"])
            assert row["drive"]["db"] == pytest.approx(20 * math.log10(gain), abs=1.5), row
        report = network.report(4, tmp_path / "sheet.html", tunings=[found])
        assert report["tunings"][0]["gains"] == found["gains"] and "Tuning" in (tmp_path / "sheet.html").read_text()
        with pytest.raises(ferrodrive.MasterError, match="it is of node 4"):
            network.report(5, tmp_path / "other.html", "cia402", tunings=[found])
        with pytest.raises(ValueError, match="expected a current from"):
            drive.tune(current_a=0)


#: The TPDOs beside the first, which a test motion captures by. A group of axes leaves them switched off, at the end of any of its motions.
SPARE = [(0x1A00 + pdo, sub) for pdo in (1, 2, 3) for sub in (0, 1, 2)] + [(0x1800 + pdo, 2) for pdo in (1, 2, 3)]
#: A tuning writes the ramp, the first TPDO, the mode, and gains and filter of the speed loop too.
OF_A_TUNING = [(0x6083, 0), (0x1A00, 1), (0x1800, 2), (0x6060, 0), (0x201D, 0), (0x201E, 0), (0x2018, 0)]


def given_up(world, node, begin, after, objects):
    """Cancels what ``begin`` makes of a network, after so many seconds: what it leaves is there as soon as the cancellation is seen."""

    async def main(network):
        async def values():
            return [await network.async_upload(node, *place) for place in objects]

        before = await values()
        job = asyncio.ensure_future(begin(network))
        await network.async_sleep(after)
        assert not job.done() and abs(world[node].velocity_rpm) > 5
        assert await values() != before
        job.cancel()
        with pytest.raises(asyncio.CancelledError):
            await job
        # With the network left open, and nothing waited for.
        assert abs(world[node].velocity_rpm) < 1
        assert await values() == before
        probe = world.add_probe()
        await network.async_sleep(1)
        assert abs(world[node].velocity_rpm) < 1
        heard = iter(lambda: world.poll(probe), None)
        # Neither SYNC nor set-points, and nothing that keeps the drive from its own watch.
        assert not {message[0] for _, message in heard} & {0x80, 0x77F, 0x200 + node, 0x600 + node}

    world.wait_until_booted()
    with ferrodrive.virtual_time(world), ferrodrive.Network(world) as network:
        asyncio.run(main(network))


def test_a_tuning_that_is_given_up_leaves_what_was_there(world):
    given_up(world, 4, lambda network: network.async_drive(4, "zlac8030l").tune(), 3, SPARE + OF_A_TUNING)


def test_a_tuning_that_is_given_up_with_its_new_gains_leaves_the_former_ones(world):
    world[4].apply("load inertia 0.05")
    # It measures for half a minute; from the 29th to the 33rd second it has the new gains.
    given_up(world, 4, lambda network: network.async_drive(4, "zlac8030l").tune(apply=True), 31, SPARE + OF_A_TUNING)


@pytest.mark.parametrize(
    ("node", "model", "motion"),
    [
        (4, "zlac8030l", {"shape": "steps", "speed_rpm": 60, "time": 20.0, "acceleration_rpm_s": 300.0}),
        (5, "cia402", {"shape": "ramp", "speed_rpm": 50, "time": 20.0}),
    ],
)
def test_a_test_motion_that_is_given_up_leaves_what_was_there(world, node, model, motion):
    given_up(world, node, lambda network: network.async_drive(node, model).test_motion(**motion), 3, SPARE)


def test_what_no_tuning_can_be_made_with_is_refused_before_anything_moves(world):
    with ferrodrive.Network(world) as network:
        network.wait_for(4)
        drive = network.drive(4, "zlac8030l")
        for values in ({"bandwidth": -5.0}, {"phase_margin": 0.0}, {"torque_constant": 0.0}, {"speed_rpm": 0.0}, {"travel_turns": -1.0}):
            (name,) = values
            for value in (*values.values(), math.nan, math.inf):
                with pytest.raises(ValueError, match="expected a .* from"):
                    drive.tune(**{name: value})
        assert world[4].shaft_angle_rad == 0.0
        with pytest.raises(ValueError, match="50 us"):
            drive.capture("velocity", period=1e-6)
        with pytest.raises(ValueError, match="readings are more than are kept"):
            drive.test_motion("steps", time=1e19)


def test_a_tuning_is_given_up_with_its_network(world):
    async def main():
        network = ferrodrive.Network(world)
        tuning = asyncio.ensure_future(network.async_drive(4, "zlac8030l").tune())
        await network.async_sleep(3)
        tuning.cancel()
        await asyncio.sleep(0)
        network.close()
        with pytest.raises(asyncio.CancelledError):
            await tuning
        assert abs(world[4].velocity_rpm) < 1

    world.wait_until_booted()
    with ferrodrive.virtual_time(world):
        asyncio.run(main())


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


def test_a_stepper_gets_ramps_with_which_its_twin_loses_no_step():
    world = ferrodrive.World(bitrate=1_000_000)
    world.add("zlim42c", node=2)
    with ferrodrive.Network(world) as network:
        network.wait_for(2)
        drive = network.drive(2, "zlim42c")
        with pytest.raises(ferrodrive.MasterError, match="ramps and currents") as refused:
            drive.tune()
        assert refused.value.kind == "no_gains"
        found = drive.tune_ramps(speed_rpm=600, inertia_kg_m2=3e-5, friction_nm=0.05)
        assert found["margin_after"] >= 1.5 and found["pull_out_nm"] > 1.5 * found["needed_nm"]
        # With the load, and with one as many times as large as the margin.
        assert [row["lost_steps"] for row in found["twin"][:2]] == [0, 0] and not found["applied"]
        applied = drive.tune_ramps(speed_rpm=600, inertia_kg_m2=3e-5, friction_nm=0.05, apply=True)
        assert applied["applied"] and applied["margin_before"] == found["margin_before"]
        for row in applied["values"]:
            index, sub_index = row["object"].split("h:")
            held = network.upload(2, int(index, 16), int(sub_index))
            assert int.from_bytes(held, "little") == row["after"], row
        again = drive.tune_ramps(speed_rpm=600, inertia_kg_m2=3e-5, friction_nm=0.05)
        assert again["margin_before"] == pytest.approx(applied["margin_after"])
        with pytest.raises(ferrodrive.MasterError, match="the load has that margin up to"):
            drive.tune_ramps(speed_rpm=1400, inertia_kg_m2=3e-5, friction_nm=0.25)
        with pytest.raises(ValueError, match="expected a margin from 1 to 10"):
            drive.tune_ramps(margin=0.5)
    assert abs(world[2].shaft_angle_rad) < 1e-3
