"""Kills the shards of a sweep again and again (SIGKILL), each time when it has written some more runs, and has each go on: their parts are
the table that one process writes, to the byte.

    python benches/sweep_kills.py --kills 200 target/release/ferrodrive
"""

import argparse
import pathlib
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time

SHARDS = 2
#: Each seed is another run: frames are lost at random.
SCENARIO = """title = "Frames are lost"
end = "400ms"
[machine]
drive = [{ model = "zlac8030l", node = 4 }]
[[step]]
at = "0s"
do = ["bus corrupt 0.2"]
[[host]]
start = "10ms"
do = { do = "4 read 1000", within = "1s" }
[figures]
answered = "time host"
"""


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    program = str(pathlib.Path(shutil.which(arguments.program) or sys.exit(f"{arguments.program} is not a program")).resolve())
    chance = random.Random(arguments.seed)
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        (folder / "random.toml").write_text(SCENARIO)
        # A thread hands over what it made in 20 ms.
        runs = 400 * arguments.kills

        def command(*words):
            return [program, "run", "random.toml", "--seeds", f"1..{runs}", *words]

        def whole(*words):
            subprocess.run(command(*words), cwd=folder, stdout=subprocess.DEVNULL, check=True)

        whole("-o", "one.jsonl")
        parts = [f"part-{shard}.jsonl" for shard in range(1, SHARDS + 1)]
        kills = 0
        for shard, part in enumerate(parts, 1):
            go_on = ("--shard", f"{shard}/{SHARDS}", "--jobs", "1", "-o", part, "--resume")
            for _ in range(arguments.kills // SHARDS):
                enough = size(folder / part) + chance.randrange(1, 2000)
                with subprocess.Popen(command(*go_on), cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
                    while size(folder / part) < enough and process.poll() is None:
                        time.sleep(0.0005)
                    process.kill()
                kills += process.returncode == -signal.SIGKILL
            whole(*go_on)
        whole("-o", "table.jsonl", "--merge", *parts)
        table, one = ((folder / file).read_bytes() for file in ("table.jsonl", "one.jsonl"))
        same = "the same bytes" if table == one else "OTHER BYTES"
        print(f"{kills} kills in the middle: {same} as one process, {table.count(bytes([10])) - 1} of {runs} runs")
        sys.exit(table != one)


def size(path):
    return path.stat().st_size if path.exists() else 0


if __name__ == "__main__":
    main()
