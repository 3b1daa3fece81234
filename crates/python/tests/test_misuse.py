"""What is asked too early, too late, twice or beside something else: it works, or the error names what to do in Python's words."""

import asyncio
import json
import pathlib

import can
import ferrodrive
import pytest
from test_reference import SENSOR

EXAMPLES = pathlib.Path(__file__).resolve().parents[3] / "examples"


@pytest.fixture
def world():
    return ferrodrive.World.machine(EXAMPLES / "base.toml")


@pytest.fixture
def network(world):
    with ferrodrive.Network(world) as network:
        yield network


@pytest.fixture
def base(network):
    network.boot()
    with network.base() as base:
        yield base


def rules(report):
    return [finding["rule"] for finding in report["findings"]]


def test_an_open_base_is_not_another_master_to_its_own_network(world, network, base):
    assert "other_master" not in rules(network.explain(4))
    with ferrodrive.Network(world) as other:
        assert "other_master" in rules(other.explain(4)), "to another one it is"


@pytest.mark.parametrize(
    "ask",
    [lambda it: it.velocity(60), lambda it: it.move(90), lambda it: it.torque(0.5), lambda it: it.home(35)],
    ids=["velocity", "move", "torque", "home"],
)
def test_a_wheel_of_an_open_base_is_not_moved_beside_it(world, network, base, ask):
    before = world[4].shaft_angle_rad
    with pytest.raises(ferrodrive.MasterError, match="a group or a base of this program") as raised:
        ask(network.drive(4))
    error = raised.value
    assert (error.kind, error.node, error.do) == ("in_cycles", 4, ("Move it by that, or close that first",))
    network.sleep(0.5)
    assert world[4].shaft_angle_rad == pytest.approx(before, abs=0.01)
    base.drive(0.2, 0.0, seconds=0.5)
    base.close()
    assert network.drive(4).velocity(60)["reached_after_s"] is not None


def test_a_scan_before_the_drives_have_booted_lists_them(world, network):
    # A drive takes about a second to boot, in which it is deaf.
    report = network.scan()
    assert [(node["node"], node["model"]) for node in report["nodes"]] == [(4, "zlac8030l"), (5, "zlac8030l")]
    booted = {row["node"] for row in report["heard"] if "has booted" in row["text"]}
    assert booted == {4, 5}


@pytest.mark.parametrize(
    "beside",
    [{"mode": "csv"}, {"watchdog": 0.5}, {"linear_m_s": 0.1}, {"turns": (1.0, 1.0)}, {"lag_m": 0.2}, {"wheel_base_m": 0.4}],
    ids=lambda beside: next(iter(beside)),
)
def test_what_the_machine_file_decides_is_not_taken_beside_it(network, beside):
    network.boot()
    with pytest.raises(TypeError, match=f"machine file, which decides {next(iter(beside))}"):
        network.base(**beside)
    with pytest.raises(TypeError, match="wheel_bas"):
        network.base(wheel_bas=0.4)
    network.base(period=0.02, tolerance=3).close()


@pytest.mark.parametrize(
    ("what", "opening"),
    [
        ("the base", lambda network: network.base()),
        ("the group", lambda network: network.group([ferrodrive.Axis(4, "zlac8030l", mode="pv")], period=0.02)),
        # So full that the drives are asked for their PDOs first.
        ("the group", lambda network: network.group([ferrodrive.Axis(4, "zlac8030l", mode="pv")], period=0.0005)),
    ],
    ids=["base", "group", "full"],
)
def test_what_is_opened_before_the_boot_up_names_the_boot_up(network, what, opening):
    with pytest.raises(ferrodrive.NoAnswer, match=f"{what} was not opened, and nothing moves: node 4 does not answer") as raised:
        opening(network)
    assert raised.value.do[0] == "boot its nodes first: network.boot()" and raised.value.node == 4
    network.boot()
    network.base().close()


def test_what_is_closed_is_to_be_opened_again(network):
    network.boot()
    base = network.base()
    base.close()
    for ask in (base.state, base.stop, lambda: base.command(0.1, 0.0), lambda: base.drive(0.1, 0.0, seconds=1)):
        with pytest.raises(ferrodrive.MasterError, match=r"it was closed: open it again, network\.group\(\.\.\) or network\.base"):
            ask()
    base.close()
    network.base().close()


def test_after_its_network_nothing_is_asked_of_a_base_or_a_drive(world):
    network = ferrodrive.Network(world)
    network.boot()
    base, drive = network.base(), network.drive(4)
    network.close()
    for ask in (
        base.state,
        base.stop,
        lambda: base.command(0.1, 0.0),
        lambda: base.drive(0.1, 0.0, seconds=1),
        drive.state,
        network.scan,
        lambda: network.nmt("start"),
        lambda: network.sync(0.01),
    ):
        with pytest.raises(RuntimeError, match=r"the network is closed; open another one: Network\(bus\)"):
            ask()
    base.close()


