"""Drives at the joints of MuJoCo: energy of the pair, an arm that two masters lead, a gripper, a base, and what goes wrong."""

import math
import pathlib
import re
import time
import xml.etree.ElementTree

import ferrodrive
import numpy
import pytest

mujoco = pytest.importorskip("mujoco")
canopen = pytest.importorskip("canopen")

import pendulum  # noqa: E402
from engine import HERE, Engine  # noqa: E402
from host import Host  # noqa: E402
from reach import COUNTS_PER_TURN, JOINTS, NODES, enable_arm  # noqa: E402
from square import RADIUS_M, TURNS, WHEELS  # noqa: E402

GRAVITY = 9.81


#: 2619h = 7: a brake is fitted (docs/drives/mjoint.md).
BRAKED = {"2619": 7}
#: More than a brake of the motor's rated torque (1 N m) gives behind the reducer of 50, friction and teeth included.
MOST_HOLDING_NM = 2 * 50
#: Of the hub motor: 0.866 * 0.8791 (crates/plant/src/hub_motors.rs).
NM_PER_A = 0.7613


def arm(pose=(0.0, 0.6, -1.2), **options):
    world = ferrodrive.World(bitrate=1_000_000)
    for node in NODES:
        world.add("m4230e17b50", node=node, **options)
    return world, Engine("arm.xml", world, JOINTS, pose=pose)


def energy_j(engine):
    """Of all that moves and stands high in MuJoCo, the drives' rotors as armature with it."""
    engine.model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    mujoco.mj_energyPos(engine.model, engine.data)
    mujoco.mj_energyVel(engine.model, engine.data)
    return float(engine.data.energy.sum())


@pytest.mark.parametrize("rule", ["integrate", "hold", "interpolate"])
def test_the_energy_of_a_pendulum_goes_into_the_friction_of_its_drive(rule):
    """A drive that is not enabled on a shaft of MuJoCo. What MuJoCo loses in 10 s is what the friction of the drive's motor takes over this way,
    and the first swing is as fast as that of one body (the pendulum's equation, its period with the arithmetic-geometric mean)."""
    world = ferrodrive.World()
    world.add("zlac8030l", node=4)
    world.wait_until_booted()
    engine = Engine("pendulum.xml", world, {"pivot": 4}, rule=rule, pose=[1.2])
    shaft = world.external_shafts()[0]
    begin_j, turned, friction_j = energy_j(engine), [], 0.0
    lowest_j = engine.model.body_mass[1] * GRAVITY * -abs(engine.model.body_ipos[1][2])
    before = engine.data.qvel[0]
    for _ in range(10_000):
        engine.step()
        now = engine.data.qvel[0]
        friction_j += (pendulum.DRY_NM * abs(now) + pendulum.VISCOUS * now * now) * 0.001
        if before > 0 >= now or before < 0 <= now:
            turned.append(engine.data.time)
        before = now
    lost_j = begin_j - energy_j(engine)
    swing_j = begin_j - lowest_j
    assert friction_j > 0.2 * swing_j
    assert lost_j == pytest.approx(friction_j, abs=0.005 * swing_j)

    inertia = mujoco_inertia(engine)
    assert engine.model.dof_armature[0] == shaft.inertia_kg_m2
    small_period_s = 2 * math.pi * math.sqrt(inertia / (engine.model.body_mass[1] * GRAVITY * abs(engine.model.body_ipos[1][2])))
    # The amplitude of the first half swing is that of its middle: dry friction takes the same from each.
    expected_s = 0.5 * small_period_s / mean(1, math.cos(0.5 * 1.18))
    assert turned[0] == pytest.approx(expected_s, rel=0.01)


def mujoco_inertia(engine):
    """Of the joint, armature included, in kg m^2."""
    full = engine.model.body_inertia[1].max() + engine.model.body_mass[1] * engine.model.body_ipos[1][2] ** 2
    return full + engine.model.dof_armature[0]


