"""The served simulator and its control connection, as `docs/control.md` describes it."""

import ferrodrive
import pytest


@pytest.fixture
def sim():
    with ferrodrive.Simulator(["zlac8030l@4", "zlim42c@5"]) as simulator:
        simulator.wait_until_booted()
        yield simulator


def test_a_fault_is_heard_of_with_its_remedy_by_who_asked_for_faults_of_that_node(sim):
    with sim.control() as control, sim.control() as other:
        assert control.hello["protocol"] == 1
        assert {node["node"] for node in control.hello["nodes"]} == {4, 5}
        control.subscribe_events(nodes=[4], kinds=["fault"])
        other.subscribe_events(nodes=[5])
        control.world("4 supply 85")  # the limit of a ZLAC8030L is 75 V
        event = control.wait_for("fault", node=4, within=30)
        assert event["code"] == 0x0001 and event["remedy"]
        # What one has subscribed to is not sent to the other.
        assert other.request("now")["ok"] and other.news(within=0.2) is None


def test_values_come_at_their_period_and_answers_between_them(sim):
    with sim.control() as control:
        control.subscribe_values(4, ["supply_v", "velocity_rpm"], every="10ms")
        times = []
        while len(times) < 20:
            sample = control.news(within=30)["sample"]
            assert abs(sample["values"]["4"]["supply_v"] - 48) < 1
            times.append(sample["t"])
            assert control.request("now")["t"] > 0
        # Simulated time: a busy machine delays the news, and not what they are about.
        assert {round(later - earlier, 6) for earlier, later in zip(times, times[1:])} == {0.01}


def test_what_is_refused_and_what_does_not_come_is_told(sim):
    with sim.control() as control:
        with pytest.raises(ferrodrive.Refused, match="9"):
            control.world("9 supply 48")
        with pytest.raises(ferrodrive.Refused):
            control.request("frobnicate")
        control.subscribe_events(kinds=["fault"])
        with pytest.raises(TimeoutError, match="no event 'fault' within 0.1 s"):
            control.wait_for("fault", within=0.1)
        assert sim.quit() == 0
        with pytest.raises(ferrodrive.SimulatorError, match="control connection"):
            for _ in range(3):  # what is on its way may still be taken
                control.request("now")


def test_time_that_is_moved_by_hand_goes_as_far_as_it_is_told():
    with ferrodrive.Simulator(["zlac8030l@4"], extra=["--clock", "manual"]) as simulator, simulator.control() as control:
        begin = control.request("now")["t"]
        control.request("run", **{"for": "1500ms"})
        assert control.request("now")["t"] == pytest.approx(begin + 1.5, abs=1e-9)
        simulator.wait_until_booted(within=5)


def test_the_program_is_the_one_that_the_environment_names(monkeypatch, tmp_path):
    built = tmp_path / "built"
    built.write_text("#!/bin/sh\nexit 3\n")
    monkeypatch.setenv("FERRODRIVE_PROGRAM", str(built))
    with pytest.raises(ferrodrive.SimulatorError, match="FERRODRIVE_PROGRAM is '.*built', where no program is"):
        ferrodrive.simulator.program()
    built.chmod(0o755)
    assert ferrodrive.simulator.program() == str(built)
    assert ferrodrive.Simulator([]).command_line[:2] == [str(built), "sim"]
    assert ferrodrive.Simulator([], path="another").command_line[0] == "another"
