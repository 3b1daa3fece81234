"""What the studio shows a sequence as, a program in Python and one of a shell, moves drives as the sequence did."""

import json
import math
import os
import pathlib
import shutil
import subprocess
import sys

import ferrodrive
import pytest

PAGE = pathlib.Path(__file__).parents[2] / "studio" / "page" / "sequence.js"

SHOWN = """
const { commandLine, python } = await import(process.argv[1]);
const { steps, bus, models } = JSON.parse(process.argv[2]);
console.log(JSON.stringify({ shell: commandLine(steps, bus, models), python: python(steps, bus, models) }));
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


# At its end each wheel is where the last move has brought it.
STEPS = [
    step("nmt", command="start"),
    step("write_parameters", values=[{"object": "6083h:00", "value": "300"}]),
    step("enable"),
    step("velocity", rpm=30, rpm_per_s=None),
    step("stop", after_s=0.3),
    step("move", degrees=90, relative=False, rpm=60),
    step("capture", after_s=2, quantities=["velocity"], period_ms=2, duration_ms=50, trigger=None, pre_ms=0, sdo=False),
    step("test_motion", motion=MOTION, quantities=["velocity"], capture_ms=None, sdo=False),
    step("group_jog", None, axes=[{"node": 4, "rpm": 30}, {"node": 5, "rpm": -30}], rpm_per_s=300),
    step("group_end", None, after_s=0.5),
    step("base_jog", None, **BASE),
    step("group_end", None, after_s=1),
    step("group_move", None, axes=[{"node": 4, "degrees": 10}, {"node": 5, "degrees": -20}], relative=False, rpm=60, rpm_per_s=600, within_s=None),
    step("disable"),
]


@pytest.fixture
def simulator():
    if shutil.which("node") is None:
        pytest.skip("the page's JavaScript takes node")
    try:
        path = ferrodrive.simulator.program()
    except ferrodrive.SimulatorError as error:
        pytest.skip(str(error))
    with ferrodrive.Simulator(["zlac8030l@4", "zlac8030l@5"], extra=["--timing", "ideal"], path=path) as simulator:
        yield simulator


@pytest.mark.parametrize("form", ["python", "shell"])
def test_a_program_made_of_a_sequence_does_what_was_recorded(simulator, tmp_path, form):
    bus = f"socketcand://127.0.0.1:{simulator.port()}/can0"
    given = {"steps": STEPS, "bus": bus, "models": [{"node": node, "model": "zlac8030l"} for node in (4, 5)]}
    made = subprocess.run(["node", "--input-type=module", "-e", SHOWN, PAGE.as_uri(), json.dumps(given)], check=True, capture_output=True, text=True)
    program = json.loads(made.stdout)[form]
    assert "left out" not in program
    # The command line that is tried, and not another one that is installed.
    tried = {**os.environ, "PATH": os.pathsep.join([os.path.dirname(os.path.abspath(simulator.command_line[0])), os.environ["PATH"]])}
    tried.pop("FERRODRIVE_MACHINE", None)
    interpreter = [sys.executable] if form == "python" else ["sh"]
    ended = subprocess.run([*interpreter, "-"], input=program, cwd=tmp_path, env=tried, capture_output=True, text=True)
    assert ended.returncode == 0, f"{program}\n{ended.stdout}\n{ended.stderr}"
    for node, degrees in ((4, 10), (5, -20)):
        state = simulator.world(f"{node} get")
        assert math.degrees(state["shaft_angle_rad"]) == pytest.approx(degrees, abs=2), state
        assert abs(state["velocity_rpm"]) < 1
