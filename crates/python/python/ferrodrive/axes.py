"""Several axes as one motion, and a base on two wheels.

::

    lift = [ferrodrive.Axis(1, "m4230e17b50", velocity_rpm=20, acceleration_rpm_s=60, following_error_deg=20),
            ferrodrive.Axis(5, "cia402", mode="csp", velocity_rpm=60, acceleration_rpm_s=300, range_deg=(-360, 360))]
    with network.group(lift) as group:
        group.move([90, -45], within=2)             # degrees; all begin with one SYNC and end together

Drives of a group are stepped in each cycle of SYNC for as long as it is open, on a real bus by the thread of the bus, in a world while
somebody moves it. When one faults, is lost or lags, all come to rest, and the call that waits raises what its drive says.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from types import TracebackType
from typing import TYPE_CHECKING, Any, Optional

from ._native import Base as NativeBase
from ._native import Group as NativeGroup

if TYPE_CHECKING:
    from .master import Network


@dataclass(frozen=True)
class Axis:
    """An axis to be, how it is moved, and what it may do. Angles are those of the output shaft, from the drive's own zero on."""

    #: Its node-ID.
    node: int
    #: Its model, as :func:`~ferrodrive.models` lists them, or ``FILE.eds``.
    model: str
    #: How it is moved in cycles: ``csp`` or ``ip`` by positions, ``csv`` or ``pv`` by speeds.
    mode: str = "ip"
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


class _Open:
    """What is open until it is closed: its drives have power."""

    def __init__(self, network: Network, native: Any) -> None:
        self.network = network
        self._native = native

    def _opened(self, *order: Any) -> None:
        self.network._finish(self._native.open(*order))
        self._keeper = self._native.keep()

    def stop(self) -> None:
        """Comes to rest within the limits, and keeps its power; raises what went wrong before or on the way."""
        self.network._finish(self._native.stop())

    def close(self) -> None:
        """Comes to rest and takes the drives' power. Does nothing the second time, nor after its network, which has stopped it."""
        if not self.network.closed:
            self.network._finish(self._native.close())

    def state(self) -> dict[str, Any]:
        """What the last cycle showed."""
        state: dict[str, Any] = self._native.state()
        return state

    def __exit__(
        self, kind: Optional[type[BaseException]], error: Optional[BaseException], traceback: Optional[TracebackType]
    ) -> None:
        self.close()


class Group(_Open):
    """Several axes that move as one. From :meth:`Network.group`."""

    def __init__(self, network: Network, axes: Sequence[Axis], period: float, tolerance: int) -> None:
        super().__init__(network, NativeGroup(network._native))
        self._opened([_order(axis) for axis in axes], period, tolerance)

    def __enter__(self) -> Group:
        return self

    def move(self, to_deg: Sequence[float], within: Optional[float] = None) -> float:
        """All axes to these positions in degrees, together, in the shortest time or within so many seconds. Waits until they are
        there; returns how long the path takes, in s."""
        time: float = self.network._finish(self._native.move_to(list(to_deg), within))
        return time

    def follow(self, points_deg: Sequence[Sequence[float]]) -> None:
        """Along these points in degrees, one of all axes for each cycle, and to rest after the last. Speeds and accelerations
        between them are held to the limits."""
        self.network._finish(self._native.follow([list(point) for point in points_deg]))


class Base(_Open):
    """A base on two wheels. From :meth:`Network.base`. :meth:`state` has ``x_m``, ``y_m``, ``heading_deg`` by its wheels, from where
    it was opened, the twist that it was told, and the ``cause`` of a stop."""

    def __init__(self, network: Network, order: dict[str, Any], period: float, tolerance: int) -> None:
        super().__init__(network, NativeBase(network._native))
        self._opened(order, period, tolerance)

    def __enter__(self) -> Base:
        return self

    def command(self, linear_m_s: float, angular_rad_s: float) -> None:
        """Drives with this twist from the next cycle on, until a new one comes, and no longer than the watchdog's time. Does not wait."""
        self._native.command(linear_m_s, angular_rad_s)

    def drive(self, linear_m_s: float, angular_rad_s: float, seconds: float) -> None:
        """Drives with this twist for so many seconds, and comes to rest."""
        self.network._finish(self._native.drive(linear_m_s, angular_rad_s, seconds))


def _order(axis: Axis) -> dict[str, Any]:
    jerk = 10.0 * axis.acceleration_rpm_s if axis.jerk_rpm_s2 is None else axis.jerk_rpm_s2
    return {**asdict(axis), "jerk_rpm_s2": jerk}
