"""Drives `ferrodrive sim` with other people's software and compares with the manuals' figures.

Each check gets factory-fresh drives of its own. One line a check on standard output: `ok NAME`,
`FAILED NAME: why` or `skipped NAME: why`. Exit status 1 when a check failed.

    python run.py --program target/debug/ferrodrive [--only WORD] [--jobs N] [--list]
"""

import argparse
import concurrent.futures
import importlib
import logging
import pathlib
import sys
import time

from bench import Bench
from checks import CHECKS, Skip

HERE = pathlib.Path(__file__).resolve().parent
#: Where checks stand: a file for each service, the data sheets, and the servo that is made from one.
MODULES = [f"services.{path.stem}" for path in sorted((HERE / "services").glob("[a-z]*.py"))]
MODULES += ["container", "dbc", "eds", "fmu", "fmu2", "foxglove", "logs", "ls_bus", "recording", "cia402.blocks", "cia402.lss", "cia402.motion", "cia402.makers"]
#: Checks mostly wait for a drive to move, so more of them run at once than the machine has cores.
JOBS = 6


def main():
    arguments = parse(sys.argv[1:])
    load()
    chosen = [number for number, check in enumerate(CHECKS) if not arguments.only or arguments.only in title(check)]
    if arguments.list:
        for number in chosen:
            print(title(CHECKS[number]))
        return 0
    failed = 0
    with concurrent.futures.ProcessPoolExecutor(arguments.jobs, initializer=load) as pool:
        for lines, ended_well in pool.map(run, chosen, [arguments.program] * len(chosen)):
            print("\n".join(lines), flush=True)
            failed += not ended_well
    print(f"{len(chosen)} checks, {failed} failed", flush=True)
    return 1 if failed else 0


def load():
    """Fills the list of checks, in every process alike."""
    # The libraries log what the checks provoke on purpose.
    logging.disable(logging.CRITICAL)
    for module in MODULES:
        importlib.import_module(module)


def title(check):
    return f"{check.drive.name}: {check.name}"


def parse(words):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", default="target/debug/ferrodrive", help="the ferrodrive binary")
    parser.add_argument("--only", help="only the checks whose `drive: name` holds this text")
    parser.add_argument("--jobs", type=int, default=JOBS, help="how many checks run at once")
    parser.add_argument("--list", action="store_true", help="name the checks")
    return parser.parse_args(words)


def run(number, program):
    """Runs one check on drives of its own. Returns its lines, and whether it did not fail."""
    check = CHECKS[number]
    start = time.monotonic()
    bench = None
    try:
        with Bench(program, check.drive, **check.setup) as bench:
            check.function(bench, *check.arguments)
    except Skip as reason:
        return [f"skipped {title(check)}: {reason}"], True
    except Exception as error:  # any error of a check, a library or the program is this check's failure
        words = bench.last_words() if bench else ()
        return [f"FAILED {title(check)}: {type(error).__name__}: {error}", *(f"    {line}" for line in words)], False
    return [f"ok {title(check)} ({time.monotonic() - start:.1f} s)"], True


if __name__ == "__main__":
    sys.exit(main())
