"""How many lines of news a control connection carries: values of one drive every 100 us of the bus's time, taken with --clock manual, so
that nothing is dropped; lines a second of the wall clock, and how fast the bus went meanwhile.

    python crates/python/benches/control_news.py target/dist/ferrodrive
"""

import json
import re
import socket
import subprocess
import sys
import time

SIGNALS = ["position_counts", "velocity_rpm", "current_a", "supply_v"]
STEPS = 200
STEP_MS = 20


def main(program):
    arguments = [program, "sim", "--drive", "zlac8030l@4", "--serve", "socketcand://127.0.0.1:0", "--clock", "manual"]
    simulator = subprocess.Popen([*arguments, "--control", "127.0.0.1:0"], stdout=subprocess.PIPE, stdin=subprocess.PIPE, text=True)
    try:
        place = ""
        while "control://" not in place:
            place = simulator.stdout.readline()
        port = int(re.search(r"control://[^:]+:(\d+)", place)[1])
        with socket.create_connection(("127.0.0.1", port)) as connection, connection.makefile("rw") as lines:

            def ask(**request):
                lines.write(json.dumps(request) + "\n")
                lines.flush()
                news = 0
                while "id" not in (line := json.loads(lines.readline())):
                    news += 1
                if not line["ok"]:
                    sys.exit(line["error"]["message"])
                return news

            ask(id=1, request="run", **{"for": "2s"})
            values = [{"node": 4, "signals": SIGNALS}]
            ask(id=2, request="subscribe", values=values, every="100us")
            begin, news = time.perf_counter(), 0
            for _ in range(STEPS):
                news += ask(id=3, request="run", **{"for": f"{STEP_MS}ms"})
            took = time.perf_counter() - begin
            print(f"{news} lines in {took:.2f} s: {news / took:.0f} a second; {STEPS * STEP_MS / 1000 / took:.2f} times real time")
    finally:
        simulator.stdin.close()
        simulator.terminate()
        simulator.wait()


if __name__ == "__main__":
    main(*sys.argv[1:])
