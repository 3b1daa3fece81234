"""The fixtures as the suite of a user has them."""

import html
import re
import xml.etree.ElementTree

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
    result.stdout.fnmatch_lines(
        [
            "*last frames on the bus*",
            "*704#00*boot-up*node 4*",
            "*last events*",
            "*node 4: boot-up message*",
            "*zlac8030l at 4*statusword*48.0 V*",
        ]
    )


def test_the_report_of_a_failing_test_is_bounded_and_has_what_went_wrong(pytester):
    pytester.makepyfile(
        """
        import ferrodrive, pytest

        @pytest.fixture
        def network():
            world = ferrodrive.World()
            world.add("zlac8030l", node=4)
            with ferrodrive.Network(world) as network:
                network.boot()
                yield network

        @pytest.fixture
        def stopped(network):
            network.drive(4, "zlac8030l").velocity(60)
            network._world[4].set_supply(85)  # the limit of a ZLAC8030L is 75 V
            network.sleep(1)
            assert list(network._world.events()) == []  # a watch of one's own begins here
            network._world[4].set_supply(48)
            assert network._world[4].error_code == 0, "in a fixture"

        def test_it(stopped):
            pass
        """
    )
    result = pytester.runpytest_subprocess("-p", "no:cacheprovider")
    result.assert_outcomes(errors=1)
    shown = "\n".join(result.outlines)
    frames, events = (shown.split(f" {head} ")[1].split(" ---")[0].splitlines()[1:-1] for head in ("last frames on the bus", "last events"))
    assert len(frames) == 40 and 0 < len(events) <= 20 and max(map(len, [*frames, *events])) <= 160
    # Decoded: the master's questions by name; the fault by its name, with what the manual advises (ZLAC8030L, fault 0001h).
    assert any("statusword" in line for line in frames), frames
    assert any("node 4" in line and "fault" in line and "over-voltage" in line.lower() for line in events), events
    assert any("supply 48" in line for line in events), events


PLOTTED = """
    import time, ferrodrive, pytest

    @pytest.fixture
    def world():
        world = ferrodrive.World()
        world.keep_trail(last=0.75)  # the plugin leaves it so
        world.add("zlac8030l", node=4)  # the plot has what is added later too
        yield world

    @pytest.fixture
    def booted(world):
        world.run_for(1)
        world.add("zlim42c", node=5)
        return world

    def test_over_voltage(booted):
        booted.run_for(0.5)
        booted[4].set_supply(85)  # the limit of a ZLAC8030L is 75 V
        booted.run_for(0.5)
        assert booted[4].error_code == 0

    def test_empty():
        pass
"""


def test_a_failing_test_leaves_a_plot_in_a_file_that_the_report_names(pytester):
    pytester.makepyfile(PLOTTED)
    result = pytester.runpytest_subprocess("-p", "no:cacheprovider")
    result.assert_outcomes(failed=1, passed=1)
    named = [line for line in result.outlines if line.endswith("test_over_voltage-world.svg")]
    assert len(named) == 1, result.outlines
    figure = xml.etree.ElementTree.parse(named[0])
    words = " ".join(figure.getroot().itertext())
    for wanted in ("test_over_voltage", "node 4", "node 5", "Supply", "fault 0001h"):
        assert wanted in words, words
    times = [float(word) for word in words.replace("time, s", " ").split() if re.fullmatch(r"[12]\.\d", word)]
    assert min(times) >= 1.2 and max(times) == 2.0, "the last 0.75 s of 2 s"


def test_a_plot_goes_into_the_report_of_pytest_html(pytester):
    pytest.importorskip("pytest_html", reason="pytest-html is not installed here")
    pytester.makepyfile(PLOTTED)
    result = pytester.runpytest_subprocess("-p", "no:cacheprovider", "--html=report.html", "--self-contained-html")
    result.assert_outcomes(failed=1, passed=1)
    result.stdout.fnmatch_lines(["*in the HTML report*"])
    report = html.unescape((pytester.path / "report.html").read_text())
    assert report.count("<svg") >= 1 and "fault 0001h" in report


