"""Several axes as one motion, and a base on two wheels.

::

    lift = [ferrodrive.Axis(1, "m4230e17b50", velocity_rpm=20, acceleration_rpm_s=60, following_error_deg=20),
            ferrodrive.Axis(5, "cia402", mode="csp", velocity_rpm=60, acceleration_rpm_s=300, range_deg=(-360, 360))]
    with network.group(lift) as group:                  # or network.group("lift"): a [[group]] of the machine file
        group.move([90, -45], within=2)             # degrees; all begin with one SYNC and end together

Drives of a group are stepped in each cycle of SYNC for as long as it is open, on a real bus by the thread of the bus, in a world while
time passes in it. When one faults, is lost or lags, all come to rest, and the call that waits raises what its drive says.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from types import TracebackType
from typing import TYPE_CHECKING, Any, Optional, Union, cast

from ._native import Base as NativeBase
from ._native import Group as NativeGroup
from ._native import Job
from .errors import BusWarning, MasterError
from .reports import BaseState, BaseTwist, GroupState

if TYPE_CHECKING:
    from .master import Network

#: From one SYNC to the next in s, where nothing says it.
GROUP_PERIOD = 0.005
BASE_PERIOD = 0.01


@dataclass(frozen=True)
class Axis:
    """An axis to be, how it is moved, and what it may do. Angles are those behind its gear, from the drive's own zero on.

    >>> ferrodrive.Axis(5, "cia402", mode="csp", velocity_rpm=60).following_error_deg
    72.0
    """

    #: Its node-ID.
    node: int
    #: Its model, as :func:`~ferrodrive.models` lists them, or ``FILE.eds``.
    model: str
    #: How it is moved in cycles: ``csp`` or ``ip`` by positions, ``csv`` or ``pv`` by speeds; None is the first of these that its model has.
    mode: Optional[str] = None
    #: Highest speed in r/min.
    velocity_rpm: float = 30.0
    #: Highest acceleration in (r/min)/s.
    acceleration_rpm_s: float = 60.0
    #: Highest jerk in (r/min)/s^2; None is the acceleration within a tenth of a second.
    jerk_rpm_s2: Optional[float] = None
    #: How far the shaft may be from its set-point before all axes are stopped, in degrees.
    following_error_deg: float = 72.0
    #: Software limits in degrees, low and high; None for an axis that turns without end.
    range_deg: Optional[tuple[float, float]] = None
    #: Turns of the drive's shaft for one turn of the output, which all the others are of; None is what the machine file says, or 1.
    gear_ratio: Optional[float] = None


class _Powered:
    """What is open until it is closed: its drives have power."""

    def __init__(self, network: Network, native: Any) -> None:
        self.network = network
        self._native = native
        self._closing: Optional[Job] = None

    def _keep(self) -> None:
        self._keeper = self._native.keep()

    def _begin_close(self) -> Job:
        # One that was interrupted (Ctrl-C, a coroutine that was cancelled) goes on, and the next call waits for its end.
        job = self._closing = self._closing or self._native.close()
        return job

    def _end_close(self, job: Job) -> None:
        if job.ended:
            self._closing = None


class _Open(_Powered):
    """The same, with calls that wait."""

    def _opened(self, job: Job) -> None:
        self.network._finish(job)
        self._keep()

    def stop(self) -> None:
        self.network._finish(self._native.stop())

    def close(self) -> None:
        if self.network.closed:
            return
        job = self._begin_close()
        try:
            self.network._finish(job, keep=True)
        finally:
            self._end_close(job)

    def __exit__(
        self, kind: Optional[type[BaseException]], error: Optional[BaseException], traceback: Optional[TracebackType]
    ) -> None:
        try:
            self.close()
        except MasterError as moving:
            _raise_or_warn(moving, error)


class _AsyncOpen(_Powered):
    """The same, with coroutines."""

    async def _opened(self, job: Job) -> None:
        await self.network._finish_soon(job)
        self._keep()

    async def stop(self) -> None:
        await self.network._finish_soon(self._native.stop())

    async def close(self) -> None:
        if self.network.closed:
            return
        job = self._begin_close()
        try:
            await self.network._finish_soon(job, keep=True)
        finally:
            self._end_close(job)

    async def __aexit__(
        self, kind: Optional[type[BaseException]], error: Optional[BaseException], traceback: Optional[TracebackType]
    ) -> None:
        try:
            await self.close()
        except MasterError as moving:
            _raise_or_warn(moving, error)


def _raise_or_warn(moving: MasterError, error: Optional[BaseException]) -> None:
    if error is None:
        raise moving
    # What went wrong first is what is raised; that a drive may still be moving is a warning beside it.
    warnings.warn(str(moving), BusWarning, stacklevel=3)


class Group(_Open):
    """Several axes that move as one. From :meth:`Network.group`.

    >>> with network.group([ferrodrive.Axis(5, "cia402", mode="csp", acceleration_rpm_s=300)]) as group:
    ...     round(group.move([90], within=2), 3)
    2.0
    """

    def __init__(self, network: Network, axes: Union[str, Sequence[Axis]], period: Optional[float], tolerance: int) -> None:
        super().__init__(network, NativeGroup(network._native))
        self._opened(_open_group(self._native, axes, period, tolerance))

    def __enter__(self) -> Group:
        return self

    def stop(self) -> None:
        """Comes to rest within its limits, until all axes were seen to stand, and keeps its power.

        :raises MasterError: what went wrong before or on the way; an axis still turns (kind ``group``)

        >>> with network.group([ferrodrive.Axis(5, "cia402", mode="csp")]) as group:
        ...     group.stop()
        """
        super().stop()

    def close(self) -> None:
        """Comes to rest and takes the drives' power. Does nothing the second time, nor after its network, which has stopped it.

        :raises MasterError: a drive was not seen to stand

        >>> group = network.group([ferrodrive.Axis(5, "cia402", mode="csp")])
        >>> group.close()
        """
        super().close()

    def move(self, to_deg: Sequence[float], within: Optional[float] = None) -> float:
        """All axes to these positions, together. Waits until they were seen to stand there; returns how long the path takes, in s. One that
        is interrupted (Ctrl-C), or whose coroutine is cancelled, comes to rest within its limits.

        :param to_deg: a position of each axis in degrees
        :param within: how long it takes in s; without it the shortest time within the limits
        :raises MasterError: a position or the time breaks a limit, and nothing moves; or what stopped the group on its way
        :raises TypeError: a mapping or a text, whose keys or characters would be taken for positions

        >>> with network.group([ferrodrive.Axis(5, "cia402", mode="csp")]) as group:
        ...     round(group.move([10], within=2), 3)
        2.0
        """
        time: float = self.network._finish(self._native.move_to(_positions(to_deg), within))
        return time

    def follow(self, points_deg: Sequence[Sequence[float]]) -> None:
        """Along these points, and to rest after the last. Speeds and accelerations between them are held to the limits.

        :param points_deg: for each cycle a position of each axis in degrees
        :raises MasterError: a point breaks a limit or has another number of axes, and nothing moves; or what stopped the group on its way

        >>> with network.group([ferrodrive.Axis(5, "cia402", mode="csp")]) as group:
        ...     group.follow([[0.0]] * 20)
        """
        self.network._finish(self._native.follow([list(point) for point in points_deg]))

    def follow_file(self, path: Union[str, os.PathLike[str]], *, approach: bool = False, relative: bool = False) -> float:
        """Along a recorded path (CSV: ``t_s`` and a position of each axis by its node, ``1.angle_deg``; a record or capture with positions is
        one too), by a cubic spline at rest at both ends. All of its set-points are held to the limits before anything moves; axes that
        it does not name stay where they are. Waits until they were seen to stand; returns how long the path takes, in s.

        :param approach: leads axes that stand elsewhere to the first point before, by a move within the limits
        :param relative: the path begins where each axis is held
        :raises MasterError: kind ``bad_file``, ``out_of_limits`` with the first time at which a limit is broken, ``not_at_start`` with how far
            each axis is away, and nothing moves; or what stopped the group on its way
        :raises BadRequest: it has positions of a node that is not of the group

        >>> with open("path.csv", "w") as file:
        ...     written = file.write("t_s,5.angle_deg\\n0,0\\n0.5,10\\n1,20\\n")
        >>> with network.group([ferrodrive.Axis(5, "cia402", mode="csp", acceleration_rpm_s=300)]) as group:
        ...     group.follow_file("path.csv", relative=True)
        1.0
        """
        time: float = self.network._finish(self._native.follow_file(os.fspath(path), approach, relative))
        return time

    def state(self) -> GroupState:
        """What the last cycle showed.

        :raises MasterError: it was closed
        :raises RuntimeError: its network is closed

        >>> with network.group([ferrodrive.Axis(5, "cia402", mode="csp")]) as group:
        ...     group.state()["missed_cycles"]
        0
        """
        return cast(GroupState, self._native.state())


class Base(_Open):
    """A base on two wheels. From :meth:`Network.base`.

    >>> with ferrodrive.Network(ferrodrive.World.machine("base.toml")) as network:
    ...     report = network.boot()
    ...     with network.base() as base:
    ...         base.drive(0.2, 0.0, seconds=1)["limited"]
    ...         0.1 < base.state()["x_m"] < 0.3
    False
    True
    """

    def __init__(self, network: Network, order: Optional[dict[str, Any]], period: Optional[float], tolerance: int) -> None:
        super().__init__(network, NativeBase(network._native))
        self._opened(_open_base(self._native, order, period, tolerance))

    def __enter__(self) -> Base:
        return self

    def stop(self) -> None:
        """Comes to rest within its limits, until both wheels were seen to stand, and keeps its power.

        :raises MasterError: a wheel was lost before or on the way, or still turns (kind ``base``)

        >>> base.command(0.3, 0.0)["limited"]
        False
        >>> base.stop()
        """
        super().stop()

    def close(self) -> None:
        """Comes to rest and takes the wheels' power. Does nothing the second time, nor after its network, which has stopped it.

        :raises MasterError: a wheel was not seen to stand

        >>> base.close()
        """
        super().close()

    def command(self, linear_m_s: float, angular_rad_s: float) -> BaseTwist:
        """Drives with this twist from the next cycle on, until a new one comes, and no longer than the watchdog's time. Does not wait. One
        beyond the limits of the base is driven as fast as they allow, on its circle; what is returned is that one, and whether it
        was limited.

        :param linear_m_s: speed along the heading in m/s; ``angular_rad_s`` that of the heading in rad/s, above 0 to the left
        :raises MasterError: it is not a finite number, or a wheel has stopped the base
        :raises RuntimeError: its network is closed

        >>> base.command(0.1, 0.0)["limited"]
        False
        """
        return cast(BaseTwist, self._native.command(linear_m_s, angular_rad_s))

    def drive(self, linear_m_s: float, angular_rad_s: float, seconds: float) -> BaseTwist:
        """Drives with this twist for so many seconds, and comes to rest, until both wheels were seen to stand; also where it is interrupted
        (Ctrl-C). Limits and what is returned are those of :meth:`command`.

        :raises MasterError: what stopped it on its way, or a wheel that still turns (kind ``base``)

        >>> base.drive(5.0, 0.0, seconds=0.5)       # 0.8 m/s is the most of this base
        {'linear_m_s': 0.8, 'angular_rad_s': 0.0, 'limited': True}
        """
        return cast(BaseTwist, self.network._finish(self._native.drive(linear_m_s, angular_rad_s, seconds)))

    def state(self) -> BaseState:
        """What the last cycle showed. Its twist is the one of this cycle: that of :meth:`command` once the wheels have come to it.

        :raises MasterError: it was closed
        :raises RuntimeError: its network is closed

        >>> base.state()["cause"] is None
        True
        """
        return cast(BaseState, self._native.state())


class AsyncGroup(_AsyncOpen):
    """:class:`Group` with coroutines. From :meth:`Network.async_group`; close it, or use it with ``async with``.

    >>> async def main() -> float:
    ...     axis = ferrodrive.Axis(5, "cia402", mode="csp", acceleration_rpm_s=300)
    ...     async with await network.async_group([axis]) as group:
    ...         return round(await group.move([90], within=2), 3)
    >>> with ferrodrive.virtual_time(world):
    ...     asyncio.run(main())
    2.0
    """

    def __init__(self, network: Network) -> None:
        super().__init__(network, NativeGroup(network._native))

    async def _open(self, axes: Union[str, Sequence[Axis]], period: Optional[float], tolerance: int) -> AsyncGroup:
        await self._opened(_open_group(self._native, axes, period, tolerance))
        return self

    async def __aenter__(self) -> AsyncGroup:
        return self

    async def stop(self) -> None:
        """As :meth:`Group.stop`."""
        await super().stop()

    async def close(self) -> None:
        """As :meth:`Group.close`."""
        await super().close()

    async def move(self, to_deg: Sequence[float], within: Optional[float] = None) -> float:
        """As :meth:`Group.move`."""
        time: float = await self.network._finish_soon(self._native.move_to(_positions(to_deg), within))
        return time

    async def follow(self, points_deg: Sequence[Sequence[float]]) -> None:
        """As :meth:`Group.follow`."""
        await self.network._finish_soon(self._native.follow([list(point) for point in points_deg]))

    async def follow_file(self, path: Union[str, os.PathLike[str]], *, approach: bool = False, relative: bool = False) -> float:
        """As :meth:`Group.follow_file`."""
        time: float = await self.network._finish_soon(self._native.follow_file(os.fspath(path), approach, relative))
        return time

    def state(self) -> GroupState:
        """As :meth:`Group.state`, which waits for nothing."""
        return cast(GroupState, self._native.state())


class AsyncBase(_AsyncOpen):
    """:class:`Base` with coroutines. From :meth:`Network.async_base`; close it, or use it with ``async with``.

    >>> async def main(network: ferrodrive.Network) -> bool:
    ...     await network.async_boot()
    ...     async with await network.async_base() as base:
    ...         return (await base.drive(0.2, 0.0, seconds=1))["limited"]
    >>> machine = ferrodrive.World.machine("base.toml")
    >>> with ferrodrive.virtual_time(machine), ferrodrive.Network(machine) as of_base:
    ...     asyncio.run(main(of_base))
    False
    """

    def __init__(self, network: Network) -> None:
        super().__init__(network, NativeBase(network._native))

    async def _open(self, order: Optional[dict[str, Any]], period: Optional[float], tolerance: int) -> AsyncBase:
        await self._opened(_open_base(self._native, order, period, tolerance))
        return self

    async def __aenter__(self) -> AsyncBase:
        return self

    async def stop(self) -> None:
        """As :meth:`Base.stop`."""
        await super().stop()

    async def close(self) -> None:
        """As :meth:`Base.close`."""
        await super().close()

    def command(self, linear_m_s: float, angular_rad_s: float) -> BaseTwist:
        """As :meth:`Base.command`, which waits for nothing."""
        return cast(BaseTwist, self._native.command(linear_m_s, angular_rad_s))

    async def drive(self, linear_m_s: float, angular_rad_s: float, seconds: float) -> BaseTwist:
        """As :meth:`Base.drive`."""
        return cast(BaseTwist, await self.network._finish_soon(self._native.drive(linear_m_s, angular_rad_s, seconds)))

    def state(self) -> BaseState:
        """As :meth:`Base.state`, which waits for nothing."""
        return cast(BaseState, self._native.state())


def _open_group(native: NativeGroup, axes: Union[str, Sequence[Axis]], period: Optional[float], tolerance: int) -> Job:
    if isinstance(axes, str):
        return native.open_of_file(axes, period, tolerance)
    return native.open([_order(axis) for axis in axes], GROUP_PERIOD if period is None else period, tolerance)


def _positions(to_deg: Sequence[float]) -> list[float]:
    """Of a mapping the keys would be taken, which are nodes."""
    if isinstance(to_deg, (Mapping, str, bytes)):
        raise TypeError(f"to_deg is {to_deg!r}; expected a position in degrees of each axis, in the order of the group, e.g. [30, -20]")
    return list(to_deg)


def _open_base(native: NativeBase, order: Optional[dict[str, Any]], period: Optional[float], tolerance: int) -> Job:
    if order is None:
        return native.open_of_file(period, tolerance)
    return native.open(order, BASE_PERIOD if period is None else period, tolerance)


def _order(axis: Axis) -> dict[str, Any]:
    jerk = 10.0 * axis.acceleration_rpm_s if axis.jerk_rpm_s2 is None else axis.jerk_rpm_s2
    return {**asdict(axis), "jerk_rpm_s2": jerk}