def test_a_twist_beyond_the_limits_is_driven_on_its_circle_and_reported_so(world, base):
    before = world.body("base").state()["x_m"]
    taken = base.drive(5.0, 0.0, seconds=2)
    # linear_m_s of the file; at 0.8 m/s^2 it takes a second to come to that, and another to rest.
    assert taken == {"linear_m_s": pytest.approx(0.8), "angular_rad_s": 0.0, "limited": True}
    assert world.body("base").state()["x_m"] - before == pytest.approx(0.8 * 2, abs=0.05)
    # The outer wheel would go at 1.6 + 1.0 * 0.4 / 2 = 1.8 m/s: both are brought down to its 0.8 m/s.
    taken = base.command(1.6, 1.0)
    assert (taken["linear_m_s"], taken["angular_rad_s"]) == pytest.approx((1.6 * 0.8 / 1.8, 0.8 / 1.8))
    assert taken["limited"] and not base.command(0.3, 0.2)["limited"]


def test_a_guessed_model_is_moved_and_not_stored():
    world = ferrodrive.World()
    world.add("zlac8030l", node=4)
    world.wait_until_booted()
    with ferrodrive.Network(world) as network:
        drive = network.drive(4)
        assert (drive.model, drive.guessed) == ("zlac8030l", True)
        assert drive.velocity(60)["reached_after_s"] is not None and world[4].velocity_rpm == pytest.approx(60, abs=2)
        drive.stop()
        for ask in (drive.save, drive.restore):
            with pytest.raises(ferrodrive.MasterError, match="zlim42c") as raised:
                ask()
            assert raised.value.kind == "guessed_model" and 'network.drive(4, "zlac8030l")' in raised.value.do[-1]
        named = network.drive(4, "zlac8030l")
        assert not named.guessed
        named.save()


def test_of_models_with_the_same_objects_none_is_taken_for_sure():
    # The joints have one identity and the same objects.
    world = ferrodrive.World()
    world.add("m4230e17b50", node=1)
    world.wait_until_booted()
    with ferrodrive.Network(world) as network:
        drive = network.drive(1)
        assert drive.guessed
        with pytest.raises(ferrodrive.MasterError) as raised:
            drive.save()
        assert raised.value.kind == "guessed_model"
        named = network.drive(1, "m4230e17b50")
        assert not named.guessed
        named.save()
    # One that another network has guessed says nothing here.
    with ferrodrive.Network(world) as network:
        with pytest.raises(RuntimeError, match="network.drive\\(1\\) again"):
            ferrodrive.Drive(network, 1, "m4230e17b50", guessed=True).enable()


@pytest.mark.parametrize(
    "do",
    [
        lambda drive: drive.set_object(0x10000, 0, 1),
        lambda drive: drive.set_object(0x6000, 256, 1),
        lambda drive: drive.send_pulses(2**200, 1.0),
    ],
    ids=["index", "sub-index", "pulses"],
)
def test_a_whole_number_out_of_range_is_refused_with_what_it_is(do):
    world = ferrodrive.World()
    drive = world.add("m4230e17b50", node=1)
    with pytest.raises(ferrodrive.Refused, match="out of range for"):
        do(drive)


def test_a_node_that_nothing_speaks_for_is_to_be_named(tmp_path):
    sheet = tmp_path / "sensor.eds"
    sheet.write_text(SENSOR, encoding="utf-8")
    world = ferrodrive.World()
    world.add(eds=sheet, node=7)
    with ferrodrive.Network(world) as network:
        network.wait_for(7)
        with pytest.raises(ferrodrive.MasterError, match="node 7: its identity and objects do not show its model") as raised:
            network.drive(7)
        assert raised.value.kind == "unknown_model" and 'network.drive(7, "MODEL")' in raised.value.do[0]
        # Not a matter of the model.
        with pytest.raises(ferrodrive.NoAnswer, match="node 9"):
            network.drive(9)


def test_a_boot_up_of_a_node_that_the_file_does_not_have_names_those_that_it_has(network):
    with pytest.raises(ferrodrive.BadRequest, match="node 9 is to be booted, and the file does not have it") as raised:
        network.boot(nodes=[9])
    assert raised.value.do == ("its nodes: 4, 5",)


