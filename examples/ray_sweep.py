"""A sweep of a scenario over workers: those of Ray, or processes of this machine.

    pip install '.[arrow]' ray          # in the clone
    python examples/ray_sweep.py examples/scenarios/step_loss.toml --seeds 1..20 --workers 2 -o results.jsonl

What comes out is what `ferrodrive run FILE --seeds 1..20 -o results.jsonl --json` prints and writes, which uses the cores of one
machine. Ray uses those of many: `--address auto` joins a cluster whose machines have the package and, at the same path, the scenario.
`ferrodrive.sweep_table("results.jsonl")` is a table of Arrow.
"""

import argparse
import collections
import concurrent.futures
import contextlib
import itertools
import json
import math
import multiprocessing
import os
import sys
import time
from collections.abc import Iterable, Iterator
from typing import Any, Optional

import ferrodrive

#: Lines of the results of some runs, in the order of their numbers, and the seconds that they took.
Made = tuple[list[str], float]
#: Work of a task in s: handing it over takes a millisecond, and 100 ms are the least at which that does not count.
WORK_S = 0.25
#: Runs of a task at most, so that a worker that is lost does not cost much.
MOST_RUNS = 10_000
#: Memory of Ray on this machine in bytes for what tasks hand over; a result has some hundred bytes.
OBJECT_STORE = 100 * 1024 * 1024


class Tasks:
    """The runs of a sweep from one on, in tasks of about the same work, as the runs before have shown it."""

    def __init__(self, runs: int, begin: int, seconds_a_run: float) -> None:
        self.runs, self.begin, self.seconds_a_run = runs, begin, seconds_a_run

    def __iter__(self) -> Iterator[range]:
        while self.begin < self.runs:
            size = min(max(round(WORK_S / max(self.seconds_a_run, 1e-9)), 1), MOST_RUNS)
            task = range(self.begin, min(self.begin + size, self.runs))
            self.begin = task.stop
            yield task

    def took(self, runs: int, seconds: float) -> None:
        """Some runs took so long; the last ones count as much as all before, since values differ."""
        self.seconds_a_run = (self.seconds_a_run + seconds / runs) / 2


def make_runs(sweep: ferrodrive.Sweep, numbers: range, at_least_s: float = math.inf) -> Made:
    """What a worker does: makes these runs, or as many of them as take so long."""
    begin = time.perf_counter()
    lines: list[str] = []
    for number in numbers:
        lines.append(sweep.line(number))
        if time.perf_counter() - begin >= at_least_s:
            break
    return lines, time.perf_counter() - begin


def with_processes(tasks: Iterable[range], sweep: ferrodrive.Sweep, workers: int) -> Iterator[Made]:
    """Yields the results of the tasks in their order, made by processes of this machine."""
    # A process that is forked would have the threads' locks of this one.
    context = multiprocessing.get_context("spawn")
    with concurrent.futures.ProcessPoolExecutor(workers, mp_context=context) as pool:
        waiting: collections.deque[concurrent.futures.Future[Made]] = collections.deque()
        for task in tasks:
            waiting.append(pool.submit(make_runs, sweep, task))
            if len(waiting) >= 4 * workers:
                yield waiting.popleft().result()
        yield from (future.result() for future in waiting)


def with_ray(tasks: Iterable[range], sweep: ferrodrive.Sweep, workers: int, address: Optional[str] = None) -> Iterator[Made]:
    """Yields the results of the tasks in their order, made by Ray's workers: of a cluster, or as many as wanted on this machine."""
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    import ray

    if address is None:
        # Seen from nowhere else.
        here: dict[str, Any] = {"num_cpus": workers, "include_dashboard": False, "object_store_memory": OBJECT_STORE}
        ray.init(_node_ip_address="127.0.0.1", log_to_driver=False, **here)
    else:
        ray.init(address=address)
    try:
        remote, shared = ray.remote(make_runs), ray.put(sweep)
        waiting: collections.deque[Any] = collections.deque()
        for task in tasks:
            waiting.append(remote.remote(shared, task))
            if len(waiting) >= 4 * workers:
                yield ray.get(waiting.popleft())
        while waiting:
            yield ray.get(waiting.popleft())
    finally:
        ray.shutdown()


def main() -> int:
    arguments = parse()
    first, last = arguments.seeds
    sweep = ferrodrive.Sweep(arguments.file, range(first, last + 1), dict(arguments.set))
    # Made here, to know how many runs are a task.
    first_lines, first_s = make_runs(sweep, range(len(sweep)), at_least_s=WORK_S)
    tasks = Tasks(len(sweep), len(first_lines), first_s / len(first_lines))
    if arguments.engine == "ray":
        made = with_ray(tasks, sweep, arguments.workers, arguments.address)
    else:
        made = with_processes(tasks, sweep, arguments.workers)
    summary = sweep.summary()
    with contextlib.ExitStack() as stack:
        # As the command line writes it: UTF-8, and line ends of one byte.
        output = stack.enter_context(open(arguments.output, "x", encoding="utf-8", newline="")) if arguments.output else None
        if output:
            output.write(sweep.head())
        for lines, seconds in itertools.chain([(first_lines, first_s)], made):
            tasks.took(len(lines), seconds)
            for line in lines:
                summary.add_line(line)
            if output:
                output.writelines(lines)
    report = summary.report()
    print(json.dumps(report))
    return 0 if report["ok"] else 1


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", help="the scenario")
    parser.add_argument("--seeds", type=seeds, default=(1, 20), metavar="FIRST..LAST")
    parser.add_argument("--set", type=parameter, action="append", default=[], metavar="NAME=VALUE", help="a parameter's value")
    parser.add_argument("-o", "--output", metavar="NAME.jsonl", help="also write the result of each run to this file")
    parser.add_argument("--workers", type=int, default=2, metavar="N", help="how many runs at once; of a cluster, its CPUs")
    parser.add_argument("--engine", choices=("ray", "processes"), default="ray")
    parser.add_argument("--address", help="a cluster of Ray's, e.g. auto")
    arguments = parser.parse_args()
    if arguments.workers < 1:
        parser.error("--workers: expected 1 or more")
    return arguments


def seeds(text: str) -> tuple[int, int]:
    first, _, last = text.partition("..")
    return int(first), int(last)


def parameter(text: str) -> tuple[str, str]:
    name, _, value = text.partition("=")
    return name, value


if __name__ == "__main__":
    sys.exit(main())