def test_a_trail_changes_nothing_in_a_run_and_has_bounds():
    def run(follow):
        world = ferrodrive.World(seed=3)
        if follow:
            world.keep_trail(last=0.5, every=0.002)
        wheel = world.add("zlac8030l", node=4)
        world.run_for(1)
        wheel.set_supply(85)
        before = world.snapshot()
        world.run_for(1)
        world.restore(before)
        world.run_for(1)
        return world

    assert run(True).digest() == run(False).digest()
    points = [element.get("points") or element.get("d") for element in xml.etree.ElementTree.fromstring(run(True).picture()).iter()]
    assert max(len(text) for text in points if text) < 20_000
    with pytest.raises(RuntimeError, match="nothing of this world was kept"):
        run(False).picture()
    with pytest.raises(ValueError, match="more than 100000 samples"):
        ferrodrive.World().keep_trail(last=1000, every=0.001)


def test_a_record_and_a_trail_share_a_world(tmp_path):
    world = ferrodrive.World()
    world.keep_trail()
    world.add("zlac8030l", node=4)
    world.run_for(1)
    with world.record(tmp_path / "run.csv", every=0.001):
        world.run_for(1)
        with pytest.raises(RuntimeError, match="end_record"):
            world.restore(world.snapshot())
    world.run_for(1)
    lines = (tmp_path / "run.csv").read_text().splitlines()
    times = [float(line.split(",")[0]) for line in lines[1:] if line[0].isdigit()]
    assert times[0] == 1 and times[-1] == 2 and len(times) == 1001
    assert "Supply" in world.picture()


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

        @pytest.mark.ferrodrive(drives=["zlac8030l@4"])
        def test_it(ferrodrive_sim):
            assert ferrodrive_sim.world("4 get")["node"] == 4
            with can.Bus(**ferrodrive_sim.can_arguments()) as bus:
                bus.send(can.Message(arbitration_id=0, data=[0x81, 4], is_extended_id=False))
                assert bus.recv(10).arbitration_id == 0x704
            with pytest.raises(Exception, match="refused"):
                ferrodrive_sim.world("4 frobnicate")

        @pytest.mark.ferrodrive(machine="machine.toml")
        def test_machine(ferrodrive_sim):
            assert ferrodrive_sim.world("4 get")["power"] == "on"

        @pytest.mark.ferrodrive(drives=["zlac8030l@4"], bitrate=250_000, timing="ideal", seed=7)
        def test_marker(ferrodrive_sim):
            words = " ".join(ferrodrive_sim.command_line)
            assert "--bitrate 250000" in words and "--timing ideal" in words and "--seed 7" in words
        """
    )
    pytester.makefile(".toml", machine="seed = 5\n[[drive]]\nmodel = 'zlac8030l'\nnode = 4\n")
    pytester.runpytest_subprocess("-p", "no:cacheprovider").assert_outcomes(passed=3)


def test_a_machine_file_is_looked_for_beside_the_test_and_then_in_the_root(pytester, monkeypatch):
    text = "[[drive]]\\nmodel = 'zlac8030l'\\nnode = {}\\n".replace("\\n", "\n")
    suite = pytester.mkdir("suite")
    (suite / "near.toml").write_text(text.format(4))
    (pytester.path / "near.toml").write_text(text.format(5))
    (pytester.path / "far.toml").write_text(text.format(6))
    (suite / "test_places.py").write_text(
        """
import pytest

@pytest.mark.ferrodrive(machine="near.toml")
def test_near(ferrodrive_world):
    assert ferrodrive_world.nodes == [4]

@pytest.mark.ferrodrive(machine="far.toml")
def test_far(ferrodrive_world):
    assert ferrodrive_world.nodes == [6]

@pytest.mark.ferrodrive(machine="nowhere.toml")
def test_nowhere(ferrodrive_world):
    pass

@pytest.mark.ferrodrive(machine="far.toml", drives=["zlac8030l@4"])
def test_drives_beside(ferrodrive_world):
    pass

@pytest.mark.ferrodrive(extra=["--clock", "manual"])
def test_extra(ferrodrive_world):
    pass
