"""`ferrodrive sim` as a child process: virtual drives behind a socketcand port, world commands on its stdin."""

import json
import queue
import re
import subprocess
import tempfile
import threading
import time

READY_TIMEOUT_S = 30
BOOT_TIMEOUT_S = 30
ANSWER_TIMEOUT_S = 10


class Simulator:
    """Starts the program, waits for its `ready` line and ends it again, whatever happens in between."""

    def __init__(self, program, drives, seed=1, extra=()):
        self.drives = drives
        self.command_line = [program, "sim", "--serve", "socketcand://127.0.0.1:0", "--seed", str(seed), *extra]
        for drive in drives:
            self.command_line += ["--drive", drive]
        self.process = None
        self.ready = ""
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
            self._wait_until_ready()
            self._wait_until_booted()
        except BaseException:
            self.quit()
            raise
        return self

    def __exit__(self, *_):
        self.quit()

    def port(self, protocol="socketcand"):
        """The port of a listener, as the `ready` line names it."""
        address = re.search(rf"{protocol}://127\.0\.0\.1:(\d+)", self.ready)
        if not address:
            raise AssertionError(f"no {protocol} address in {self.ready!r}")
        return int(address.group(1))

    def world(self, command):
        """Sends one world command and returns its answer; an answer that is not ok is an error."""
        answer = self.tell(command)
        if not answer.get("ok"):
            raise AssertionError(f"world command {command!r} refused: {answer}")
        return answer

    def tell(self, line):
        """Sends a line and returns its answer, whatever it is."""
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()
        return json.loads(self._line(ANSWER_TIMEOUT_S, f"no answer to {line!r}"))

    def stderr(self):
        self.errors.seek(0)
        return self.errors.read().splitlines()[-10:]

    def quit(self):
        """Asks the program to quit, and ends the very process that was started if it does not."""
        try:
            self.process.communicate("quit\n", timeout=5)
        except (subprocess.TimeoutExpired, OSError, ValueError):
            self.kill()
        return self.process.returncode

    def kill(self):
        """Ends the process without a word, as a crash of the machine would."""
        self.process.kill()
        self.process.wait()

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

    def _wait_until_booted(self):
        """The drives start when the program does, and take about a second: until then they are deaf."""
        until = time.monotonic() + BOOT_TIMEOUT_S
        for drive in self.drives:
            node = re.search(r"@(\d+)", drive).group(1)
            while self.world(f"{node} get")["power"] != "on":
                if time.monotonic() > until:
                    raise AssertionError(f"the drive {drive} has not booted within {BOOT_TIMEOUT_S} s")
                time.sleep(0.05)

    def _wait_until_ready(self):
        while not self.ready.startswith("ready"):
            self.ready = self._line(READY_TIMEOUT_S, "no line that begins with `ready`")
