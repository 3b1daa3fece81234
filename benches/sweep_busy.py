"""How busy a sweep of short runs keeps its threads, on Linux, also of a machine that has other things to do.

Of each thread that makes runs: how often it waited for something (voluntary switches), and its share of the wall time in which it ran or
was ready to run. The share counts from the start of the process to its end. Programs are measured in turns.

    python sweep_busy.py --rounds 3 ferrodrive [ferrodrive-before ..]
"""

import argparse
import pathlib
import statistics
import subprocess
import tempfile
import time

RUNS = 1000
SCENARIO = """title = "Short"
[machine]
realism = "full"
timing = "device"
drive = [{ model = "zlac8030l", node = 4 }]
[[host]]
do = ["wait 100ms"]
[[expect]]
that = "4 velocity = 0 +- 1"
after = "host"
within = "1ms"
why = "nothing moves it"
"""


def looks(pid):
    """Of each thread: voluntary switches, seconds on a core, seconds in which it was ready and had none."""
    for task in pathlib.Path(f"/proc/{pid}/task").iterdir():
        try:
            status = dict(line.split(":", 1) for line in (task / "status").read_text().splitlines())
            on_core, ready, _ = (task / "schedstat").read_text().split()
            yield task.name, (int(status["voluntary_ctxt_switches"]), int(on_core) / 1e9, int(ready) / 1e9)
        except (OSError, ValueError):
            pass  # it has just ended


def measure(program, jobs, folder):
    begin, threads = time.monotonic(), {}
    words = [program, "run", f"{folder}/short.toml", "--seeds", f"1..{RUNS}", "--jobs", str(jobs), "-o", f"{folder}/{begin}.jsonl"]
    with subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        while process.poll() is None:
            threads.update(looks(process.pid))
            time.sleep(0.005)
    wall = time.monotonic() - begin
    if process.returncode:
        raise SystemExit(f"{program} ended with {process.returncode}")
    workers = sorted(threads.values(), key=lambda thread: -thread[1])[:jobs]
    waits, on_core, ready = (sum(column) for column in zip(*workers))
    return 100 * (on_core + ready) / wall / jobs, waits / RUNS, on_core / RUNS * 1e3


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("programs", nargs="+")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--jobs", type=int, default=2)
    arguments = parser.parse_args()
    rows = {program: [] for program in arguments.programs}
    with tempfile.TemporaryDirectory() as folder:
        pathlib.Path(folder, "short.toml").write_text(SCENARIO)
        for _ in range(arguments.rounds):
            for program, row in rows.items():
                row.append(measure(program, arguments.jobs, folder))
    for program, row in rows.items():
        shares, waits, cpu_ms = zip(*row)
        print(f"{program}: busy or ready {min(shares):.1f} to {max(shares):.1f} %, median {statistics.median(shares):.1f} %;"
              f" {statistics.median(waits):.3f} waits and {statistics.median(cpu_ms):.1f} ms a run")  # fmt: skip


if __name__ == "__main__":
    main()