"""
    )
    # The current folder decides nothing.
    monkeypatch.chdir(pytester.mkdir("elsewhere"))
    result = pytester.runpytest_subprocess("-p", "no:cacheprovider", "--rootdir", pytester.path, suite)
    result.assert_outcomes(passed=2, errors=3)
    result.stdout.fnmatch_lines(
        [f"*no machine file nowhere.toml; looked for {suite}*and {pytester.path}*", "*the drives are in the machine file*", "*omit it*"]
    )


def test_drives_of_the_marker_are_described_as_for_the_simulator(pytester):
    pytester.makepyfile(
        """
        import ferrodrive, pytest

        @pytest.mark.ferrodrive(drives=["zlac8030l@4,motor=fast,6060=3"], timing="ideal")
        def test_options(ferrodrive_world):
            with ferrodrive.Network(ferrodrive_world) as network:
                network.wait_for(4)
                assert network.upload(4, 0x6060) == bytes([3])
                # The other motor ends at some 510 r/min at 48 V.
                drive = network.drive(4, "zlac8030l")
                drive.velocity(600)
                drive.velocity(0, deceleration_rpm_s=200)  # slow, for it feeds back what it brakes

        @pytest.mark.ferrodrive(drives=["zlac8030l@4,motor=fats"])
        def test_wrong(ferrodrive_world):
            pass
        """
    )
    result = pytester.runpytest_subprocess("-p", "no:cacheprovider")
    result.assert_outcomes(passed=1, errors=1)
    result.stdout.fnmatch_lines(["*'fats' is not a choice for motor of a zlac8030l*"])


def test_a_bus_that_an_earlier_test_left_open_is_named_with_that_test(pytester):
    pytester.makepyfile(
        """
        import can, ferrodrive

        kept = []

        def test_leaves_its_bus_open():
            kept.append(can.Bus(interface="ferrodrive", channel=ferrodrive.World()))

        def test_next(ferrodrive_world):
            pass
        """
    )
    result = pytester.runpytest_subprocess("-p", "no:cacheprovider")
    result.assert_outcomes(passed=1, errors=1)
    result.stdout.fnmatch_lines(["*TimeInUse: *in use since *test_leaves_its_bus_open*bus.shutdown()*"])


def test_the_marker_says_the_timing_and_the_machine(pytester):
    pytester.makefile(".toml", machine="[[drive]]\nmodel = 'zlac8030l'\nnode = 4\nunits = { gear_ratio = 10 }\n")
    pytester.makepyfile(
        """
        import ferrodrive
        import pytest

        @pytest.mark.ferrodrive(drives=["zlac8030l@4"], timing="ideal")
        def test_ideal(ferrodrive_world):
            ferrodrive_world.run_for(0.1)
            assert ferrodrive_world[4].statusword

        @pytest.mark.ferrodrive(drives=["zlac8030l@4"])
        def test_device(ferrodrive_world):
            # It boots in about a second, and has no statusword before.
            ferrodrive_world.run_for(0.1)
            assert not ferrodrive_world[4].statusword
            ferrodrive_world.run_for(2)
            assert ferrodrive_world[4].statusword

        @pytest.mark.ferrodrive(machine="machine.toml")
        def test_machine(ferrodrive_world):
            assert ferrodrive_world.nodes == [4]
            ferrodrive_world.run_for(0.1)
            assert not ferrodrive_world[4].statusword

        @pytest.mark.ferrodrive(machine="machine.toml", bitrate=250_000)
        def test_both(ferrodrive_world):
            pass

        @pytest.mark.ferrodrive(drive=["zlac8030l@4"])
        def test_unknown(ferrodrive_world):
            pass

        @pytest.mark.ferrodrive(drives="zlac8030l@4")
        def test_text(ferrodrive_world):
            pass

        @pytest.mark.ferrodrive("machine.toml")
        def test_without_a_name(ferrodrive_world):
            pass
        """
    )
    result = pytester.runpytest()
    result.assert_outcomes(passed=3, errors=4)
    result.stdout.fnmatch_lines(["*the marker ferrodrive has 'machine.toml' without a name; expected NAME=VALUE, of bitrate, drives*"])
    result.stdout.fnmatch_lines(["*the bit rate is in the machine file*", "*the marker ferrodrive has no drive; expected bitrate, drives*"])
    result.stdout.fnmatch_lines(["*the marker ferrodrive has drives='zlac8030l@4'; expected a list, drives=?'zlac8030l@4'?*"])
