"""A control connection to a running simulator: requests, events and values (``docs/control.md``)."""

from __future__ import annotations

import collections
import json
import socket
from collections.abc import Iterable
from types import TracebackType
from typing import Any, Optional, Union

from .errors import Refused, SimulatorError
from .real_time import REAL

#: Events that are kept until the caller reads them; of more, the oldest are dropped.
MOST_NEWS = 10_000

ANSWER_TIMEOUT_S = 10


class Control:
    """A client of ``ferrodrive sim --control``. It waits by the real clock. For one thread; make one for each.

    ::

        with sim.control() as control:
            control.subscribe_events(kinds=["fault"])
            control.world("4 supply 90")
            print(control.wait_for("fault", node=4)["remedy"])

    :param address: host and port, or the path of a Unix socket
    :param token: where the simulator asks for one

    >>> with sim.control() as control:
    ...     number = control.subscribe_events(kinds=["fault"])
    ...     control.world("4 supply 90")["ok"]
    True
    """

    def __init__(self, address: Union[tuple[str, int], str], token: Optional[str] = None) -> None:
        unix = isinstance(address, str)
        self._socket = socket.socket(socket.AF_UNIX if unix else socket.AF_INET, socket.SOCK_STREAM)
        self._buffer = b""
        self._asked = 0
        self._news: collections.deque[dict[str, Any]] = collections.deque(maxlen=MOST_NEWS)
        try:
            self._socket.settimeout(ANSWER_TIMEOUT_S)
            self._socket.connect(address)
            #: What the simulator says of itself: ``program``, ``protocol``, ``nodes``.
            self.hello = self.request("hello", name="ferrodrive for Python", **({} if token is None else {"token": token}))
        except BaseException:
            self._socket.close()
            raise

    def __enter__(self) -> Control:
        return self

    def __exit__(
        self, kind: Optional[type[BaseException]], error: Optional[BaseException], traceback: Optional[TracebackType]
    ) -> None:
        self.close()

    def close(self) -> None:
        """Ends the connection; the simulator goes on.

        >>> control.close()
        """
        self._socket.close()

    def request(self, request: str, **fields: Any) -> dict[str, Any]:
        """Sends a request and returns its answer.

        :raises Refused: it was refused
        :raises SimulatorError: no answer came in time, or the connection was lost

        >>> control.request("world", line="now")["ok"]
        True
        """
        self._asked += 1
        self._send({"id": self._asked, "request": request, **fields})
        until = REAL.monotonic() + ANSWER_TIMEOUT_S
        while (line := self._line(until)) is not None:
            if line.get("id") == self._asked and "ok" in line:
                if line["ok"]:
                    return line
                raise Refused(line["error"]["message"])
            self._keep(line)
        raise SimulatorError(f"no answer to {request!r} within {ANSWER_TIMEOUT_S} s")

    def world(self, line: str) -> dict[str, Any]:
        """Does what a world command says (``4 supply 48``) and returns its answer.

        >>> control.world("4 get")["node"]
        4
        """
        return self.request("world", line=line)

    def subscribe_events(self, nodes: Optional[Iterable[int]] = None, kinds: Optional[Iterable[str]] = None) -> int:
        """Has events sent from now on, of these nodes and kinds or of all; returns the number of the subscription.

        >>> control.subscribe_events()
        1
        """
        wanted = {"nodes": nodes, "kinds": kinds}
        events = {name: list(some) for name, some in wanted.items() if some is not None}
        number: int = self.request("subscribe", events=events)["subscription"]
        return number

    def subscribe_values(self, node: int, signals: Iterable[str], every: str, axis: int = 1) -> int:
        """Has values of an axis sent from now on, each time that ``every`` has passed (``"10ms"``).

        >>> control.subscribe_values(4, ["supply_v"], every="10ms")
        1
        """
        values = [{"node": node, "axis": axis, "signals": list(signals)}]
        number: int = self.request("subscribe", values=values, every=every)["subscription"]
        return number

    def news(self, within: float) -> Optional[dict[str, Any]]:
        """The next of what was subscribed to, or None if there is nothing within so many seconds.

        >>> control.news(within=0.01) is None
        True
        """
        until = REAL.monotonic() + within
        while not self._news:
            line = self._line(until)
            if line is None:
                return None
            self._keep(line)
        return self._news.popleft()

    def wait_for(self, kind: str, node: Optional[int] = None, within: float = ANSWER_TIMEOUT_S) -> dict[str, Any]:
        """The next event of a kind that was subscribed to; events before it are passed over.

        :param within: longest wait in s
        :raises TimeoutError: none came in time

        >>> number = control.subscribe_events()
        >>> control.world("4 power cut")["ok"]
        True
        >>> control.wait_for("power")["node"]
        4
        """
        until = REAL.monotonic() + within
        while (news := self.news(max(0.0, until - REAL.monotonic()))) is not None:
            event: dict[str, Any] = news.get("event", {})
            if event.get("kind") == kind and node in (None, event.get("node")):
                return event
        raise TimeoutError(f"no event {kind!r} within {within} s")

    def _send(self, said: dict[str, Any]) -> None:
        try:
            self._socket.settimeout(ANSWER_TIMEOUT_S)
            self._socket.sendall(json.dumps(said).encode() + b"\n")
        except OSError as error:
            raise SimulatorError(f"the control connection is lost: {error}") from error

    def _keep(self, line: dict[str, Any]) -> None:
        if "subscription" in line and "ok" not in line:
            self._news.append(line)

    def _line(self, until: float) -> Optional[dict[str, Any]]:
        """The next line, or None if it is not there at that moment of the real clock."""
        while b"\n" not in self._buffer:
            # A line that is here already is taken in any case.
            self._socket.settimeout(max(0.001, until - REAL.monotonic()))
            try:
                received = self._socket.recv(65536)
            except socket.timeout:  # TimeoutError from Python 3.10 on
                return None
            except OSError as error:
                raise SimulatorError(f"the control connection is lost: {error}") from error
            if not received:
                raise SimulatorError("the simulator has ended the control connection")
            self._buffer += received
        text, _, self._buffer = self._buffer.partition(b"\n")
        line: dict[str, Any] = json.loads(text)
        return line
