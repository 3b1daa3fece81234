"""`ferrodrive sim` as a child process: virtual drives in real time, behind a port that any program can reach."""

from __future__ import annotations

import json
import os
import pathlib
import queue
import re
import shutil
import subprocess
import sysconfig
import tempfile
import threading
from collections.abc import Iterable
from types import TracebackType
from typing import Any, Optional

from .control import Control
from .errors import SimulatorError
from .real_time import REAL

READY_TIMEOUT_S = 30
BOOT_TIMEOUT_S = 30
ANSWER_TIMEOUT_S = 10
QUIT_TIMEOUT_S = 5


def program() -> str:
    """Path of the command line: what ``FERRODRIVE_PROGRAM`` names, else the one that came with this package, or one on PATH."""
    if named := os.environ.get("FERRODRIVE_PROGRAM"):
        if (chosen := shutil.which(named)) is None:
            raise SimulatorError(f"FERRODRIVE_PROGRAM is {named!r}, where no program is; name the built program `ferrodrive`, or unset it")
        return chosen
    beside = pathlib.Path(sysconfig.get_path("scripts")) / "ferrodrive"
    found = shutil.which(str(beside)) or shutil.which("ferrodrive")
    if found is None:
        raise SimulatorError(
            "the program `ferrodrive` was not found: neither beside this Python nor on PATH; "
            "`cargo install --path crates/cli` in a clone installs it, and so does the wheel of a release; "
            "one that is elsewhere is named by FERRODRIVE_PROGRAM"
        )
    return found


