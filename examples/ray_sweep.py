"""A sweep of a scenario over workers: those of Ray, or processes of this machine.

    pip install '.' ray          # in the clone
    python examples/ray_sweep.py examples/scenarios/step_loss.toml --seeds 1..20 --workers 2

What comes out is what `ferrodrive run FILE --seeds 1..20 --json` prints, which uses the cores of one machine. Ray uses those of
many: `--address auto` joins a cluster whose machines have the package and, at the same path, the scenario.
"""

import argparse
import concurrent.futures
import json
import multiprocessing
import os
import sys
from collections.abc import Iterable, Iterator
from typing import Any, Optional, Union

import ferrodrive

#: What came of some runs, by their numbers.
Outcomes = list[tuple[int, Union[ferrodrive.Outcome, ValueError]]]
#: Runs that a worker is given at once: a run may take milliseconds, and handing it over takes one.
RUNS_A_TASK = 5
#: Memory of Ray on this machine in bytes for what tasks hand over; an outcome has some kB.
OBJECT_STORE = 100 * 1024 * 1024


def make_runs(sweep: ferrodrive.Sweep, numbers: range) -> Outcomes:
    """What a worker does: makes these runs, and returns what came of each."""
    return [(number, came_of(sweep, number)) for number in numbers]


def came_of(sweep: ferrodrive.Sweep, number: int) -> Union[ferrodrive.Outcome, ValueError]:
    try:
        return sweep.run(number)
    except ValueError as error:  # values that make no sense together: this run has failed, the others go on
        return error


def with_processes(tasks: Iterable[range], sweep: ferrodrive.Sweep, workers: int) -> Iterator[Outcomes]:
    """Yields the results of the tasks, run by processes of this machine."""
    # A process that is forked would have the threads' locks of this one.
    context = multiprocessing.get_context("spawn")
    with concurrent.futures.ProcessPoolExecutor(workers, mp_context=context) as pool:
        waiting: set[concurrent.futures.Future[Outcomes]] = set()
        for task in tasks:
            waiting.add(pool.submit(make_runs, sweep, task))
            while len(waiting) >= 2 * workers:
                done, waiting = concurrent.futures.wait(waiting, return_when=concurrent.futures.FIRST_COMPLETED)
                yield from (future.result() for future in done)
        yield from (future.result() for future in concurrent.futures.as_completed(waiting))


def with_ray(
    tasks: Iterable[range], sweep: ferrodrive.Sweep, workers: int, address: Optional[str] = None
) -> Iterator[Outcomes]:
    """Yields the results of the tasks, run by Ray's workers: of a cluster, or as many as wanted on this machine."""
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
        waiting: list[Any] = []
        for task in tasks:
            waiting.append(remote.remote(shared, task))
            while len(waiting) >= 2 * workers:
                done, waiting = ray.wait(waiting)
                yield from ray.get(done)
        while waiting:
            done, waiting = ray.wait(waiting)
            yield from ray.get(done)
    finally:
        ray.shutdown()


def main() -> int:
    arguments = parse()
    first, last = arguments.seeds
    sweep = ferrodrive.Sweep(arguments.file, range(first, last + 1), dict(arguments.set))
    tasks = (range(at, min(at + RUNS_A_TASK, len(sweep))) for at in range(0, len(sweep), RUNS_A_TASK))
    if arguments.engine == "ray":
        made = with_ray(tasks, sweep, arguments.workers, arguments.address)
    else:
        made = with_processes(tasks, sweep, arguments.workers)
    summary = sweep.summary()
    for outcomes in made:
        for number, came in outcomes:
            summary.add(number, came)
    report = summary.report()
    print(json.dumps(report))
    return 0 if report["ok"] else 1


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", help="the scenario")
    parser.add_argument("--seeds", type=seeds, default=(1, 20), metavar="FIRST..LAST")
    parser.add_argument("--set", type=parameter, action="append", default=[], metavar="NAME=VALUE", help="a parameter's value")
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
