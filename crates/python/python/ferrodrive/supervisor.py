"""A network that is watched: what ``ferrodrive supervise`` does."""

from __future__ import annotations

import os
import warnings
from collections.abc import AsyncIterator, Iterator, Sequence
from types import TracebackType
from typing import TYPE_CHECKING, Optional, Union, cast

from ._native import Supervisor as NativeSupervisor
from .errors import BusWarning, MasterError
from .reports import BootReport, WatchedEvent

if TYPE_CHECKING:
    from .master import Network


class _Watch:
    """A watch over a network that is open until it is closed. Both kinds of supervisor are one."""

    #: What came of the boot-up; that a mandatory node has failed is in it, and raises nothing.
    report: BootReport

    def __init__(self, network: Network) -> None:
        self.network = network
        self._native = NativeSupervisor(network._native)

    def _watch(self, report: BootReport) -> None:
        self.report = report
        self._keeper = self._native.keep()


class Supervisor(_Watch):
    """The watch over a network: lost heartbeats, states, emergency messages with fault and remedy, another master. From
    :meth:`Network.supervise`, which boots it before.

    A node whose supply or cable was away is stopped, identified and configured again; it is not started until :meth:`resume`. While a drive
    that watches this program's heartbeat is out of reach the heartbeat is held back, so that nothing goes on by itself. It watches while
    time passes on the bus: on a virtual one in calls of the network that wait, and never moves a motor.

    >>> with network.supervise() as supervisor:
    ...     world[5].power_cycle()
    ...     supervisor.wait_for("boot_up", within=30)["node"]
    5
    """

    def __init__(self, network: Network, file: Optional[str], nodes: Sequence[int], own_node: int) -> None:
        super().__init__(network)
        self._watch(network._finish(self._native.open(file, list(nodes), own_node)))

    def __enter__(self) -> Supervisor:
        return self

    def __exit__(
        self, kind: Optional[type[BaseException]], error: Optional[BaseException], traceback: Optional[TracebackType]
    ) -> None:
        try:
            self.close()
        except MasterError as kept:
            if error is None:
                raise
            # What went wrong first is what is raised; that a drive still waits for a heartbeat is a warning beside it.
            warnings.warn(str(kept), BusWarning, stacklevel=2)

    def next(self, within: float = 1.0) -> Optional[WatchedEvent]:
        """The next thing that happened, or None if nothing did.

        :param within: longest time to wait, in s
        :raises MasterError: the network was closed

        >>> supervisor.next(within=0.1) is None
        True
        """
        return cast(Optional[WatchedEvent], self.network._finish(self._native.next(within)))

    def events(self, within: float = 1.0) -> Iterator[WatchedEvent]:
        """What happens, one after the other, until nothing did for this time in s.

        >>> world[5].power_cycle()
        >>> "recovered" in [event["kind"] for event in supervisor.events(within=15)]
        True
        """
        while (event := self.next(within)) is not None:
            yield event

    def wait_for(self, kind: str, node: Optional[int] = None, within: float = 5.0) -> WatchedEvent:
        """The next event of a kind; events before it are passed over.

        :param kind: ``boot_up``, ``nmt_state``, ``heartbeat_lost``, ``heartbeat_back``, ``heartbeat_held``, ``heartbeat_released``,
            ``emcy``, ``recovered``, ``not_stopped``, ``another_master``, ``node_twice``, ``event``
        :param within: longest time to wait, in s of the bus
        :raises TimeoutError: it did not happen in this time

        >>> world[5].power_cycle()
        >>> supervisor.wait_for("boot_up", node=5, within=30)["kind"]
        'boot_up'
        """
        clock = self.network._now
        end = clock() + within
        while (left := end - clock()) > 0 and (event := self.next(left)) is not None:
            if _is_wanted(event, kind, node):
                return event
        raise _none_came(kind, within)

    def resume(self, node: int) -> None:
        """Lets a node that came back take part again (NMT start).

        :raises MasterError: it could not be made to stand, and was not started

        >>> supervisor.resume(5)
        """
        self.network._finish(self._native.resume(node))

    def close(self) -> None:
        """Ends the watch; no drive waits for the heartbeat of this program then. Does nothing the second time.

        :raises MasterError: a drive that is out of reach could not be released; it stops for want of the heartbeat

        >>> supervisor.close()
        """
        if not self.network.closed:
            self.network._finish(self._native.close())


class AsyncSupervisor(_Watch):
    """:class:`Supervisor` with coroutines. From :meth:`Network.async_supervise`; close it, or use it with ``async with``.

    >>> async def main() -> None:
    ...     async with await network.async_supervise() as supervisor:
    ...         world[5].power_cycle()
    ...         print((await supervisor.wait_for("boot_up", within=30))["node"])
    >>> with ferrodrive.virtual_time(world):
    ...     asyncio.run(main())
    5
    """

    async def _open(self, file: Optional[str], nodes: Sequence[int], own_node: int) -> AsyncSupervisor:
        self._watch(await self.network._finish_soon(self._native.open(file, list(nodes), own_node)))
        return self

    async def __aenter__(self) -> AsyncSupervisor:
        return self

    async def __aexit__(
        self, kind: Optional[type[BaseException]], error: Optional[BaseException], traceback: Optional[TracebackType]
    ) -> None:
        try:
            await self.close()
        except MasterError as kept:
            if error is None:
                raise
            warnings.warn(str(kept), BusWarning, stacklevel=2)

    async def next(self, within: float = 1.0) -> Optional[WatchedEvent]:
        """As :meth:`Supervisor.next`."""
        return cast(Optional[WatchedEvent], await self.network._finish_soon(self._native.next(within)))

    async def events(self, within: float = 1.0) -> AsyncIterator[WatchedEvent]:
        """As :meth:`Supervisor.events`, for ``async for``."""
        while (event := await self.next(within)) is not None:
            yield event

    async def wait_for(self, kind: str, node: Optional[int] = None, within: float = 5.0) -> WatchedEvent:
        """As :meth:`Supervisor.wait_for`."""
        clock = self.network._now
        end = clock() + within
        while (left := end - clock()) > 0 and (event := await self.next(left)) is not None:
            if _is_wanted(event, kind, node):
                return event
        raise _none_came(kind, within)

    async def resume(self, node: int) -> None:
        """As :meth:`Supervisor.resume`."""
        await self.network._finish_soon(self._native.resume(node))

    async def close(self) -> None:
        """As :meth:`Supervisor.close`."""
        if not self.network.closed:
            await self.network._finish_soon(self._native.close())


def _is_wanted(event: WatchedEvent, kind: str, node: Optional[int]) -> bool:
    return event["kind"] == kind and node in (None, event["node"])


def _none_came(kind: str, within: float) -> TimeoutError:
    return TimeoutError(f"no event {kind!r} within {within} s")


def path_of(file: Optional[Union[str, os.PathLike[str]]]) -> Optional[str]:
    """A file's name as the native half has it."""
    return None if file is None else os.fspath(file)