class Simulator:
    """Starts the program, waits for its ``ready`` line and ends it again, whatever happens in between.

    ::

        with ferrodrive.Simulator(["zlac8030l@4"]) as sim:
            bus = can.Bus(**sim.can_arguments())
            sim.world("4 supply 48")

    :param drives: ``MODEL@NODE[,KEY=VALUE..]`` each
    :param seed: decides everything random; without it the machine file's (``extra=["--machine", FILE]``), or 1
    :param extra: further words of the command line (``ferrodrive sim --help``)
    :param path: the program; without it :func:`program`

    >>> with ferrodrive.Simulator(["zlac8030l@4"]) as sim:
    ...     sim.world("4 supply 48")["ok"]
    True
    """

    def __init__(
        self, drives: Iterable[str], seed: Optional[int] = None, extra: Iterable[str] = (), path: Optional[str] = None
    ) -> None:
        serve = ["--serve", "socketcand://127.0.0.1:0", *([] if seed is None else ["--seed", str(seed)])]
        extra = list(extra)
        self._has_own_control = not any(word.partition("=")[0] == "--control" for word in extra)
        if self._has_own_control:
            serve += ["--control", "127.0.0.1:0"]
        self.command_line = [path or program(), "sim", *serve, *extra]
        self.drives = list(drives)
        for drive in self.drives:
            self.command_line += ["--drive", drive]
        #: The line that says where it listens.
        self.ready = ""
        self._lines: queue.Queue[Optional[str]] = queue.Queue()

    def __enter__(self) -> Simulator:
        self._errors = tempfile.TemporaryFile("w+")
        try:
            self.process = subprocess.Popen(
                self.command_line,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self._errors,
                text=True,
                bufsize=1,
            )
        except OSError as error:
            raise SimulatorError(f"cannot start {self.command_line[0]}: {error}; is it installed, and may this user run it?") from error
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        try:
            while not self.ready.startswith("ready"):
                self.ready = self._line(READY_TIMEOUT_S, "no line that begins with `ready`")
        except BaseException:
            self.quit()
            raise
        return self

    def __exit__(
        self, kind: Optional[type[BaseException]], error: Optional[BaseException], traceback: Optional[TracebackType]
    ) -> None:
        self.quit()

    def wait_until_booted(self, within: float = BOOT_TIMEOUT_S) -> None:
        """Waits until the drives that it was started with, by words or by a machine file, have booted. They begin to when the program is
        ready and take about a second, in which they are deaf, as real ones are.

        :param within: longest time in s
        :raises SimulatorError: one has not by then

        >>> sim.wait_until_booted()
        """
        until = REAL.monotonic() + within
        for node in self._nodes():
            while self.world(f"{node} get")["power"] != "on":
                if REAL.monotonic() > until:
                    raise SimulatorError(f"the drive at node {node} has not booted within {within} s")
                REAL.sleep(0.02)

    def _nodes(self) -> list[int]:
        """The drives that it was started with; those of a machine file need a control connection that this program may use."""
        if self._has_own_control:
            with self.control() as control:
                return [drive["node"] for drive in control.hello["nodes"]]
        places = [re.search(r"@(\d+)[^@]*$", drive) for drive in self.drives]
        return [int(place.group(1)) for place in places if place is not None]

    def port(self, protocol: str = "socketcand") -> int:
        """The port of a listener, as the ``ready`` line names it.

        :raises SimulatorError: it has no listener of this protocol

        >>> sim.port() > 1023
        True
        """
        address = re.search(rf"{protocol}://127\.0\.0\.1:(\d+)", self.ready)
        if address is None:
            raise SimulatorError(f"no {protocol} address in {self.ready!r}")
        return int(address.group(1))

    def can_arguments(self) -> dict[str, Any]:
        """What ``can.Bus`` or ``canopen.Network.connect`` take to reach it.

        With ``tcp_tune`` small segments go out at once, whatever the other side acknowledges.

        >>> sim.can_arguments()["interface"]
        'socketcand'
        """
        place = {"host": "127.0.0.1", "port": self.port()}
        return {"interface": "socketcand", "channel": "can0", "tcp_tune": True, **place}

    def control(self) -> Control:
        """A control connection: events and values as they come, and requests, beside those of others.

        >>> with sim.control() as control:
        ...     control.world("now")["ok"]
        True
        """
        return Control(("127.0.0.1", self.port("control")))

    def world(self, command: str) -> dict[str, Any]:
        """Sends one world command and returns its answer; one that is not ok raises :class:`~ferrodrive.SimulatorError`.

        >>> sim.world("4 get")["node"]
        4
        """
        answer = self.tell(command)
        if not answer.get("ok"):
            raise SimulatorError(f"world command {command!r} refused: {answer.get('error', answer)}")
        return answer

    def tell(self, line: str) -> dict[str, Any]:
        """Sends a line and returns its answer, whatever it is.

        :raises SimulatorError: it has ended, or does not answer in time

        >>> sim.tell("fly")["ok"]
        False
        """
        assert self.process.stdin is not None
        try:
            self.process.stdin.write(line + "\n")
            self.process.stdin.flush()
        except OSError as error:
            raise SimulatorError(f"the simulator ended: {' / '.join(self.stderr())}") from error
        answer: dict[str, Any] = json.loads(self._line(ANSWER_TIMEOUT_S, f"no answer to {line!r}"))
        return answer

    def stderr(self) -> list[str]:
        """The last lines that it wrote to standard error.

        >>> isinstance(sim.stderr(), list)
        True
        """
        self._errors.seek(0)
        return self._errors.read().splitlines()[-10:]

    def quit(self) -> int:
        """Asks the program to quit, and ends the very process that was started if it does not. Returns its exit status.

        >>> sim.quit()
        0
        """
        assert self.process.stdin is not None and self.process.stdout is not None
        try:
            if self.process.poll() is None:
                self.process.stdin.write("quit\n")
            self.process.stdin.close()
            self.process.wait(timeout=QUIT_TIMEOUT_S)
        except (subprocess.TimeoutExpired, OSError, ValueError):
            self.kill()
        # Its output ends with it; not before that is it closed under the thread that reads it.
        self._reader.join(timeout=QUIT_TIMEOUT_S)
        if not self._reader.is_alive():
            self.process.stdout.close()
        return self.process.returncode

    def kill(self) -> None:
        """Ends the process without a word, as a crash of the machine would.

        >>> sim.kill()
        """
        self.process.kill()
        self.process.wait()

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self._lines.put(line.rstrip("\n"))
        self._lines.put(None)

    def _line(self, timeout_s: float, otherwise: str) -> str:
        try:
            line = self._lines.get(timeout=timeout_s)
        except queue.Empty:
            raise SimulatorError(otherwise) from None
        if line is None:
            raise SimulatorError(f"the simulator ended: {' / '.join(self.stderr())}")
        return line
