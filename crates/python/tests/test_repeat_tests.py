"""`examples/repeat_tests.py` distinguishes runs that are equal from runs that are not."""

import pathlib
import subprocess
import sys

import pytest

SCRIPT = pathlib.Path(__file__).resolve().parents[3] / "examples" / "repeat_tests.py"

SUITE = """
import os, pathlib
import ferrodrive

def runs_so_far():
    with open("runs", "a+") as file:
        file.write(".")
    return pathlib.Path("runs").stat().st_size

def test_it():
    world = ferrodrive.World()
    world.add("zlac8030l", node={node})
    world.add_probe()  # a frame needs a node that acknowledges it
    world.run_for(2)
    with open(os.environ["FERRODRIVE_DIGESTS"], "a") as file:
        file.write(f"test_it {{world.digest():016x}}\\n")
    assert {so}
"""


@pytest.mark.parametrize(
    ("node", "so", "status", "says"),
    [
        ("4", "True", 0, "2 of 2 runs green; 1 tests report a digest, 0 of them not always the same"),
        ("4", "False", 1, "0 of 2 runs green"),
        ("runs_so_far()", "True", 1, "1 of them not always the same"),
    ],
    ids=["equal", "red", "different"],
)
def test_equal_runs_are_told_from_others(tmp_path, node, so, status, says):
    (tmp_path / "test_suite.py").write_text(SUITE.format(node=node, so=so))
    words = [sys.executable, str(SCRIPT), "--times", "2", "--busy", "1", "."]
    made = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, timeout=200)
    assert says in made.stdout, made.stdout + made.stderr
    assert made.returncode == status
