"""The fixtures as a suite of somebody else has them."""

import ferrodrive
import pytest

pytest_plugins = ["pytester"]


def test_a_failing_test_shows_the_last_frames_and_the_drives(pytester):
    pytester.makepyfile(
        """
        import time, can, pytest

        @pytest.mark.ferrodrive(drives=["zlac8030l@4"], bitrate=250_000, seed=7)
        def test_it(ferrodrive_world):
            assert ferrodrive_world.bitrate == 250_000
            with can.Bus(interface="ferrodrive", channel=ferrodrive_world) as bus:
                assert bus.recv(5).arbitration_id == 0x704
                time.sleep(1000)
                assert False, "mine"
        """
    )
    result = pytester.runpytest_subprocess("-p", "no:cacheprovider")
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["*last frames on the bus*", "*704#00*", "*zlac8030l at 4*statusword*48.0 V*"])


def test_a_time_that_a_test_leaves_open_ends_with_its_fixture(pytester):
    pytester.makepyfile(
        """
        import can, time

        kept = []

        def test_one(ferrodrive_world):
            kept.append(can.Bus(interface="ferrodrive", channel=ferrodrive_world))
            can.Notifier(kept[0], [])

        def test_two(ferrodrive_world):
            time.sleep(1000)
            assert ferrodrive_world.now == 1000
        """
    )
    pytester.runpytest_subprocess("-p", "no:cacheprovider").assert_outcomes(passed=2)


def test_the_served_simulator_is_ready(pytester):
    try:
        ferrodrive.simulator.program()
    except ferrodrive.SimulatorError as error:
        pytest.skip(str(error))
    pytester.makepyfile(
        """
        import can, pytest

        @pytest.mark.ferrodrive(drives=["zlac8030l@4"], extra=["--timing", "ideal"])
        def test_it(ferrodrive_sim):
            assert ferrodrive_sim.world("4 get")["node"] == 4
            with can.Bus(**ferrodrive_sim.can_arguments()) as bus:
                bus.send(can.Message(arbitration_id=0, data=[0x81, 4], is_extended_id=False))
                assert bus.recv(10).arbitration_id == 0x704
            with pytest.raises(Exception, match="refused"):
                ferrodrive_sim.world("4 frobnicate")
        """
    )
    pytester.runpytest_subprocess("-p", "no:cacheprovider").assert_outcomes(passed=1)
