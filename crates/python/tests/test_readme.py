"""The programs of the package's front page run as they stand, and print what the page says."""

import pathlib
import re
import subprocess
import sys

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