def mean(a, b):
    """The arithmetic-geometric mean."""
    while abs(a - b) > 1e-12:
        a, b = 0.5 * (a + b), math.sqrt(a * b)
    return a


def test_an_arm_is_led_by_our_master_every_2_ms():
    # At its end the group takes the power: brakes hold the arm then.
    world, engine = arm(**BRAKED)
    axes = [
        ferrodrive.Axis(node, "m4230e17b50", mode="ip", velocity_rpm=10, acceleration_rpm_s=60, gear_ratio=50) for node in NODES
    ]
    before = engine.data.qpos.copy()
    with engine.going_on(), ferrodrive.Network(world) as network:
        for node in NODES:
            network.wait_for(node)
        network.sleep(1)
        with network.group(axes, period=0.002) as group:
            positions = [axis["angle_deg"] for axis in group.state()["axes"]]
            group.move([position + way for position, way in zip(positions, (40, -20, 30))], within=2)
            moved = [math.degrees(way) for way in engine.data.qpos - before]
    assert moved == pytest.approx([40, -20, 30], abs=1.0)


def test_an_arm_is_led_by_canopen_python_every_2_ms_and_falls_into_its_brakes_when_its_supply_is_cut():
    world, engine = arm(**BRAKED)
    targets = {}
    with engine.going_on():
        network = canopen.Network()
        network.connect(interface="ferrodrive", channel=world)
        sdo = {node: network.add_node(node, canopen.ObjectDictionary()).sdo for node in NODES}
        time.sleep(2)
        watch = network.send_periodic(0x77F, [5], 0.5)
        for node in NODES:
            for index, value, size in ((0x261C, 1, 2), (0x6060, 7, 1), (0x6040, 0x0F, 2)):
                sdo[node].download(index, 0, value.to_bytes(size, "little"))
            targets[node] = int.from_bytes(sdo[node].upload(0x6064, 0), "little", signed=True)

        def lead(cycles, counts):
            for _ in range(cycles):
                for node in NODES:
                    targets[node] += counts
                    network.send_message(0x500 + node, targets[node].to_bytes(4, "little", signed=True))
                network.sync.transmit()
                time.sleep(0.002)

        before = engine.data.qpos.copy()
        lead(500, 250)
        lead(50, 0)
        expected = 500 * 250 / COUNTS_PER_TURN * math.tau
        assert list(engine.data.qpos - before) == pytest.approx([expected] * 3, abs=0.01)

        # In motion: the shoulder's supply goes, its brake closes by its spring, and no more than that holds it.
        lead(100, 250)
        speed, begin = engine.data.qvel[1], engine.data.qpos[1]
        assert speed > 0.3, "it goes down, with its weight"
        least_rad = 0.5 * inertia_kg_m2(engine, 1) * speed**2 / MOST_HOLDING_NM
        world[2].power_cut()
        fell = []
        for _ in range(200):
            time.sleep(0.002)
            fell.append(engine.data.qpos[1] - begin)
        watch.stop()
        network.disconnect()
    assert world[2].brake == "engaged"
    assert abs(engine.data.qvel[1]) < 1e-3 and abs(fell[-1] - fell[-50]) < 1e-4, "the brake holds it"
    assert fell[-1] > least_rad, "a mass does not stop at once: it falls into the brake"


def inertia_kg_m2(engine, joint):
    """At a joint, as the arm stands, what turns in the drive with it."""
    full = numpy.zeros((engine.model.nv, engine.model.nv))
    mujoco.mj_fullM(engine.model, engine.data, full)
    return full[joint, joint]


