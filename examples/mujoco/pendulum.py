"""The same pendulum twice: with a motor of MuJoCo, and with a drive and its firmware. What the firmware changes, as a picture.

    python examples/mujoco/pendulum.py pendulum.svg

Both have the hub motor's constant, resistance, inertia, friction and peak torque. MuJoCo's `<dcmotor>` gets a position and has a
controller of its own; the drive gets it over CAN, as a target position (607Ah) of the profile position mode.
"""

import math
import pathlib
import sys

import ferrodrive
import mujoco
from engine import HERE, Engine
from host import Host

NODE = 4
COUNTS_PER_TURN = 4096
TARGET_RAD = math.radians(60)
#: The hub motor as a direct-current motor: V s/rad, ohm between two wires, N m of dry friction and N m s/rad of viscous
#: (`crates/plant/src/hub_motors.rs`); the torque at its peak current of 18 A.
CONSTANT, RESISTANCE, DRY_NM, VISCOUS, PEAK_NM = 0.8791, 0.51, 0.099, 0.0036, 13.7
SECONDS = 3.0


def of_mujoco(inertia_kg_m2):
    """Time in s, angle in rad and torque in N m of MuJoCo's own motor after a step of its target."""
    spec = mujoco.MjSpec.from_file(str(HERE / "pendulum.xml"))
    text = spec.to_xml().replace(
        "</mujoco>",
        f'<actuator><dcmotor joint="pivot" motorconst="{CONSTANT}" resistance="{RESISTANCE}" input="pos" '
        f'controller="80 60 6" saturation="{PEAK_NM} 0 0"/></actuator></mujoco>',
    )
    model = mujoco.MjModel.from_xml_string(text)
    model.dof_armature[:], model.dof_frictionloss[:], model.dof_damping[:] = inertia_kg_m2, DRY_NM, VISCOUS
    data = mujoco.MjData(model)
    data.ctrl[0] = TARGET_RAD
    points = []
    while data.time < SECONDS:
        mujoco.mj_step(model, data)
        points.append((data.time, data.qpos[0], data.actuator_force[0]))
    return points


def of_a_drive():
    """The same of the drive, and the inertia that it has."""
    world = ferrodrive.World()
    wheel = world.add("zlac8030l", node=NODE)
    host = Host(world)
    world.wait_until_booted()
    engine = Engine("pendulum.xml", world, {"pivot": NODE})
    host.wait = engine.run
    host.write(NODE, 0x2000, 0, 0, 2)  # it goes on though this host is silent
    host.write(NODE, 0x6060, 0, 1, 1)  # profile position
    host.write(NODE, 0x6081, 0, 60, 4)
    for controlword in (6, 7, 15):
        host.write(NODE, 0x6040, 0, controlword, 2)
    host.write(NODE, 0x607A, 0, wheel.position + round(TARGET_RAD / math.tau * COUNTS_PER_TURN), 4)
    begin = engine.data.time
    host.write(NODE, 0x6040, 0, 0x1F, 2)
    points = []
    while engine.data.time - begin < SECONDS:
        engine.step()
        data = engine.data
        points.append((data.time - begin, data.qpos[0], data.qfrc_applied[0]))
    return points, world.external_shafts()[0].inertia_kg_m2


WIDTH, HEIGHT, LEFT, TOP = 720, 220, 60, 30
COLOURS = {"MuJoCo's dcmotor": "#b45309", "drive with firmware": "#1d4ed8"}


def chart(title, unit, curves, top):
    """One of the two charts: curves over the same time."""
    values = [value for points in curves.values() for _, value in points]
    low, high = min(values), max(values)
    margin = 0.05 * (high - low)
    low, high = low - margin, high + margin

    def at(time_s, value):
        x = LEFT + time_s / SECONDS * (WIDTH - LEFT - 20)
        return f"{x:.1f},{top + (high - value) / (high - low) * HEIGHT:.1f}"

    yield f'<text x="{LEFT}" y="{top - 8}" font-weight="bold">{title}, {unit}</text>'
    yield f'<rect x="{LEFT}" y="{top}" width="{WIDTH - LEFT - 20}" height="{HEIGHT}" fill="none" stroke="#999"/>'
    step = 10 ** math.floor(math.log10(high - low))
    for number in range(math.ceil(low / step), math.floor(high / step) + 1):
        x, y = at(0, number * step).split(",")
        yield f'<text x="{float(x) - 6}" y="{float(y) + 4}" text-anchor="end">{number * step:g}</text>'
        yield f'<line x1="{x}" y1="{y}" x2="{WIDTH - 20}" y2="{y}" stroke="#ddd"/>'
    for second in range(int(SECONDS) + 1):
        x = at(second, low).split(",")[0]
        yield f'<text x="{x}" y="{top + HEIGHT + 16}" text-anchor="middle">{second} s</text>'
    for name, points in curves.items():
        line = " ".join(at(*point) for point in points[::8])
        yield f'<polyline points="{line}" fill="none" stroke="{COLOURS[name]}" stroke-width="1.5"/>'


def picture(curves):
    """An SVG of angle and torque over time."""
    height = TOP + 2 * (HEIGHT + 60)
    lines = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{height}" font-family="sans-serif" font-size="12">']
    lines.append(f'<rect width="{WIDTH}" height="{height}" fill="white"/>')
    angles = {name: [(time_s, math.degrees(rad)) for time_s, rad, _ in points] for name, points in curves.items()}
    torques = {name: [(time_s, torque_nm) for time_s, _, torque_nm in points] for name, points in curves.items()}
    lines += chart("Angle", "degrees", angles, TOP)
    lines += chart("Torque at the shaft", "N m", torques, TOP + HEIGHT + 60)
    for place, (name, colour) in enumerate(COLOURS.items()):
        x = WIDTH - 330 + 160 * place
        lines.append(f'<text x="{x}" y="{TOP - 8}" fill="{colour}">{name}</text>')
    return "\n".join([*lines, "</svg>\n"])


def run():
    drive, inertia_kg_m2 = of_a_drive()
    return {"MuJoCo's dcmotor": of_mujoco(inertia_kg_m2), "drive with firmware": drive}


if __name__ == "__main__":
    target = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "pendulum.svg")
    target.write_text(picture(run()), encoding="utf-8")
    print(f"wrote {target}")
