"""What a network has for a machine as a whole: scan, boot, supervise, check, plan, explain, params; groups and the base of a file."""

import json
import math
import pathlib
import re
import subprocess
import time
import typing

import ferrodrive
import ferrodrive.reports
import pytest

EXAMPLES = pathlib.Path(__file__).resolve().parents[3] / "examples"

#: Two servos in a group, one with a heartbeat that its master sets, and a gear behind the other.
FILE = """
bitrate = "1M"
[[drive]]
model = "cia402"
node = 1
heartbeat = "200ms"
[[drive]]
model = "cia402"
node = 2
units = { gear_ratio = 10 }
[[group]]
name = "arm"
period = "2ms"
[[group.axis]]
node = 1
mode = "csp"
velocity_deg_s = 360
acceleration_deg_s2 = 1800
jerk_deg_s3 = 18000
following_error_deg = 36
[[group.axis]]
node = 2
mode = "csp"
velocity_deg_s = 36
acceleration_deg_s2 = 180
jerk_deg_s3 = 1800
following_error_deg = 36
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
        yield network


def number(data):
    return int.from_bytes(data, "little")


def test_a_boot_up_configures_what_the_file_has_and_starts_the_nodes(network):
    network.wait_for(1)
    assert number(network.upload(1, 0x1017)) == 0
    report = network.boot()
    assert report["ok"] and [node["node"] for node in report["nodes"]] == [1, 2]
    # 200 ms of the file, and CiA 301, 7.3.2.2: operational after NMT start.
    assert number(network.upload(1, 0x1017)) == 200
    assert [node["state"] for node in report["nodes"]] == ["operational"] * 2
    assert all(step["verdict"] in ("passed", "noted") for node in report["nodes"] for step in node["steps"])
    left = network.boot(nodes=[1], start=True)
    # CiA 302-2: L, the slave was operational before and was left so.
    assert [(node["node"], node["letter"]) for node in left["nodes"]] == [(1, "L")]


def test_a_mandatory_node_that_is_away_is_an_exception_with_each_step(world, network):
    world[2].power_cut()
    with pytest.raises(ferrodrive.MasterError, match="a mandatory node has not booted") as raised:
        network.boot()
    error = raised.value
    assert (error.kind, error.node, error.where) == ("not_booted", 2, "node 2")
    assert any("expected" in because for because in error.because) and error.do
    letters = {node["node"]: node["letter"] for node in error.report["nodes"]}
    # CiA 302-2: B, no answer of a mandatory slave to 1000h.
    assert letters == {1: None, 2: "B"}
    with pytest.raises(ferrodrive.BadRequest, match="node 9"):
        network.boot(nodes=[9])


def test_a_scan_names_who_is_there_and_an_empty_bus_is_an_exception(network):
    network.wait_for(1)
    network.wait_for(2)
    nodes = network.scan()["nodes"]
    assert [(node["node"], node["model"]) for node in nodes] == [(1, "cia402"), (2, "cia402")]
    with ferrodrive.Network(ferrodrive.World()) as alone, pytest.raises(ferrodrive.MasterError) as raised:
        alone.scan()
    assert raised.value.kind == "no_node" and "termination" in raised.value.do[0]


def test_what_others_send_during_a_scan_is_in_its_report(world, network):
    with ferrodrive.Network(world) as other:
        network.wait_for(1)
        network.wait_for(2)
        other.sync(0.01)
        heard = network.scan()["heard"]
    assert [row["text"] for row in heard if row["service"] == "sync"] == ["another node produces SYNC"]


def test_a_node_that_comes_back_is_booted_again_and_started_when_it_is_resumed(world, network):
    with network.supervise() as supervisor:
        assert supervisor.report["ok"]
        world[1].power_cut()
        lost = supervisor.wait_for("heartbeat_lost", within=10)
        # 200 ms of the file, and what a consumer gives it beside.
        assert lost["node"] == 1
        world[1].power_on()
        assert supervisor.wait_for("recovered", node=1, within=20)["node"] == 1
        assert number(network.upload(1, 0x1017)) == 200
        assert network.drive(1).state()["nmt"] == "pre-operational"
        supervisor.resume(1)
        network.sleep(0.5)
        assert network.drive(1).state()["nmt"] == "operational"
        with pytest.raises(TimeoutError, match="another_master"):
            supervisor.wait_for("another_master", within=0.2)
    supervisor.close()


def test_what_a_drive_lacks_to_move_is_explained(network):
    network.boot()
    findings = network.explain(1)["findings"]
    assert [finding["rule"] for finding in findings if finding["weight"] == "cause"] == ["not_enabled"]
    network.nmt("stop", 1)
    stopped = network.explain(1)
    # CiA 301, 7.3.2.2.4: no SDO in the state stopped; the heartbeat still has it.
    assert stopped["causes"] > 0 and "stopped" in json.dumps(stopped)
    assert network.explain(9, watch=0.1)["causes"] > 0


def test_a_plan_has_the_load_and_what_is_late(network):
    network.boot()
    report = network.plan()
    assert report["ok"] and report["moved"] == "group 'arm'" and report["cycle_us"] == 2000
    # The shortest frames of two drives for each cycle: SYNC (44 bits) and two of 8 bytes or less each, 1 us a bit.
    assert report["load"] > (44 + 4 * 44) * 1e-6 / 2e-3
    full = network.plan(cycle=0.0005, mode="csp", bitrate="125k")
    assert not full["ok"] and full["load"] > 1 and any(not frame["in_time"] for frame in full["frames"])
    for wrong, words in (
        ({"cycle": 1e-5}, "too short"),
        ({"mode": "fast"}, "fast"),
        ({"modes": {9: "csp"}}, "node 9"),
        ({"bitrate": "300k"}, "300k"),
    ):
        with pytest.raises(ValueError, match=words):
            network.plan(**wrong)


def test_a_description_is_checked_alone_and_against_the_drives(file, network, tmp_path):
    network.boot()
    report = network.check()
    assert report["ok"] and [node["answers"] for node in report["live"]] == [True, True]
    assert ferrodrive.check(file)["live"] is None
    wrong = tmp_path / "wrong.toml"
    wrong.write_text("[[drive]]\nmodel = 'zlac8030'\nnode = 2\n", encoding="utf-8")
    with pytest.raises(ferrodrive.BadRequest, match="zlac8030l"):
        ferrodrive.check(wrong)
    with pytest.raises(ferrodrive.MasterError, match="absent.toml"):
        ferrodrive.check(tmp_path / "absent.toml")
    with pytest.raises(ferrodrive.BadRequest, match="NAME.yml nor NAME.toml"):
        ferrodrive.check(tmp_path / "bus.txt")


def test_parameters_are_kept_compared_written_and_checked(network, tmp_path):
    network.boot()
    parameters, kept, wanted = network.params(1), tmp_path / "kept.toml", tmp_path / "wanted.toml"
    assert parameters.backup(kept)["values"] > 20 and parameters.verify(kept)["ok"]
    with pytest.raises(FileExistsError, match="force=True"):
        parameters.backup(kept)
    before = number(network.upload(1, 0x6081))
    wanted.write_text(f'[values]\n"6081h:00" = {before + 10}\n', encoding="utf-8")
    (step,) = parameters.plan(wanted)["steps"]
    assert step["object"] == "6081h:00" and number(network.upload(1, 0x6081)) == before
    assert [row["object"] for row in parameters.verify(wanted)["deviations"]] == ["6081h:00"]
    assert [row["object"] for row in parameters.diff(wanted)["differences"]] == ["6081h:00"]
    assert parameters.apply(wanted)["writes"] == 1
    assert number(network.upload(1, 0x6081)) == before + 10 and parameters.verify(wanted)["ok"]
    # Without a file that of the machine: its heartbeat.
    assert parameters.verify()["compared"] == 1
    proved = parameters.apply(kept, save=True, prove="reset")
    assert proved["saved"] and proved["proved"] == "an NMT reset" and number(network.upload(1, 0x6081)) == before


def test_parameters_that_a_node_refuses_are_put_back(network, tmp_path):
    network.boot()
    parameters, wanted = network.params(1), tmp_path / "wanted.toml"
    # Transmission type F1h to FBh is reserved (CiA 301, 7.5.2.37): what was written before is put back.
    wanted.write_text('[values]\n"1017h:00" = 123\n"1800h:02" = 251\n', encoding="utf-8")
    with pytest.raises(ferrodrive.MasterError, match=", failed") as raised:
        parameters.apply(wanted)
    error = raised.value
    # CiA 301, 7.2.4.3.17: invalid value for parameter.
    assert (error.kind, error.where, error.abort_code) == ("rolled_back", "node 1, 1800h:02", 0x06090030)
    assert number(network.upload(1, 0x1017)) == 200
    # What the model cannot have is refused before: there is no mode 77 (CiA 402-2, 6060h).
    wanted.write_text('[values]\n"6060h:00" = 77\n', encoding="utf-8")
    with pytest.raises(ferrodrive.MasterError, match="6060h") as raised:
        parameters.apply(wanted)
    assert raised.value.kind == "bad_parameters"
    wanted.write_text('[values]\n"1017h:00" = 123\n', encoding="utf-8")
    network.drive(1).enable()
    with pytest.raises(ferrodrive.MasterError, match="at rest") as raised:
        parameters.apply(wanted)
    assert (raised.value.kind, raised.value.node) == ("at_work", 1)
    for wrong, words in (({"prove": "reset"}, "save=True"), ({"save": True, "prove": "hope"}, "power-cycle")):
        with pytest.raises(ValueError, match=words):
            parameters.apply(wanted, **wrong)
    with pytest.raises(ferrodrive.BadRequest, match="which parameters"), ferrodrive.Network(ferrodrive.World()) as bare:
        bare.params(1, "cia402").verify()


def test_a_group_of_the_file_moves_behind_its_gears(world, network):
    network.boot()
    before = [world[node].shaft_angle_rad for node in (1, 2)]
    with network.group("arm") as group:
        begin = [axis["set_point_deg"] for axis in group.state()["axes"]]
        # 180 degrees at 360 deg/s, 1800 deg/s^2 and 18000 deg/s^3, all of which are reached: L/v + v/a + a/j.
        assert group.move([begin[0] + 180, begin[1] + 18]) == pytest.approx(0.5 + 0.2 + 0.1, abs=1e-6)
        network.sleep(0.3)
        turned = [math.degrees(world[node].shaft_angle_rad - angle) for node, angle in zip((1, 2), before)]
        assert turned == pytest.approx([180, 180], abs=1)
    with pytest.raises(ferrodrive.BadRequest, match="its groups: arm"):
        network.group("leg")
    with pytest.raises(ferrodrive.BadRequest, match=r"no \[base\]"):
        network.base()
    with ferrodrive.Network(ferrodrive.World()) as bare, pytest.raises(ferrodrive.BadRequest, match="machine=FILE"):
        bare.group("arm")
    with pytest.raises(ValueError, match="give left and right"):
        network.base((1, "cia402"))


def test_the_base_of_the_file_goes_where_its_twist_leads():
    world = ferrodrive.World.machine(EXAMPLES / "base.toml")
    with ferrodrive.Network(world) as network:
        network.boot()
        with network.base() as base:
            base.drive(0.3, 0.2, 3)
            network.sleep(0.5)
            # 0.6 rad on a circle of 1.5 m, by the world and not by the drives.
            true = world.body("base").state()
            assert true["heading_deg"] == pytest.approx(math.degrees(0.6), abs=1.5)
            assert true["x_m"] == pytest.approx(1.5 * math.sin(0.6), abs=0.02)


@pytest.mark.parametrize(
    ("words", "ask"),
    [
        (["scan"], lambda it: it.scan()),
        (["boot"], lambda it: it.boot()),
        (["plan"], lambda it: it.plan()),
        (["explain", "4"], lambda it: it.explain(4)),
        (["params", "backup", "4"], lambda it: it.params(4).backup()),
        (["params", "plan", "4"], lambda it: it.params(4).plan()),
        (["params", "diff", "2", "4"], lambda it: it.params(2).diff(4)),
        (["params", "verify", "4"], lambda it: it.params(4).verify()),
        (["params", "apply", "4"], lambda it: it.params(4).apply()),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_a_report_has_the_fields_of_the_command_line(words, ask):
    file = EXAMPLES / "machine.toml"
    program = [ferrodrive.simulator.program(), "--json", "--bus", f"sim:{file}", *words]
    said = json.loads(subprocess.run(program, capture_output=True, text=True, timeout=60).stdout)
    with ferrodrive.Network(ferrodrive.World.machine(file)) as network:
        for node in (1, 2, 4):
            network.wait_for(node)
        network.sleep(1)
        # Whether it failed is the exit status of the program; a caller sees it in the report.
        program_alone = {name for name in shape(said) if name.split(".")[0] in ("ok", "error")}
        assert shape(ask(network)) == shape(said) - program_alone | shape(ask(network)) & {"ok"}


def shape(value, at=""):
    """The paths of all fields."""
    if isinstance(value, dict):
        return {path for key, inner in value.items() for path in {at + key, *shape(inner, f"{at}{key}.")}}
    if isinstance(value, list):
        return {path for inner in value for path in shape(inner, at + "[]")}
    return set()


def test_the_same_on_a_real_bus(file, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    try:
        simulator = ferrodrive.Simulator([], extra=["--machine", str(file)])
    except ferrodrive.SimulatorError as error:
        pytest.skip(str(error))
    with simulator, ferrodrive.Network(f"socketcand://127.0.0.1:{simulator.port()}/can0", machine=file) as network:
        for node in (1, 2):
            network.wait_for(node, within=60)
        assert network.boot()["ok"]
        assert [node["model"] for node in network.scan()["nodes"]] == ["cia402", "cia402"]
        assert network.check()["ok"] and network.plan()["bitrate"] == 1_000_000
        wanted = tmp_path / "wanted.toml"
        wanted.write_text(f'[values]\n"6081h:00" = {number(network.upload(1, 0x6081)) + 10}\n', encoding="utf-8")
        assert network.params(1).apply(wanted)["writes"] == 1
        # The journal of a transaction that has come to its end is gone.
        assert not list(tmp_path.glob("*.journal"))
        with pytest.raises(ferrodrive.MasterError) as raised:
            network.params(1).rollback()
        assert raised.value.kind == "no_journal"


def test_a_file_that_makes_no_sense_is_an_exception_before_the_bus_is_opened(tmp_path):
    wrong = tmp_path / "wrong.toml"
    wrong.write_text("[[drive]]\nmodel = 'zlac8030'\nnode = 2\n", encoding="utf-8")
    for bus in (ferrodrive.World(), "socketcand://127.0.0.1:1/can0"):
        with pytest.raises(ferrodrive.BadRequest, match="zlac8030l") as raised:
            ferrodrive.Network(bus, machine=wrong)
        assert raised.value.do and f"{wrong}:2" in str(raised.value)


def test_a_watch_goes_on_while_the_program_sleeps_in_virtual_time(world):
    with ferrodrive.virtual_time(world), ferrodrive.Network(world) as network:
        supervisor = network.supervise()
        world[1].power_cut()
        time.sleep(3)
        # Nothing asked for it meanwhile.
        assert [(event["kind"], event["node"]) for event in supervisor.events(within=0.01)][:1] == [("heartbeat_lost", 1)]
        # A drive that is away cannot be released from its watch over this program.
        with pytest.raises(ferrodrive.NoAnswer, match="node 1 .* 1016h:01"):
            supervisor.close()
        supervisor.close()


def test_what_fails_under_a_watch_is_raised_before_what_its_end_says(world, network):
    with pytest.warns(ferrodrive.BusWarning, match="1016h:01"), pytest.raises(KeyError, match="mine"):
        with network.supervise():
            world[1].power_cut()
            network.sleep(1)
            raise KeyError("mine")


def test_the_report_about_a_node_is_the_page_of_the_command_line(tmp_path):
    file, record = EXAMPLES / "machine.toml", tmp_path / "run.csv"
    record.write_text("t_s,4.velocity_rpm\n0,10\n0.5,30\n", encoding="utf-8")
    pages = tmp_path / "program.html", tmp_path / "python.html"
    program = [ferrodrive.simulator.program(), "--json", "--bus", f"sim:{file}", "report", "4", "--capture", record, "-o", pages[0]]
    subprocess.run(program, capture_output=True, check=True, timeout=60)
    with ferrodrive.Network(ferrodrive.World.machine(file)) as network:
        network.wait_for(4)
        network.sleep(1)
        report = network.report(4, pages[1], captures=[record])
        # By hand: the mean of the samples.
        assert [figure["mean"] for figure in report["captures"][0]["figures"]] == [20.0]
        with pytest.raises(FileExistsError, match="force=True"):
            network.report(4, pages[1])
        with pytest.raises(ferrodrive.MasterError, match="not a record of node 1"):
            network.report(1, tmp_path / "other.html", captures=[record])
        assert not (tmp_path / "other.html").exists()
    sections = [re.findall(r"<h[12][^>]*>[^<]*", page.read_text(encoding="utf-8")) for page in pages]
    assert sections[0] == sections[1] and len(sections[0]) > 5


def test_the_report_has_the_faults_that_are_gone_too(tmp_path):
    world = ferrodrive.World(bitrate=1_000_000)
    world.add("cia402", node=5)
    with ferrodrive.Network(world) as network:
        network.wait_for(5)
        world[5].apply("supply 449")
        network.sleep(1)
        world[5].apply("supply 300")
        # Its capacitors discharge.
        network.sleep(20)
        network.drive(5, "cia402").reset_fault()
        report = network.report(5, tmp_path / "servo.html")
    # CiA 301, 7.2.7.2 and CiA 402-2: DC link over-voltage.
    assert report["fault"] is None and report["remembered"][0]["code"] == 0x3210
    page = (tmp_path / "servo.html").read_text(encoding="utf-8")
    assert "No fault is present." in page and "3210h" in page and "remembers no errors" not in page


def test_the_types_of_reports_have_the_fields_that_there_are(network, tmp_path):
    network.boot()
    parameters, kept, wanted = network.params(1), tmp_path / "kept.toml", tmp_path / "wanted.toml"
    parameters.backup(kept)
    wanted.write_text('[values]\n"6081h:00" = 1234\n', encoding="utf-8")
    reported = {
        "ScanReport": network.scan(),
        "BootReport": network.boot(),
        "PlanReport": network.plan(),
        "ExplainReport": network.explain(1),
        "NodeReport": network.report(1, tmp_path / "sheet.html"),
        "CheckReport": network.check(EXAMPLES / "base.toml"),
        "BackupReport": parameters.backup(),
        "ParametersPlan": parameters.plan(wanted),
        "DiffReport": parameters.diff(wanted),
        "VerifyReport": parameters.verify(wanted),
        "ApplyReport": parameters.apply(wanted),
        "DriveState": network.drive(1).state(),
        "MotionReport": network.drive(1).velocity(10),
    }
    for name, report in reported.items():
        holds(getattr(ferrodrive.reports, name), report, name)


def holds(kind, value, at):
    """That a value has what its type has: each field, and no other."""
    if isinstance(kind, type) and hasattr(kind, "__total__"):
        hints = typing.get_type_hints(kind)
        missing = set(hints) - set(value) if kind.__total__ else set()
        assert not missing and set(value) <= set(hints), f"{at}: {set(value) ^ set(hints)}"
        for field in value:
            holds(hints[field], value[field], f"{at}.{field}")
    elif typing.get_origin(kind) is list:
        for item in value:
            holds(typing.get_args(kind)[0], item, f"{at}[]")
    elif typing.get_origin(kind) is typing.Union:
        kinds = [other for other in typing.get_args(kind) if other is not type(None)]
        assert value is None and len(kinds) < len(typing.get_args(kind)) or value is not None and len(kinds) == 1, at
        if value is not None:
            holds(kinds[0], value, at)
    elif kind is float:
        assert isinstance(value, (int, float)), f"{at}: {value!r}"
    elif isinstance(kind, type):
        assert isinstance(value, kind), f"{at}: {value!r} is not of {kind}"


#: A box whose second SDO server is 680h and 690h from the start (CiA 301, 7.5.2.33).
BOX = """
[DeviceInfo]
VendorName=None
ProductName=Box
[1000]
ParameterName=Device type
DataType=7
AccessType=ro
DefaultValue=0x191
[1001]
ParameterName=Error register
DataType=5
AccessType=ro
[1201]
ParameterName=Server
ObjectType=9
SubNumber=3
[1201sub0]
ParameterName=n
DataType=5
AccessType=const
DefaultValue=2
[1201sub1]
ParameterName=Request
DataType=7
AccessType=rw
DefaultValue=0x680
[1201sub2]
ParameterName=Reply
DataType=7
AccessType=rw
DefaultValue=0x690
"""


@pytest.fixture
def box(tmp_path):
    (tmp_path / "box.eds").write_text(BOX, encoding="utf-8")
    file = tmp_path / "box.toml"
    file.write_text('sync_counter = 2\n[[drive]]\nmodel = "box.eds"\nnode = 4\nsdo_server = 2\n', encoding="utf-8")
    return file


def spoken(file, seconds, **chosen):
    """What is on the bus while 1000h is read, and with SYNC for so long; the file is the network's alone."""
    world = ferrodrive.World()
    world.add(eds=file.with_name("box.eds"), node=4)
    with ferrodrive.Network(world, **chosen) as network:
        network.wait_for(4)
        assert network.upload(4, 0x1000) == b"\x91\x01\x00\x00"
        network.sync(0.01)
        network.sleep(seconds)
        network.sync(None)
        return [line.split()[-1] for line in world.frames(100)]


