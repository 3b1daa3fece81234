"""Scenarios from Python: an outcome says what `ferrodrive run` says of the same file."""

import json
import math
import os
import pathlib
import pickle
import runpy
import signal
import subprocess
import sys
import threading
import time

import ferrodrive
import pytest
from ferrodrive.simulator import program

EXAMPLES = pathlib.Path(__file__).resolve().parents[3] / "examples"
STEP_LOSS = EXAMPLES / "scenarios" / "step_loss.toml"

#: A wheel that turns for as long as the test wants, at 10 ms of virtual time a sample.
LONG = """
sample = '10ms'
limit = '20000s'
machine = { drive = [{ model = 'zlac8030l', node = 4 }] }
[[host]]
do = ['4 velocity 60rpm', 'wait 19000s']
"""

ONE_FAILS = """
title = 'One of two'
machine = { drive = [{ model = 'zlac8030l', node = 4 }] }
[parameters]
speed = '60rpm'
[[host]]
do = ['4 velocity {speed}', 'wait 1s']
[[expect]]
that = '4 velocity = 60 +- 3'
after = 'host'
within = '1ms'
[[expect]]
never = '4 velocity > 90'
[figures]
speed = 'last 4 velocity'
rotor = 'last 4 rotor_position'
"""


def of_command_line(*words):
    """What `ferrodrive run --json` prints: numbers with six decimals."""
    made = subprocess.run([program(), "--json", "run", *map(str, words)], capture_output=True, text=True, timeout=300)
    return json.loads(made.stdout)


def rounded(value):
    """The value with its numbers as the command line rounds them."""
    if isinstance(value, dict):
        return {name: rounded(part) for name, part in value.items()}
    if isinstance(value, (list, tuple)):
        return [rounded(part) for part in value]
    return round(value, 6) if isinstance(value, float) else value


@pytest.fixture
def one_fails(tmp_path):
    path = tmp_path / "one.toml"
    path.write_text(ONE_FAILS)
    return path


@pytest.mark.parametrize("path", sorted((EXAMPLES / "scenarios").glob("*.toml")), ids=lambda path: path.stem)
def test_every_worked_scenario_passes_and_is_the_run_of_the_command_line(path):
    outcome = ferrodrive.run(path)
    said = of_command_line(path)
    assert outcome.passed, outcome
    assert f"{outcome.digest:016x}" == said["digest"]
    assert rounded(outcome.figures) == rounded(said["figures"])
    assert rounded([(row.asked, row.seen, row.at) for row in outcome.rows]) == rounded(
        [(row["asked"], row["seen"], row["t"]) for row in said["rows"]]
    )


def test_an_outcome_tells_what_was_expected_and_what_was_not_so(one_fails):
    good = ferrodrive.run(one_fails)
    assert good.passed and good.failures == () and good.last_frames == ()
    assert good.figures["speed"] == pytest.approx(60, abs=3)
    assert math.isnan(good.figures["rotor"]), "this drive measures its rotor: there is no other position of it"
    bad = ferrodrive.run(one_fails, seed=5, set={"speed": "120rpm"})
    assert not bad.passed and bad.seed == 5 and bad.parameters == {"speed": "120rpm"}
    assert [row.verdict for row in bad.expectations] == ["failed", "failed"]
    assert bad.figures["speed"] == pytest.approx(120, abs=3)
    assert len(bad.last_frames) > 10
    assert "line 13: expect never 4 velocity > 90: failed" in str(bad)
    assert bad.last_frames[-1] in str(bad)


def test_the_seed_of_the_file_counts_when_none_is_given(one_fails):
    one_fails.write_text("seed = 11\n" + ONE_FAILS)
    assert ferrodrive.run(one_fails).seed == 11
    assert ferrodrive.run(one_fails, seed=12).seed == 12


def test_a_bad_file_a_strange_parameter_and_a_value_of_no_sense_are_told(tmp_path, one_fails):
    with pytest.raises(FileNotFoundError, match="absent.toml"):
        ferrodrive.run(tmp_path / "absent.toml")
    with pytest.raises(ValueError, match="not a regular file"):
        ferrodrive.run(tmp_path)
    with pytest.raises(ValueError, match="no parameter 'sped'"):
        ferrodrive.run(one_fails, set={"sped": 60})
    with pytest.raises(ValueError, match="one.toml:7"):
        ferrodrive.run(one_fails, set={"speed": "fast"})
    with pytest.raises(TypeError, match="speed is set to"):
        ferrodrive.run(one_fails, set={"speed": None})
    with pytest.raises(OverflowError):
        ferrodrive.run(one_fails, seed=-1)


