"""What the studio shows a sequence as, a program in Python and one of a shell, moves drives as the sequence did."""

import json
import math
import os
import pathlib
import shutil
import subprocess

import ferrodrive
import pytest

PAGE = pathlib.Path(__file__).parents[2] / "studio" / "page" / "sequence.js"

SHOWN = """
const { commandLine, python, scenario } = await import(process.argv[1]);
const { steps, bus, models } = JSON.parse(process.argv[2]);
console.log(JSON.stringify({ shell: commandLine(steps, bus, models), python: python(steps, bus, models), scenario: scenario(steps, models) }));
"""

BASE = {
    "wheels": [4, 5], "turns": [1, -1], "wheel_base_m": 0.4, "wheel_radius_m": 0.084, "most_m_s": 0.3, "m_per_s2": 0.5, "linear_m_s": 0.1, "angular_rad_s": 0.0,
}  # fmt: skip
MOTION = {
    "shape": "path", "by_deg": 20, "speed_rpm": 20, "frequency_hz": 1, "to_frequency_hz": 5, "periods": 1, "time_s": 0.3, "count": 1,
    "velocity_rpm": 60, "acceleration_rpm_s": 1800, "travel_turns": 2, "following_error_deg": 72, "period_ms": 10, "path": [[0, 0], [0.5, 20], [1, 0]],
}  # fmt: skip


def step(word, node=4, after_s=0.0, **more):
    about = {} if node is None else {"node": node}
    return {"after_s": after_s, "command": {"do": word, **about, **more}}


# Where it brings the wheels in degrees: 30 r/min for 1.5 s are 270, but for a tenth by ramps that are not equal; a circumference is 2 pi 0.084 m,
# and a path back and forth ends where it begins. All of it is relative, so that whatever is left out is missed at the end. A ZLAC8030L stops after a second
# without a frame for it (2000h: quick start guide V1.00, chapter 9).
HELD_S, JOG_RPM = 1.5, 30
BY_HOLD, BY_BASE = 6 * JOG_RPM * HELD_S, 360 * 0.1 / (math.tau * 0.084)
WHERE = {4: BY_HOLD + 90 + BY_HOLD + BY_BASE + 10, 5: -BY_HOLD - BY_BASE - 20}

STEPS = [
    step("nmt", command="start"),
    step("write_parameters", values=[{"object": "6083h:00", "value": "300"}]),
    step("enable"),
    step("velocity", rpm=JOG_RPM, rpm_per_s=None),
    step("stop", after_s=HELD_S),
    step("move", degrees=90, relative=True, rpm=60),
    step("capture", after_s=3, quantities=["velocity"], period_ms=2, duration_ms=50, trigger=None, pre_ms=0, sdo=False),
    step("test_motion", motion=MOTION, quantities=["velocity"], capture_ms=None, sdo=False),
    step("group_jog", None, axes=[{"node": 4, "rpm": JOG_RPM}, {"node": 5, "rpm": -JOG_RPM}], rpm_per_s=300),
    step("group_end", None, after_s=HELD_S),
    step("base_jog", None, **BASE),
    step("group_end", None, after_s=1),
    step("group_move", None, axes=[{"node": 4, "degrees": 10}, {"node": 5, "degrees": -20}], relative=True, rpm=60, rpm_per_s=600, within_s=None),
    step("disable"),
]


# What is sent in cycles of 10 ms, for which a busy machine may be too late: in virtual time only.
IN_CYCLES = ("test_motion", "base_jog", "group_move")


def made(steps, bus):
    """The forms of steps."""
    if shutil.which("node") is None:
        pytest.skip("the page's JavaScript takes node")
    given = {"steps": steps, "bus": bus, "models": [{"node": node, "model": "zlac8030l"} for node in (4, 5)]}
    shown = subprocess.run(["node", "--input-type=module", "-e", SHOWN, PAGE.as_uri(), json.dumps(given)], check=True, capture_output=True, text=True)
    return json.loads(shown.stdout)


def test_a_program_made_of_a_sequence_does_what_was_recorded(monkeypatch, tmp_path):
    program = made(STEPS, "can0")["python"]
    assert "left out" not in program
    world = ferrodrive.World()
    for node in (4, 5):
        world.add("zlac8030l", node=node)
    # Its bus is the world of this test, in which time is virtual.
    network = ferrodrive.Network
    monkeypatch.setattr(ferrodrive, "Network", lambda bus: network(world))
    monkeypatch.chdir(tmp_path)
    exec(compile(program, "made.py", "exec"), {})
    for node, degrees in WHERE.items():
        assert math.degrees(world[node].shaft_angle_rad) == pytest.approx(degrees, rel=0.1)
        assert abs(world[node].velocity_rpm) < 1


@pytest.fixture
def program_path():
    try:
        return ferrodrive.simulator.program()
    except ferrodrive.SimulatorError as error:
        pytest.skip(str(error))


def test_a_scenario_made_of_a_sequence_does_what_was_recorded(program_path, tmp_path):
    program = made(STEPS, "sim")["scenario"]
    # But for the path, which has no line there, and ends where it begins.
    assert [line for line in program.splitlines() if "left out" in line] == ["    # left out: node 4: a test motion along a path of 3 points"]
    where = [
        f"[[expect]]\nafter = 'host'\nthat = '{node} shaft_angle = {math.radians(degrees)} +- {abs(math.radians(0.1 * degrees))}'\n" for node, degrees in WHERE.items()
    ]
    (tmp_path / "made.toml").write_text(program + "\n".join(["", *where]))
    ended = subprocess.run([program_path, "run", "made.toml"], cwd=tmp_path, capture_output=True, text=True)
    assert ended.returncode == 0, f"{program}\n{ended.stdout}\n{ended.stderr}"


def test_a_shell_script_made_of_a_sequence_does_what_was_recorded(program_path, tmp_path):
    steps = [one for one in STEPS if one["command"]["do"] not in IN_CYCLES]
    with ferrodrive.Simulator(["zlac8030l@4", "zlac8030l@5"], extra=["--timing", "ideal"], path=program_path) as simulator:
        script = made(steps, f"socketcand://127.0.0.1:{simulator.port()}/can0")["shell"]
        assert "left out" not in script
        # The command line that is tried, and not another one that is installed.
        tried = {**os.environ, "PATH": os.pathsep.join([os.path.dirname(os.path.abspath(program_path)), os.environ["PATH"]])}
        tried.pop("FERRODRIVE_MACHINE", None)
        ended = subprocess.run(["sh", "-"], input=script, cwd=tmp_path, env=tried, capture_output=True, text=True)
        assert ended.returncode == 0, f"{script}\n{ended.stdout}\n{ended.stderr}"
        for node, degrees in ((4, BY_HOLD + 90 + BY_HOLD), (5, -BY_HOLD)):
            state = simulator.world(f"{node} get")
            # A program ends commands as late as its machine is busy: how far too far is not known.
            assert math.degrees(state["shaft_angle_rad"]) / degrees > 0.7, state
            assert abs(state["velocity_rpm"]) < 1
