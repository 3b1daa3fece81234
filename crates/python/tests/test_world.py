"""A world by itself: time, drives, stimuli, snapshots, and what goes wrong."""

import csv
import os
import pathlib
import re
import signal
import threading

import ferrodrive
import pytest
from ferrodrive import _native

EXAMPLES = pathlib.Path(__file__).resolve().parents[3] / "examples"


@pytest.fixture
def world():
    world = ferrodrive.World(bitrate=500_000, seed=1)
    world.add("zlac8030l", node=4)
    return world


def test_time_passes_by_what_it_is_told(world):
    world.run_for(0.25)
    world.run_for(0)
    assert (world.now_ns, world.now) == (250_000_000, 0.25)
    with pytest.raises(ValueError, match="expected a time of 0 s or more"):
        world.run_for(-1)


def test_a_drive_boots_with_the_message_of_the_standard(world):
    """CiA 301, clause 7.2.8.3.3: one byte 00h under 700h + node-ID."""
    world.add_probe()  # a frame needs a node that acknowledges it
    world.run_for(3)
    assert world.frames(1)[0].endswith("704#00")


def test_devices_that_take_their_time_boot_later():
    def boots_at_s(timing):
        world = ferrodrive.World(timing=timing)
        world.add("zlac8030l", node=4)
        world.add_probe()
        return world.run_until(lambda: world.frames(1), within=10)

    assert boots_at_s("device") > boots_at_s("ideal") + 0.1
    with pytest.raises(ValueError, match="device or ideal"):
        ferrodrive.World(timing="slow")


@pytest.mark.parametrize("made", ["world", "channel", "file", "ideal", "ideal file"])
def test_a_world_takes_the_time_of_real_devices_unless_ideal_is_chosen(made, tmp_path):
    file = tmp_path / "machine.toml"
    file.write_text("[[drive]]\nmodel = 'zlac8030l'\nnode = 4\n")
    world = {
        "world": lambda: ferrodrive.World(),
        "channel": lambda: ferrodrive.world.at_channel("zlac8030l@4"),
        "file": lambda: ferrodrive.World.machine(file),
        "ideal": lambda: ferrodrive.World(timing="ideal"),
        "ideal file": lambda: ferrodrive.World.machine(file, timing="ideal"),
    }[made]()
    if not world.nodes:
        world.add("zlac8030l", node=4)
    # A ZLAC8030L is deaf for about a second after its start (docs/drives/zlac8030l.md).
    booted_s = world.wait_until_booted()
    assert (booted_s > 0.3) == ("ideal" not in made), booted_s


def test_a_drive_that_does_not_boot_is_waited_for_no_longer_than_asked(world):
    world[4].power_cut()
    with pytest.raises(TimeoutError, match="2 s"):
        world.wait_until_booted(within=2)
    assert world.now == pytest.approx(2, abs=0.01)


def test_a_condition_is_waited_for_and_its_time_is_the_answer(world):
    reached_s = world.run_until(lambda: world.now >= 0.0305, within=1)
    assert reached_s == 0.031
    with pytest.raises(TimeoutError, match="0.1 s"):
        world.run_until(lambda: False, within=0.1)
    assert world.now == pytest.approx(0.131, abs=1e-9)


def test_a_condition_that_raises_leaves_a_world_that_goes_on(world):
    def raises():
        if world.now > 0.1:
            raise KeyError("mine")

    with pytest.raises(KeyError, match="mine"):
        world.run_until(raises, within=1)
    before = world.now
    world.run_for(0.5)
    assert world.now == before + 0.5


def test_the_same_seed_gives_the_same_digest_and_a_load_another():
    def digest(load_nm):
        world = ferrodrive.World(seed=3)
        world.add("zlac8030l", node=4).set_load_torque(load_nm)
        world.run_for(0.5)
        return world.digest()

    assert digest(0.0) == digest(0.0) != digest(0.5)