def test_other_threads_go_on_while_a_scenario_runs(one_fails):
    one_fails.write_text(LONG.replace("19000s", "60s"))
    counted, ended = [0], threading.Event()

    def count():
        while not ended.is_set():
            counted[0] += 1
            time.sleep(0)

    counter = threading.Thread(target=count)
    counter.start()
    before = counted[0]
    ferrodrive.run(one_fails)
    during = counted[0] - before
    ended.set()
    counter.join()
    # With the lock held the counter would not have moved at all.
    assert during > 100


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_ctrl_c_ends_a_run(tmp_path):
    path = tmp_path / "long.toml"
    path.write_text(LONG)
    # A shell may have started us with the signal ignored.
    script = """if True:
        import signal, sys, ferrodrive
        signal.signal(signal.SIGINT, signal.default_int_handler)
        print('begins', flush=True)
        ferrodrive.run(sys.argv[1])
        print('went through')"""
    process = subprocess.Popen([sys.executable, "-c", script, path], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "begins\n"
    time.sleep(0.5)
    process.send_signal(signal.SIGINT)
    out, error = process.communicate(timeout=60)
    assert "KeyboardInterrupt" in error and "went through" not in out


def test_a_sweep_has_each_seed_with_each_value_and_is_pickled():
    sweep = ferrodrive.Sweep(STEP_LOSS, range(1, 4))
    assert len(sweep) == 9
    points = [sweep.point(number) for number in range(9)]
    assert sorted({seed for seed, _ in points}) == [1, 2, 3]
    assert {values["held"] for _, values in points} == {"30ms", "100ms", "333ms"}
    again = pickle.loads(pickle.dumps(sweep))
    assert again.run(4) == sweep.run(4)
    seed, values = sweep.point(4)
    assert ferrodrive.run(STEP_LOSS, seed=seed, set=values).digest == sweep.run(4).digest


def test_a_sweep_is_refused_what_it_has_not(tmp_path):
    sweep = ferrodrive.Sweep(STEP_LOSS, range(1, 4))
    with pytest.raises(IndexError, match="no run 9; its runs are 0 to 8"):
        sweep.run(9)
    with pytest.raises(IndexError):
        sweep.summary().add(9, sweep.run(0))
    for wrong in (range(0), range(1, 10, 2), range(-1, 3)):
        with pytest.raises(ValueError, match="not a range of seeds"):
            ferrodrive.Sweep(STEP_LOSS, wrong)
    with pytest.raises(ValueError, match="more than"):
        ferrodrive.Sweep(STEP_LOSS, range(0, 1 << 40))
    with pytest.raises(FileNotFoundError):
        ferrodrive.Sweep(tmp_path / "absent.toml")


def test_a_summary_counts_a_run_that_could_not_be_made_as_failed(one_fails):
    one_fails.write_text(ONE_FAILS + "[sweep]\nspeed = ['60rpm', 'fast', '120rpm']\n")
    sweep = ferrodrive.Sweep(one_fails)
    summary = sweep.summary()
    summary.add(2, sweep.run(2))
    summary.add(0, sweep.run(0))
    with pytest.raises(ValueError) as refused:
        sweep.run(1)
    summary.add(1, refused.value)
    report = summary.report()
    printed = of_command_line(one_fails, "--seeds", "1..1")
    # Why the command fails is not part of a sum that a program makes.
    assert printed.pop("error")["kind"] == "scenario"
    assert rounded(report) == rounded(printed)
    assert (report["passed"], report["failed"], report["complete"]) == (1, 2, True)
    assert "--set speed=fast" in report["worst"][0]["again"]


#: Each seed is another run, half of which fail.
RANDOM = """
end = '400ms'
machine = { drive = [{ model = 'zlac8030l', node = 4 }] }
[parameters]
volts = 24
name = 'supply'
[sweep]
volts = [20, 24]
name = ['supply', 'nothing']
[[step]]
at = '0s'
do = ['bus corrupt 0.2', '4 {name} {volts}']
[[expect]]
at = '300ms'
that = '4 supply > 22'
[figures]
volts = 'last 4 supply'
rotor = 'last 4 rotor_position'
"""


@pytest.fixture
def random(tmp_path):
    path = tmp_path / "random.toml"
    path.write_text(RANDOM)
    return path


def test_the_lines_of_a_sweep_are_the_file_of_the_command_line_and_of_its_shards(random, tmp_path):
    words = [random, "--seeds", "1..10"]
    one, whole = tmp_path / "one.jsonl", tmp_path / "whole.jsonl"
    printed = of_command_line(*words, "-o", one)
    shards = [tmp_path / f"part-{shard}.jsonl" for shard in (1, 2)]
    processes = [
        subprocess.Popen([program(), "run", *words, "--shard", f"{shard}/2", "-o", path], stdout=subprocess.DEVNULL)
        for shard, path in enumerate(shards, 1)
    ]
    assert [process.wait(timeout=300) for process in processes] == [1, 1]
    assert of_command_line(*words, "--merge", *shards, "-o", whole) == printed
    assert whole.read_bytes() == one.read_bytes()
    sweep = ferrodrive.Sweep(random, range(1, 11))
    summary = sweep.summary()
    lines = [sweep.line(number) for number in range(len(sweep))]
    assert (sweep.head() + "".join(lines)).encode() == one.read_bytes()
    for line in reversed(lines):
        summary.add_line(line)
    del printed["error"]
    assert rounded(summary.report()) == rounded(printed)
    with pytest.raises(ValueError, match="EOF|expected"):
        summary.add_line(lines[0][:20])
    # The same number of runs, with other seeds.
    other = ferrodrive.Sweep(random, range(2, 12)).summary()
    with pytest.raises(ValueError, match="the result of run 0, seed 1, of another sweep"):
        other.add_line(lines[0])
    none = other.report()
    other.add_line(ferrodrive.Sweep(random, range(2, 12)).line(0))
    assert other.report() != none
    with pytest.raises(IndexError):
        ferrodrive.Sweep(random).summary().add_line(lines[-1])


def test_results_are_a_table_of_arrow_with_the_types_of_the_head(random, tmp_path):
    pyarrow = pytest.importorskip("pyarrow", reason="pyarrow is not installed here")
    path = tmp_path / "results.jsonl"
    last = 2**64 - 1
    sweep = ferrodrive.Sweep(random, range(last - 1, last + 1))
    text = sweep.head() + "".join(sweep.line(number) for number in range(len(sweep)))
    path.write_text(text)
    table = ferrodrive.sweep_table(path)
    kinds = {
        "run": pyarrow.uint64(),
        "seed": pyarrow.uint64(),
        "values.name": pyarrow.string(),
        "values.volts": pyarrow.float64(),
        "passed": pyarrow.bool_(),
        "end_s": pyarrow.float64(),
        "figures.rotor": pyarrow.float64(),
        "figures.volts": pyarrow.float64(),
        "digest": pyarrow.string(),
        "asked": pyarrow.string(),
        "seen": pyarrow.string(),
    }
    assert dict(zip(table.schema.names, table.schema.types)) == kinds
    assert table["run"].to_pylist() == list(range(8))
    assert table["seed"].to_pylist() == [last - 1, last] * 4
    # The parameters change in the order of the alphabet, each after the seeds.
    assert table["values.name"].to_pylist() == (["supply"] * 2 + ["nothing"] * 2) * 2
    assert table["values.volts"].to_pylist() == [20.0] * 4 + [24.0] * 4
    assert table["passed"].to_pylist() == [False] * 4 + [True] * 2 + [False] * 2
    assert table["figures.rotor"].null_count == 8, "this drive measures its rotor: there is no other position of it"
    assert table["digest"].null_count == table["end_s"].null_count == 4, "'nothing' is not something that a drive has"
    assert table["asked"].to_pylist()[4] is None and table["asked"].to_pylist()[0] == "4 supply > 22"
    assert [f"{sweep.run(4).digest:016x}"] == table["digest"].to_pylist()[4:5]
    # As a process leaves it that is killed: within a line, behind the head.
    path.write_text(text[:-20])
    with pytest.warns(UserWarning, match="results.jsonl has 7 of its 8 runs"):
        assert ferrodrive.sweep_table(path).num_rows == 7
    path.write_text(sweep.head())
    with pytest.warns(UserWarning, match="0 of its 8"):
        empty = ferrodrive.sweep_table(path)
    assert empty.num_rows == 0 and empty.schema == table.schema
    for other in ("", "[]\n", "notes\n", "{}\n"):
        path.write_text(other)
        with pytest.raises(ValueError, match="results.jsonl, line 1: not the head"):
            ferrodrive.sweep_table(path)
    with pytest.raises(FileNotFoundError):
        ferrodrive.sweep_table(tmp_path / "absent.jsonl")


@pytest.mark.parametrize("engine", ["processes", "ray"])
def test_the_example_makes_the_sweep_of_the_command_line_with_its_workers(engine, random, tmp_path):
    if engine == "ray":
        pytest.importorskip("ray", reason="ray is not installed here")
    words = [random, "--seeds", "1..100"]
    one, results = tmp_path / "one.jsonl", tmp_path / "results.jsonl"
    command = [sys.executable, EXAMPLES / "ray_sweep.py", *words, "--workers", "2", "--engine", engine, "-o", results]
    quiet = {**os.environ, "RAY_USAGE_STATS_ENABLED": "0"}
    made = subprocess.run(command, capture_output=True, text=True, timeout=300, env=quiet)
    assert made.returncode == 1, made.stderr
    report = json.loads(made.stdout.splitlines()[-1])
    printed = of_command_line(*words, "-o", one)
    del printed["error"]
    assert rounded(report) == rounded(printed)
    assert (report["runs"], report["passed"]) == (400, 100)
    assert results.read_bytes() == one.read_bytes()


def test_the_tasks_of_the_example_have_a_quarter_of_a_second_of_work_each():
    example = runpy.run_path(str(EXAMPLES / "ray_sweep.py"))
    tasks = example["Tasks"](100_000, 7, 0.01)
    given = iter(tasks)
    assert next(given) == range(7, 32)
    tasks.took(25, 0.05)  # 2 ms a run: together 6 ms
    assert next(given) == range(32, 32 + 42)
    for _ in range(60):
        tasks.took(1, 0.0)
    assert len(next(given)) == example["MOST_RUNS"]
    for _ in range(60):
        tasks.took(1, 90.0)
    assert len(next(given)) == 1
    numbers = [number for task in example["Tasks"](1000, 3, 0.013) for number in task]
    assert numbers == list(range(3, 1000))
