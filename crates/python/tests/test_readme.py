"""The programs of the front pages, of the package and of the project, run as they stand and do what the pages say."""

import pathlib
import re
import subprocess
import sys
import time

import ferrodrive
import pytest

ROOT = pathlib.Path(__file__).resolve().parents[3]
PAGE = (ROOT / "crates" / "python" / "README.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```python\n(.*?)```(?:\n\nprints\n\n```text\n(.*?)```)?", PAGE, re.DOTALL)
PROGRAMS = [(code, prints) for code, prints in BLOCKS if "import pytest" not in code]
TESTS = [code for code, _ in BLOCKS if "import pytest" in code]


def test_the_page_has_programs_of_both_kinds():
    assert len(PROGRAMS) == 3 and len(TESTS) == 1
    assert any(prints for _, prints in PROGRAMS)


@pytest.mark.parametrize(("code", "prints"), PROGRAMS, ids=["client", "scenario", "master"])
def test_a_program_of_the_page_runs(code, prints):
    made = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, timeout=120)
    assert made.returncode == 0, made.stderr
    assert made.stdout == prints if prints else made.stdout


@pytest.mark.parametrize("code", TESTS, ids=["plugin"])
def test_a_test_of_the_page_passes(code, tmp_path):
    path = tmp_path / "test_page.py"
    path.write_text(code, encoding="utf-8")
    words = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", str(path)]
    made = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert made.returncode == 0 and "1 passed" in made.stdout, made.stdout


def test_the_program_of_the_project_s_page_turns_a_drive():
    page = (ROOT / "README.md").read_text(encoding="utf-8")
    (code,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    made = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert made.returncode == 0, made.stderr
    # What its last line says in its comment.
    assert made.stdout.strip() == code.strip().rsplit("# ", 1)[1]


def test_the_client_of_the_handbook_turns_a_drive_that_has_just_been_started():
    code = (ROOT / "examples" / "socketcand_client.py").read_text(encoding="utf-8")
    assert "port=29536" in code
    # As the page starts it, but at a port that is free.
    with ferrodrive.Simulator(["zlac8030l@4"]) as simulator:
        code = code.replace("port=29536", f"port={simulator.port()}")
        made = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
        assert made.returncode == 0, made.stderr
        # CiA 301, 7.2.4.3.3: 60h answers a download.
        answers = [line.split()[0] for line in made.stdout.splitlines()]
        assert answers == ["60"] * 5, made.stdout
        deadline = time.monotonic() + 30
        # A ZLAC8030L has 4096 counts in a turn; the watch over its host lets it turn for a second.
        while simulator.world("4 get")["position"] < 1000:
            assert time.monotonic() < deadline, "it did not turn"
            time.sleep(0.05)


def test_the_recipes_for_ci_keep_wheels_by_version_and_python_and_end_what_hangs():
    page = (ROOT / "docs" / "handbook" / "ci.md").read_text(encoding="utf-8")
    recipes = [recipe for recipe in re.findall(r"```yaml\n(.*?)```", page, re.DOTALL) if "pip wheel" in recipe]
    assert len(recipes) == 2
    for recipe in recipes:
        key = re.search(r"^ *key: (.*)$", recipe, re.MULTILINE)[1]
        # GitLab's reference, cache:key: no "/"; what a variable brings counts.
        assert "/" not in key and "python" in key and "FERRODRIVE_AT" in key, key
        assert "FERRODRIVE_AT: main\n" in recipe and "@$FERRODRIVE_AT" in recipe
        assert re.search(r"^ *timeout(-minutes)?: 20", recipe, re.MULTILINE) and "pytest --timeout" in recipe
        # Once where it is written, once where it is kept.
        assert recipe.count("drives.xml") == 2
