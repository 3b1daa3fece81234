"""Runs tests in virtual time many times while the machine is kept busy, and compares: all green, the same digests each time.

    python examples/repeat_tests.py --times 50 --busy 2 examples/mobile_base_tests examples/arm_tests

The tests write a line with each run's digest to the file that FERRODRIVE_DIGESTS names, as the `conftest.py` there do.
"""

import argparse
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time


def main():
    arguments = parse()
    busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(arguments.busy)]
    try:
        runs = [run(arguments.folders, number) for number in range(arguments.times)]
    finally:
        for process in busy:
            process.kill()
            process.wait()
    took = [seconds for _, seconds, _ in runs]
    digests = {test: {digests.get(test) for _, _, digests in runs} for test in sorted(runs[0][2])}
    differ = [test for test, seen in digests.items() if len(seen) != 1 or None in seen]
    green = sum(ok for ok, _, _ in runs)
    print(f"{green} of {len(runs)} runs green; {len(digests)} tests report a digest, {len(differ)} of them not always the same")
    print(f"a run took {min(took):.1f} to {max(took):.1f} s, in the middle {statistics.median(took):.1f} s")
    for test in differ:
        print(f"  {test}: {digests[test]}")
    return 0 if green == len(runs) and digests and not differ else 1


def run(folders, number):
    """One run: whether it was green, how long it took in s, and the digest of each test."""
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "digests"
        begun = time.monotonic()
        words = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *folders]
        made = subprocess.run(words, env={**os.environ, "FERRODRIVE_DIGESTS": str(path)}, capture_output=True, text=True)
        seconds = time.monotonic() - begun
        lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    if made.returncode != 0:
        print(f"run {number + 1}:\n{made.stdout}")
    return made.returncode == 0, seconds, dict(line.rsplit(" ", 1) for line in lines)


def parse():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", help="what pytest is given")
    parser.add_argument("--times", type=int, default=50)
    parser.add_argument("--busy", type=int, default=os.cpu_count() or 1, help="processes that only use up time meanwhile")
    arguments = parser.parse_args()
    if arguments.times < 1 or arguments.busy < 0:
        parser.error("expected --times of 1 or more, and --busy of 0 or more")
    return arguments


if __name__ == "__main__":
    sys.exit(main())
