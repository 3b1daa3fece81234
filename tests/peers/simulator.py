"""`ferrodrive sim` as a child process: one virtual drive behind a socketcand port, world commands on its stdin."""

import json
import queue
import re
import subprocess
import tempfile
import threading

READY_TIMEOUT_S = 20
ANSWER_TIMEOUT_S = 5


class Simulator:
    """Starts the program, waits for its `ready` line and ends it again, whatever happens in between."""

    def __init__(self, program, drive="zlac8030l@4", seed=1, extra=()):
        self.command_line = [program, "sim", "--drive", drive, "--serve", "socketcand://127.0.0.1:0"]
        self.command_line += ["--seed", str(seed), *extra]
        self.process = None
        self.port = None
        self.lines = queue.Queue()

    def __enter__(self):
        self.errors = tempfile.TemporaryFile("w+")
        self.process = subprocess.Popen(
            self.command_line,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self.errors,
            text=True,
            bufsize=1,
        )
        threading.Thread(target=self._read, daemon=True).start()
        try:
            self.port = self._wait_until_ready()
        except BaseException:
            self._end()
            raise
        return self

    def __exit__(self, *_):
        self._end()

    def world(self, command):
        """Sends one world command and returns its answer; an answer that is not ok is an error."""
        self.process.stdin.write(command + "\n")
        self.process.stdin.flush()
        answer = json.loads(self._line(ANSWER_TIMEOUT_S, f"no answer to the world command {command!r}"))
        if not answer.get("ok"):
            raise AssertionError(f"world command {command!r} refused: {answer}")
        return answer

    def stderr(self):
        self.errors.seek(0)
        return self.errors.read().splitlines()[-10:]

    def _read(self):
        for line in self.process.stdout:
            self.lines.put(line.rstrip("\n"))
        self.lines.put(None)

    def _line(self, timeout_s, otherwise):
        try:
            line = self.lines.get(timeout=timeout_s)
        except queue.Empty:
            raise AssertionError(otherwise) from None
        if line is None:
            raise AssertionError(f"the simulator ended: {' / '.join(self.stderr())}")
        return line

    def _wait_until_ready(self):
        while True:
            line = self._line(READY_TIMEOUT_S, "no line that begins with `ready`")
            if line.startswith("ready"):
                address = re.search(r"socketcand://127\.0\.0\.1:(\d+)", line)
                if not address:
                    raise AssertionError(f"no socketcand address in {line!r}")
                return int(address.group(1))

    def _end(self):
        """Asks the program to quit, and ends the very process that was started if it does not."""
        try:
            self.process.communicate("quit\n", timeout=3)
        except (subprocess.TimeoutExpired, OSError, ValueError):
            self.process.kill()
            self.process.wait()