@pytest.mark.parametrize("joint", [0, 1])
def test_a_cable_cut_in_motion_stops_a_joint_by_its_own_watch_which_then_holds_its_weight(joint):
    world, engine = arm(pose=(0.0, 0.0, 0.0), **BRAKED)
    host = Host(world)
    world.wait_until_booted()
    host.wait = engine.run
    enable_arm(host)
    engine.run(0.2)
    node = NODES[joint]
    target = world[node].position

    def turn(cycles):
        nonlocal target
        for cycle in range(cycles):
            if cycle % 100 == 0:
                host.send(0x77F, b"\x05")
            target += 250
            host.send(0x500 + node, target.to_bytes(4, "little", signed=True))
            host.send(0x080)
            engine.run(0.002)
        host.hear()

    turn(200)
    assert engine.data.qvel[joint] > 0.3
    world[node].cut_cable()
    turn(1500)  # 1016h:01 has 2 s as delivered
    assert world[node].error_code == 0x20
    assert abs(engine.data.qvel[joint]) < 1e-3
    # Alarm 20h stops and holds (docs/drives/mjoint.md): the motor bears the weight, the brake stays open.
    stood = engine.data.qpos[joint]
    engine.run(1.0)
    assert engine.data.qpos[joint] == pytest.approx(stood, abs=1e-3)
    assert world[node].brake == "released" and world[node].powered


def test_a_brown_out_lets_the_arm_sink():
    world, engine = arm(pose=(0.0, 0.0, 0.0))
    host = Host(world)
    world.wait_until_booted()
    host.wait = engine.run
    for node in NODES:
        host.write(node, 0x6040, 0, 0x0F, 2)
    engine.run(0.5)
    held = engine.data.qpos[1]
    world[2].set_supply(5)
    engine.run(1.0)
    assert engine.data.qpos[1] > held + 0.05, "no brake is fitted: the weight turns the reducer"


def test_a_finger_closes_on_something_stiff_and_presses_with_its_torque():
    world = ferrodrive.World()
    world.add("zlac8030l", node=4)
    host = Host(world)
    world.wait_until_booted()
    engine = Engine("gripper.xml", world, {"finger": 4})
    host.wait = engine.run
    host.write(4, 0x2000, 0, 0, 2)
    host.write(4, 0x6060, 0, 4, 1)  # torque
    for controlword in (6, 7, 15):
        host.write(4, 0x6040, 0, controlword, 2)
    host.write(4, 0x6071, 0, 2000, 2)  # mA
    ramps = []
    for _ in range(2):
        engine.run(2.0)
        ramps.append(pressing_nm(engine))
    # Its torque does not jump: 6087h, 300 mA/s as delivered.
    assert ramps[1] - ramps[0] == pytest.approx(NM_PER_A * 0.3 * 2.0, rel=0.03)
    engine.run(4.0)
    stood = engine.data.qpos[0]
    assert pressing_nm(engine) == pytest.approx(NM_PER_A * 2.0 - pendulum.DRY_NM, rel=0.005)
    engine.run(0.5)
    assert engine.data.qpos[0] == pytest.approx(stood, abs=1e-6)


def test_a_finger_presses_with_no_more_than_the_current_limit_of_its_drive():
    world = ferrodrive.World()
    world.add("zlac8030l", node=4)
    host = Host(world)
    world.wait_until_booted()
    engine = Engine("gripper.xml", world, {"finger": 4})
    host.wait = engine.run
    host.write(4, 0x2015, 0, 10, 2)  # 0.1 A
    host.write(4, 0x2000, 0, 0, 2)
    host.write(4, 0x6060, 0, 4, 1)
    for controlword in (6, 7, 15):
        host.write(4, 0x6040, 0, controlword, 2)
    host.write(4, 0x6071, 0, 2000, 2)  # mA
    engine.run(5.0)
    assert pressing_nm(engine) == pytest.approx(NM_PER_A * 1.0 - pendulum.DRY_NM, rel=0.005)
    # Without it the target is reached; friction may end on either side.
    host.write(4, 0x2015, 0, 300, 2)
    engine.run(4.0)
    assert pressing_nm(engine) == pytest.approx(NM_PER_A * 2.0, abs=1.01 * pendulum.DRY_NM)