def test_a_cycle_that_the_bus_cannot_carry_is_refused_before_anything_is_written():
    world = ferrodrive.World()
    for node in (5, 6):
        world.add("cia402", node=node)
    with ferrodrive.Network(world) as network:
        network.boot()
        before = [network.upload(node, 0x1A00, sub) for node in (5, 6) for sub in (0, 1)]
        axes = [ferrodrive.Axis(node, "cia402", mode="csp") for node in (5, 6)]
        # SYNC and four PDOs of 6 bytes: 47 + 4 * (47 + 48) bits at least, of 2 us each, are 854 us.
        with pytest.raises(ferrodrive.MasterError, match="does not fit the bus") as raised:
            network.group(axes, period=0.0005)
        assert raised.value.kind == "bus_load" and "network.plan(cycle=0.0005)" in raised.value.do[-1]
        assert [network.upload(node, 0x1A00, sub) for node in (5, 6) for sub in (0, 1)] == before
        assert network.drive(5).state()["power"] == "Switch on disabled"
        network.group(axes, period=0.002).close()
        wheels = ((5, "cia402"), (6, "cia402"))
        limits = {"linear_m_s": 0.1, "angular_rad_s": 1.0, "wheel_m_s": 0.1, "wheel_m_s2": 1.0}
        with pytest.raises(ferrodrive.MasterError, match="the base was not opened: a cycle of 0.5 ms"):
            network.base(*wheels, wheel_base_m=0.4, wheel_radius_m=0.1, period=0.0005, **limits)


def test_advice_names_calls_of_this_package(network, tmp_path):
    network.boot()
    report = network.explain(4)
    assert "network.drive(4).enable()" in json.dumps(report["findings"]) and "ferrodrive " not in json.dumps(report)
    network.nmt("stop", 4)
    assert 'network.nmt("start", 4)' in network.explain(4)["findings"][0]["remedy"]
    network.nmt("start", 4)
    network.sleep(0.1)
    network.drive(4).enable()
    wanted = tmp_path / "wanted.toml"
    wanted.write_text('[values]\n"2000h:00" = 500\n', encoding="utf-8")
    with pytest.raises(ferrodrive.MasterError) as raised:
        network.params(4).apply(wanted)
    assert raised.value.kind == "at_work" and "network.drive(4).disable()" in " ".join(raised.value.do)
    assert "ferrodrive " not in str(raised.value)


def test_what_a_network_does_as_a_whole_has_coroutines(world):
    async def main(network):
        # Both at the same time: each hears of the drives when they boot.
        _, found = await asyncio.gather(network.async_wait_for(4), network.async_scan())
        assert [node["node"] for node in found["nodes"]] == [4, 5]
        with pytest.raises(ferrodrive.NoAnswer, match="node 9"):
            await network.async_wait_for(9, within=0.1)
        assert (await network.async_boot())["ok"] and (await network.async_check())["ok"]
        assert (await network.async_plan())["moved"] == "the base"
        began = world.now
        both = await asyncio.gather(network.async_explain(4, watch=0.5), network.async_explain(5, watch=0.5))
        assert [report["node"] for report in both] == [4, 5] and world.now - began < 0.9
        with pytest.raises(ferrodrive.MasterError):
            await network.async_boot(nodes=[9])

    with ferrodrive.virtual_time(world), ferrodrive.Network(world) as network:
        asyncio.run(main(network))


@pytest.mark.parametrize(
    ("says", "ask"),
    [
        ("rpm is '60rpm'", lambda drive, wheel: drive.velocity("60rpm")),
        ("degrees is '90 deg'", lambda drive, wheel: drive.move("90 deg")),
        ("speed_rpm is 'fast'", lambda drive, wheel: drive.move(90, speed_rpm="fast")),
        ("acceleration_rpm_s is '1'", lambda drive, wheel: drive.velocity(60, acceleration_rpm_s="1")),
        ("current_a is 'x'", lambda drive, wheel: drive.torque("x")),
        ("within is '5 s'", lambda drive, wheel: drive.home(35, within="5 s")),
        ("torque_nm is '2Nm'", lambda drive, wheel: wheel.set_load_torque("2Nm")),
        ("voltage_v is '48V'", lambda drive, wheel: wheel.set_supply("48V")),
        ("viscous_nm_s is None", lambda drive, wheel: wheel.set_load_friction(0.2, None)),
        ("probability is '1%'", lambda drive, wheel: wheel._world.corrupt("1%")),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_a_text_where_a_number_belongs_is_named_with_its_parameter(world, network, says, ask):
    with pytest.raises(TypeError) as raised:
        ask(network.drive(4, "zlac8030l"), world[4])
    assert str(raised.value) == f"{says}; expected a number"


def test_a_pace_that_is_none_is_named(world):
    with pytest.raises(ValueError, match="pace is 'fast'; expected 'virtual', or virtual seconds for each second of the clock"):
        can.Bus(interface="ferrodrive", channel=world, pace="fast")