def test_a_restored_world_goes_the_same_way_again(world):
    world.run_for(0.3)
    before = world.snapshot()
    world.run_for(0.7)
    straight = world.digest()
    for _ in range(2):
        world.restore(before)
        assert world.now == 0.3
        world.run_for(0.7)
        assert world.digest() == straight
    before.run_for(0.7)
    assert before.digest() == straight


def test_two_threads_take_turns(world):
    def run():
        for _ in range(100):
            world.run_for(0.001)
            world[4].supply_v

    threads = [threading.Thread(target=run) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert world.now == 0.4


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork on this system")
@pytest.mark.filterwarnings("ignore:.*multi-threaded.*:DeprecationWarning")
def test_a_forked_process_refuses_the_world_of_its_parent(world):
    child = os.fork()
    if child == 0:
        status = 1
        try:
            world.run_for(0.1)
        except RuntimeError as error:
            status = 42 if "forked" in str(error) else 2
        os._exit(status)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 42
    world.run_for(0.1)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork on this system")
@pytest.mark.filterwarnings("ignore:.*multi-threaded.*:DeprecationWarning")
def test_a_process_forked_in_the_middle_of_a_run_is_refused_and_makes_worlds_of_its_own(world):
    for node in range(10, 40):
        world.add("zlac8030l", node=node)
    going = threading.Event()

    def run():
        going.set()
        world.run_for(0.5)

    # The other thread has the world's lock for as long as it runs, and in the child no thread ever releases it.
    runner = threading.Thread(target=run)
    runner.start()
    going.wait()
    child = os.fork()
    if child == 0:
        status = 1
        try:
            signal.alarm(60)
            for use in (lambda: world.run_for(0.1), lambda: world.now, lambda: world.digest(), lambda: world.snapshot()):
                with pytest.raises(RuntimeError, match="forked"):
                    use()
            own = ferrodrive.World()
            own.add("zlac8030l", node=4)
            own.run_for(0.1)
            status = 42 if own.now == 0.1 else 2
        finally:
            os._exit(status)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 42
    runner.join()
    assert world.now == 0.5


def test_an_exception_of_one_thread_leaves_the_world_to_the_other(world):
    def fails():
        raise LookupError("mine")

    raised = []

    def wait_for_what_fails():
        for _ in range(50):
            try:
                world.run_until(fails, within=1)
            except LookupError as error:
                raised.append(error)

    failing = threading.Thread(target=wait_for_what_fails)
    failing.start()
    for _ in range(50):
        world.run_for(0.001)
    failing.join(60)
    assert not failing.is_alive() and len(raised) == 50
    assert world.now == 0.05


def test_wrong_orders_say_what_would_be_right(world):
    for order, words in (
        (lambda: ferrodrive.World(bitrate="300k"), "300k"),
        (lambda: world.add("zlac8030", node=5), "zlac8030l"),
        (lambda: world.add("zlac8030l", node=0), "1 to 127"),
        (lambda: world.add("zlac8030l", node=4), "already a drive 4"),
        (lambda: world[4].axis(2), "it has 1"),
        (lambda: world[4].set_input("X9", True), "it has X0"),
        (lambda: world[4].set_input("X0 1\n4 power", True), "one word"),
        (lambda: world[4].set_load_torque(float("nan")), "not NaN"),
        (lambda: world[4].set_battery(False), "no"),
    ):
        with pytest.raises(ValueError, match=re.escape(words)):
            order()
    with pytest.raises(KeyError, match="there is 4"):
        world[7]
    with pytest.raises(OverflowError):
        world.add("zlac8030l", node=300)


def test_the_data_sheet_of_a_model_is_an_eds():
    sheet = ferrodrive.eds("zlac8030l")
    assert "[FileInfo]" in sheet and "[6041]" in sheet
    assert set(ferrodrive.models()) >= {"zlac8030l", "zlim42c", "m4230e17b50", "cia402"}


def test_events_tell_of_a_fault_and_its_remedy_and_change_nothing(world):
    def run(watched):
        world = ferrodrive.World()
        drive = world.add("zlac8030l", node=4)
        if watched:
            assert list(world.events()) == []
        world.run_for(1)
        drive.set_fault("hall")
        world.run_for(0.5)
        return world

    seen = run(True)
    events = list(seen.events())
    assert list(seen.events()) == []
    assert [event["t_ns"] for event in events] == sorted(event["t_ns"] for event in events)
    faults = [event for event in events if event["kind"] == "fault"]
    assert faults and faults[0]["node"] == 4 and faults[0]["t"] >= 1 and faults[0]["remedy"]
    assert seen.digest() == run(False).digest()


def test_a_record_has_a_row_for_each_sample(world, tmp_path):
    path = tmp_path / "run.csv"
    with world.record(path, every=0.01):
        world.run_for(1)
        with pytest.raises(RuntimeError, match="already"), world.record(tmp_path / "other.csv"):
            pass
    header, *rows = path.read_text().splitlines()
    assert "4.velocity_rpm" in header.split(",") and "4.supply_v" in header.split(",")
    # From 0 to 1 s every 10 ms, both ends included.
    assert len(rows) == 101
    supply = header.split(",").index("4.supply_v")
    assert float(rows[-1].split(",")[supply]) == pytest.approx(48, abs=0.5)
    for name in ("run.txt", "no/such/folder.csv"):
        with pytest.raises(OSError), world.record(tmp_path / name):
            pass


@pytest.mark.parametrize("asked", [False, True])
def test_a_record_has_what_happens_and_takes_it_from_nobody(world, tmp_path, asked):
    if asked:
        assert list(world.events()) == []
    path = tmp_path / "run.csv"
    world.run_for(2)
    with world.record(path, every=0.01):
        world.run_for(0.5)
        world[4].set_fault("hall")
        world.run_for(0.5)
    with path.open(newline="") as file:
        marks = {float(row["t_s"]): row["mark"] for row in csv.DictReader(file) if row["mark"]}
    # Of the sample that follows it.
    [at] = [at for at, text in marks.items() if "node 4: fault 0200h, Hall sensor" in text]
    assert at == pytest.approx(2.505, abs=0.01)
    if asked:
        assert any(event["kind"] == "fault" for event in world.events())


class Reporting(ferrodrive.VirtualDrive):
    """Notes each stimulus as the words of a command, and has it understood."""

    said: list

    def _do(self, *stimulus):
        self.said.append(_native.stimulus_words(*stimulus))
        try:
            super()._do(*stimulus)
        except ferrodrive.Refused as refusal:
            # Understood, and this model does not have it.
            if "has no" not in str(refusal):
                raise


#: One call of every method that does something to a drive, at a model that takes it.
STIMULI = {
    "zlac8030l": [
        lambda it: it.power_off(),
        lambda it: it.power_on(),
        lambda it: it.power_cycle(),
        lambda it: it.power_cut(),
        lambda it: it.set_input("X0", True),
        lambda it: it.set_switch("X1", -5000),
        lambda it: it.set_load_torque(-2.5),
        lambda it: it.set_load_inertia(0.02),
        lambda it: it.lock_rotor(),
        lambda it: it.free_rotor(),
        lambda it: it.set_supply(48, limit_a=10, resistance_ohm=0.2),
        lambda it: it.hold_temperature("motor", 95),
        lambda it: it.hold_temperature("driver", None),
        lambda it: it.cut_cable(),
        lambda it: it.join_cable(),
        *(lambda it, part=part: it.set_fault(part) for part in ("hall", "encoder", "eeprom", "reference")),
        *(lambda it, part=part: it.set_fault(part, False) for part in ("phase", "short", "bridge", "bleeder")),
        lambda it: it.set_load_friction(0.2, 0.01, static_nm=0.3, stribeck_rad_s=0.5),
        lambda it: it.set_load_friction(None),
        lambda it: it.set_load_pulley(2, 0.05),
        lambda it: it.set_load_pulley(None),
        lambda it: it.set_load_spring(5, 90),
        lambda it: it.set_load_spring(None),
        lambda it: it.set_load_stop(-5000, None),
        lambda it: it.set_load_stop(None, None),
        lambda it: it.set_load_fan(2, 300),
        lambda it: it.set_load_fan(None),
        lambda it: it.set_load_gear(10, 0.5),
        lambda it: it.set_load_gear(None),
        lambda it: it.clear_loads(),
        lambda it: it.set_bus_silent(True),
        lambda it: it.set_bus_silent(False),
        lambda it: it.set_bus_late(5, 20),
        lambda it: it.set_bus_late(None),
        lambda it: it.set_bus_babble("080#", 1),
        lambda it: it.set_bus_babble(None),
        lambda it: it.set_bus_overrun(2, 0.5),
        lambda it: it.set_bus_overrun(None),
        lambda it: it.set_bus_corruption(0.3),
        lambda it: it.set_bus_corruption(None),
    ],
    "m4230e17b50": [
        lambda it: it.set_battery(False),
        lambda it: it.set_battery(True),
        lambda it: it.send_pulses(8192, 10_000),
        lambda it: it.send_quadrature(-400, 1000),
        lambda it: it.send_duty(40),
        lambda it: it.send_clock(10_000),
    ],
}


def test_a_record_has_the_pose_of_a_body_that_rolls(tmp_path):
    world = ferrodrive.World.machine(EXAMPLES / "mobile_base_tests" / "base.toml")
    with ferrodrive.Network(world) as network:
        for node in (1, 2):
            network.wait_for(node)
        network.sleep(0.5)
        with world.record(tmp_path / "run.csv", every=0.01):
            for node in (1, 2):
                network.drive(node, "zlac8030l").velocity(60)
            network.sleep(0.5)
        true = world.body("base").state()
    head, *lines = (tmp_path / "run.csv").read_text().splitlines()
    row = dict(zip(head.split(","), lines[-1].split(",")))
    assert true["x_m"] > 0.1
    assert float(row["base.x_m"]) == pytest.approx(true["x_m"], abs=0.01)
    assert float(row["base.heading_deg"]) == pytest.approx(true["heading_deg"], abs=1)


def test_a_machine_file_finds_its_data_sheets_beside_it(tmp_path):
    (tmp_path / "servo.eds").write_text(ferrodrive.eds("cia402"))
    path = tmp_path / "machine.toml"
    path.write_text("seed = 5\n[[drive]]\nmodel = 'servo.eds'\nnode = 3\nsupply_v = 24\n")
    world = ferrodrive.World.machine(path)
    world.run_for(1)
    assert world.nodes == [3]
    assert world[3].supply_v == pytest.approx(24, abs=0.5)


def test_a_machine_file_that_makes_no_sense_is_told_with_its_place(tmp_path):
    path = tmp_path / "machine.toml"
    path.write_text("[[drive]]\nmodel = 'zlac8030'\nnode = 2\n[[drive]]\nmodel = 'zlac8030l'\nnode = 200\n")
    with pytest.raises(ValueError) as refused:
        ferrodrive.World.machine(path)
    assert f"{path}:2" in str(refused.value) and "zlac8030l" in str(refused.value)
    assert f"{path}:6" in str(refused.value) and "127" in str(refused.value)
    path.write_text("[[drive]]\nmodel = 'absent.eds'\nnode = 2\n")
    with pytest.raises(ValueError, match=re.escape(f"{path}:2")):
        ferrodrive.World.machine(path)
    path.write_text("#" * (1 << 21))
    with pytest.raises(ValueError, match="larger than the limit of 1 MB"):
        ferrodrive.World.machine(path)
    with pytest.raises(ValueError, match="not a regular file"):
        ferrodrive.World.machine(tmp_path)
    with pytest.raises(FileNotFoundError):
        ferrodrive.World.machine(tmp_path / "absent.toml")


def test_every_stimulus_has_a_method():
    said = []
    for model, calls in STIMULI.items():
        world = ferrodrive.World(500_000)
        world.add(model, node=1)
        drive = Reporting(world, 1)
        drive.said = said
        for call in calls:
            call(drive)
    # A node whose objects are the outer world's needs a file; its words are enough here.
    drive._do = lambda *stimulus: said.append(_native.stimulus_words(*stimulus))
    drive.set_object(0x6000, 1, 255)
    drive.send_mpdo(None, 0x6200, 1, 255)
    wire = Wire()
    wire.said = said
    wire.corrupt(0.01)
    wire.destroy(3, 20)
    body = wire.body("base")
    body._do = lambda *stimulus: said.append(f"body base {_native.stimulus_words(*stimulus)}")
    body.set_slope(5, 90)
    body.set_grip(None)
    body.set_mass(60)
    body.set_payload(2)
    missing = [words for words in every_form() if not any(matches(words, line) for line in said)]
    assert missing == []


class Wire(ferrodrive.World):
    """Notes what is done to the wire, and has it understood."""

    def disturb(self, *fault):
        self.said.append(_native.stimulus_words(*fault))
        super().disturb(*fault)


def every_form():
    """Each verb with each of its alternatives, out of what `help` lists."""
    for line in ferrodrive.stimulus_forms():
        for form in re.split(r", or |, ", re.sub(r" \(.*?\)", "", line).replace("[", "").replace("]", "")):
            words = form.removeprefix("NODE ").split()
            if words[0] in ("now", "run", "help", "quit") or words[-1] == "get":
                continue
            fixed = [word.split("|") for word in words if re.fullmatch(r"[a-z][a-z|]*", word)]
            for number, alternatives in enumerate(fixed):
                for word in alternatives:
                    yield [words[0], word] if number else [word]


def matches(words, line):
    """Whether a line says these words. A command without a node has the same verb."""
    return line.split()[0] == words[0] and all(word in line.split() for word in words)


def test_analogue_channels_are_there_by_their_objects():
    world = ferrodrive.World()
    module = world.add("io401", node=10)
    world.run_for(2)
    module.apply("set 6401:02 -1200")
    assert module.analogue == {f"{index}:{sub:02X}": 0 for index in ("6401", "6411") for sub in range(1, 5)} | {"6401:02": -1200}
    assert world.add("cia402", node=5).analogue == {}


def test_the_pdos_of_a_drive_by_its_data_sheet_are_read_by_that(tmp_path):
    sheet = tmp_path / "maker.eds"
    sheet.write_text(ferrodrive.eds("cia402"))
    world = ferrodrive.World()
    world.add(eds=sheet, node=5)
    world.wait_until_booted()
    with ferrodrive.Network(world) as network:
        network.nmt("start")
        world.run_for(50)
    # CiA 402-2, 7.1: the statusword is in TPDO1 as delivered.
    said = [line for line in world.decoded_frames(20) if "TPDO1" in line]
    assert said and all("6041h:00" in line for line in said), said


def test_what_is_in_a_pdo_is_known_after_the_frames_that_mapped_it_have_left(world):
    with ferrodrive.Network(world) as network:
        network.boot()
        # CiA 301, 7.5.2.37 and 7.5.2.38: TPDO1 brings statusword and position, event-driven, each 2 ms.
        network.download(4, 0x1800, 1, (0x8000_0184).to_bytes(4, "little"))
        network.download(4, 0x1A00, 0, b"\0")
        network.download(4, 0x1A00, 1, (0x6041_0010).to_bytes(4, "little"))
        network.download(4, 0x1A00, 2, (0x6064_0020).to_bytes(4, "little"))
        network.download(4, 0x1A00, 0, b"\2")
        network.download(4, 0x1800, 2, b"\xff")
        network.download(4, 0x1800, 5, b"\4\0")
        network.download(4, 0x1800, 1, (0x184).to_bytes(4, "little"))
        network.nmt("start")
        for _ in range(4):
            world.run_for(5)
            said = [line for line in world.decoded_frames(20) if "TPDO1" in line]
            assert said and all("6041h:00" in line and "6064h:00" in line for line in said), said
    assert world.statistics()[1] > 2 * 4096
