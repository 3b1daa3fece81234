"""Drives `ferrodrive sim` with canopen-python and python-can and compares with the manual's figures.

Each check gets a factory-fresh drive of its own. One line a check on standard output: `ok NAME`,
`FAILED NAME: why` or `skipped NAME: why`. Exit status 1 when a check failed.

    python run.py --program target/debug/ferrodrive [--only WORD] [--list]
"""

import argparse
import importlib
import logging
import sys
import time

from bench import Bench
from checks import CHECKS, Skip

MODULES = ("nmt", "sdo", "power", "motion", "pdo", "faults", "storage", "manual")


def main():
    arguments = parse(sys.argv[1:])
    # The libraries log what the checks provoke on purpose.
    logging.disable(logging.CRITICAL)
    for module in MODULES:
        importlib.import_module(f"zlac8030l.{module}")
    chosen = [check for check in CHECKS if not arguments.only or arguments.only in check.name]
    if arguments.list:
        for check in chosen:
            print(check.name)
        return 0
    failed = sum(not run(check, arguments.program) for check in chosen)
    print(f"{len(chosen)} checks, {failed} failed", flush=True)
    return 1 if failed else 0


def parse(words):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", default="target/debug/ferrodrive", help="the ferrodrive binary")
    parser.add_argument("--only", help="only the checks whose name holds this text")
    parser.add_argument("--list", action="store_true", help="name the checks")
    return parser.parse_args(words)


def run(check, program):
    """Runs one check on a drive of its own, prints its line and returns whether it did not fail."""
    start = time.monotonic()
    bench = None
    try:
        with Bench(program) as bench:
            check.function(bench)
    except Skip as reason:
        print(f"skipped {check.name}: {reason}", flush=True)
    except Exception as error:  # any error of a check, a library or the program is this check's failure
        print(f"FAILED {check.name}: {type(error).__name__}: {error}", flush=True)
        for line in bench.last_words() if bench else ():
            print(f"    {line}", flush=True)
        return False
    else:
        print(f"ok {check.name} ({time.monotonic() - start:.1f} s)", flush=True)
    return True


if __name__ == "__main__":
    sys.exit(main())