def pressing_nm(engine):
    """What the block takes, which is what the drive gives."""
    pressing = -engine.data.qfrc_constraint[0]
    assert pressing == pytest.approx(engine.data.qfrc_applied[0], rel=0.001)
    return pressing


def test_a_base_rolls_on_a_floor_as_far_as_its_wheels_turn():
    world = ferrodrive.World()
    for node in WHEELS.values():
        world.add("zlac8030l", node=node)
    engine = Engine("base.xml", world, WHEELS, turns=TURNS)
    with engine.going_on(), ferrodrive.Network(world) as network:
        for node in WHEELS.values():
            network.wait_for(node)
        network.sleep(1)
        turned = engine.data.qpos[engine.angles].copy()
        begin = engine.data.qpos[0]
        with network.base(
            (4, "zlac8030l"), (5, "zlac8030l"), wheel_base_m=0.4, wheel_radius_m=RADIUS_M, linear_m_s=0.5, angular_rad_s=1.0, wheel_m_s=0.5,
            wheel_m_s2=0.5,
        ) as base:
            base.drive(0.3, 0.0, seconds=2)
            # It returns when both drives were seen to stand, which is below 1 r/min, and their wheels do so in the engine.
            assert numpy.abs(engine.data.qvel[engine.speeds]).max() < math.tau / 60
            went = engine.data.qpos[0] - begin
            rolled = (engine.data.qpos[engine.angles] - turned) * RADIUS_M
            counted = base.state()["x_m"]
    assert list(rolled) == pytest.approx([went] * 2, rel=0.02), "the wheels roll, they do not slip"
    assert counted == pytest.approx(went, rel=0.02)
    assert went > 0.4


def lines_of(svg):
    """The points of each line of a picture."""
    lines = xml.etree.ElementTree.fromstring(svg).findall("{http://www.w3.org/2000/svg}polyline")
    return [numpy.array([point.split(",") for point in line.get("points").split()], float) for line in lines]


def test_what_the_firmware_changes_is_drawn():
    curves = pendulum.run()
    page = HERE.parents[1] / "docs" / "handbook" / "pendulum.svg"
    drawn, shown = lines_of(pendulum.picture(curves)), lines_of(page.read_text(encoding="utf-8"))
    assert len(drawn) == 4
    # To a point of the picture: another processor may round otherwise.
    assert [line.shape for line in drawn] == [line.shape for line in shown]
    assert all(numpy.abs(line - other).max() <= 1 for line, other in zip(drawn, shown)), "python examples/mujoco/pendulum.py docs/handbook/pendulum.svg"
    ends = {name: points[-1][1] for name, points in curves.items()}
    for name, angle in ends.items():
        assert angle == pytest.approx(pendulum.TARGET_RAD, abs=0.1), name
    fastest = {name: max(b[1] - a[1] for a, b in zip(points, points[1:])) * 1000 for name, points in curves.items()}
    # 6081h: 60 r/min is the most that the firmware lets the shaft turn at; MuJoCo's motor goes as fast as it can.
    assert fastest["drive with firmware"] < 1.15 * math.tau < fastest["MuJoCo's dcmotor"]


def test_the_lines_of_the_handbook_run():
    page = (pathlib.Path(__file__).resolve().parents[2] / "docs" / "handbook" / "physics-engine.md").read_text(encoding="utf-8")
    seven, _, several = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    model = mujoco.MjModel.from_xml_path(str(HERE / "arm.xml"))
    names = {"ferrodrive": ferrodrive, "mujoco": mujoco, "model": model, "data": mujoco.MjData(model)}
    exec(seven.replace("while True:", "for _ in range(100):"), names)
    assert names["world"].now == pytest.approx(0.1)
    assert abs(names["data"].qvel[1]) > 0.01, "no drive holds it yet"
    pose = numpy.tile(names["data"].qpos, (64, 1)), numpy.tile(names["data"].qvel, (64, 1))
    names["angle_rad"], names["velocity_rad_s"] = pose
    exec(several, names)
    assert names["torque_nm"].shape == (64, 3)