def test_a_node_is_asked_by_the_server_that_the_program_or_the_file_names(box):
    by_default = spoken(box, 0.05)
    assert "604#4000100000000000" in by_default and "680#4000100000000000" not in by_default
    for chosen in [{"sdo_servers": {4: 2}}, {"machine": box}]:
        by_second = spoken(box, 0.05, **chosen)
        assert "680#4000100000000000" in by_second and "690#4300100091010000" in by_second, by_second
        assert "604#4000100000000000" not in by_second
    overruled = spoken(box, 0.05, machine=box, sdo_servers={4: 1})
    assert "604#4000100000000000" in overruled and "680#4000100000000000" not in overruled
    with pytest.raises(ferrodrive.MasterError, match="1202h"):
        spoken(box, 0.05, sdo_servers={4: 3})


def test_sync_has_the_counter_that_the_program_or_the_file_names(box):
    """CiA 301, 7.2.5.1: from 1 to the value of 1019h."""

    def counters(**chosen):
        return [frame for frame in spoken(box, 0.045, **chosen) if frame.startswith("080#")]

    assert counters()[:2] == ["080#", "080#"]
    assert counters(sync_counter=3)[:4] == ["080#01", "080#02", "080#03", "080#01"]
    assert counters(machine=box)[:3] == ["080#01", "080#02", "080#01"]
    assert counters(machine=box, sync_counter=3)[:4] == ["080#01", "080#02", "080#03", "080#01"]


@pytest.mark.parametrize(
    ("chosen", "expected"),
    [
        ({"sdo_servers": {4: 0}}, "1 to 128"),
        ({"sdo_servers": {4: 129}}, "1 to 128"),
        ({"sdo_servers": {128: 2}}, "1 to 127"),
        ({"sdo_servers": {-1: 2}}, "1 to 127"),
        ({"sync_counter": 1}, "2 to 240"),
        ({"sync_counter": 241}, "2 to 240"),
        ({"sync_counter": 1 << 40}, "2 to 240"),
    ],
)
def test_a_server_or_counter_out_of_its_range_is_refused(chosen, expected):
    with pytest.raises(ValueError, match=expected):
        ferrodrive.Network(ferrodrive.World(), **chosen)
    with pytest.raises(ValueError, match=expected):
        ferrodrive.Network("socketcand://127.0.0.1:1/can0", **chosen)
