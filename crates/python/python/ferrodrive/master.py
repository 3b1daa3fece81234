"""A CANopen master: drives in physical units, on a virtual bus or a real one, blocking or as asyncio.

::

    with ferrodrive.Network(world) as network:              # or "socketcand://127.0.0.1:29536/can0"
        drive = network.drive(4, "zlac8030l")
        drive.velocity(60)                                   # r/min; waits until it is reached
        print(drive.state()["current_a"])
        drive.stop()

While a call waits, other Python threads run. On a virtual bus time passes as far as the call takes. A network that is closed, or whose
program ends, quick-stops what this program has set in motion.

What a real bus says beside frames (the connection is lost, the controller is bus-off) comes as a :class:`~ferrodrive.BusWarning` with
the next call that waits; a call that fails while the connection is lost says so.
"""

from __future__ import annotations

import asyncio
import atexit
import os
import warnings
import weakref
from collections.abc import Sequence
from types import TracebackType
from typing import Any, Optional, Union

from ._native import Job, model_name
from ._native import Network as NativeNetwork
from .axes import Axis, Base, Group
from .errors import BusWarning, MasterError, Stalled
from .turns import taking_part
from .world import World

_open: weakref.WeakSet[Network] = weakref.WeakSet()


class Network:
    """The network as its master sees it.

    :param bus: a :class:`~ferrodrive.World`, ``socketcand://HOST:PORT/can0`` or ``slcan:///dev/ttyACM0?bitrate=500k``
    :param machine: the machine file that describes what is on a real bus: which models are where, and what stands behind their
        shafts (``units``). :meth:`World.machine` has one already
    """

    def __init__(self, bus: Union[World, str], *, machine: Optional[Union[str, os.PathLike[str]]] = None) -> None:
        self._world = bus if isinstance(bus, World) else None
        if isinstance(bus, World):
            if machine is not None:
                raise ValueError("a world knows its machine file: make it by World.machine(FILE)")
            self._native = NativeNetwork.in_world(bus)
        else:
            self._native = NativeNetwork.on_bus(bus, None if machine is None else os.fspath(machine))
        _open.add(self)

    def __enter__(self) -> Network:
        return self

    def __exit__(
        self, kind: Optional[type[BaseException]], error: Optional[BaseException], traceback: Optional[TracebackType]
    ) -> None:
        try:
            self.close()
        except MasterError as moving:
            if error is None:
                raise
            # What went wrong first is what is raised; that a drive may still be moving is said beside it.
            warnings.warn(str(moving), BusWarning, stacklevel=2)

    def close(self) -> None:
        """Gives up what is still asked of drives, quick-stops what this program has set in motion, and leaves the bus: nothing is
        sent after that. :class:`~ferrodrive.MasterError` if a drive was not seen to stand."""
        if self not in _open:
            return
        _open.discard(self)
        if self._world is None:
            moving: list[str] = self._native.close()
        else:
            moving = self._finish(self._native.close_in_world())
        if moving:
            raise MasterError("; ".join(moving))

    @property
    def closed(self) -> bool:
        """True once it was closed."""
        return self not in _open

    # Waiting for the master.

    def _finish(self, job: Job) -> Any:
        """The result of a job, waited for."""
        try:
            if self._world is None:
                job.wait()
            elif (time := taking_part(self._world)) is not None:
                wait = time.begin("waits for the master")
                time.on_done(job.number, lambda: time.wake(wait))
                time.wait(wait)
            else:
                self._move_world(self._world, job)
        except BaseException:
            job.cancel()
            raise
        return self._result(job)

    def _result(self, job: Job) -> Any:
        """The result of a job that has ended, with what the bus said meanwhile as warnings."""
        for note in self._native.take_notes():
            warnings.warn(note, BusWarning, stacklevel=4)
        return job.result()

    @staticmethod
    def _move_world(world: World, job: Job) -> None:
        while not job.ended:
            came = world.advance(None, [])
            if came is not None and came[0] == "stalled":
                raise Stalled("the master waits, and nothing is left to happen in the world")

    async def _finish_soon(self, job: Job) -> Any:
        """The result of a job, awaited."""
        loop = asyncio.get_running_loop()
        ended: asyncio.Future[None] = loop.create_future()

        def end() -> None:
            if not ended.done():
                ended.set_result(None)

        def tell() -> None:
            loop.call_soon_threadsafe(end)

        if self._world is None:
            job.on_end(tell)
        elif (time := taking_part(self._world)) is not None:
            time.on_done(job.number, tell)
        else:
            job.cancel()
            raise RuntimeError("time stands still in this world: run the loop inside `with ferrodrive.virtual_time(world)`")
        try:
            await ended
        except BaseException:
            job.cancel()
            raise
        return self._result(job)

    # What a network does.

    def drive(self, node: int, model: Optional[str] = None, *, gear_ratio: Optional[float] = None) -> Drive:
        """A drive, to be moved in physical units.

        :param model: as :func:`~ferrodrive.models` lists them, or a file that describes it (``FILE.eds``); without it the machine file's, else
            the drive is asked, and one that cannot be told is an error
        :param gear_ratio: turns of its shaft for one turn of the output behind a gear: angles and speeds are the output's, counts the
            drive's; without it what ``units`` of the machine file say, or 1
        """
        model = model or self._native.model_by_file(node) or self._finish(self._native.identify(node))
        if model is None:
            raise MasterError(f"the model of node {node} is not certain from its identity and objects; say which: drive({node}, MODEL)")
        return Drive(self, node, model, gear_ratio)

    def async_drive(self, node: int, model: str, *, gear_ratio: Optional[float] = None) -> AsyncDrive:
        """The same with coroutines."""
        return AsyncDrive(self, node, model, gear_ratio)

    def group(self, axes: Sequence[Axis], *, period: float = 0.005, tolerance: int = 2) -> Group:
        """Opens a group of axes that move as one, and enables its drives; nothing moves. Close it, or use it with ``with``.

        :param period: from one SYNC to the next in s, 0.0005 to 0.1
        :param tolerance: cycles in a row that this program may be late for, or a drive's TPDO, before the drives are stopped
        """
        return Group(self, axes, period, tolerance)

    def base(
        self,
        left: tuple[int, str],
        right: tuple[int, str],
        *,
        wheel_base_m: float,
        wheel_radius_m: float,
        linear_m_s: float,
        angular_rad_s: float,
        wheel_m_s: float,
        wheel_m_s2: float,
        turns: tuple[float, float] = (1.0, -1.0),
        mode: str = "pv",
        watchdog: float = 0.3,
        lag_m: Optional[float] = None,
        period: float = 0.01,
        tolerance: int = 2,
    ) -> Base:
        """Opens a base on two wheels, each a node and its model, and enables both; nothing moves. Close it, or use it with ``with``.

        :param linear_m_s: highest speed along the heading; ``angular_rad_s`` that of the heading, ``wheel_m_s`` that of a wheel over
            the ground, ``wheel_m_s2`` how fast that may change
        :param turns: turns of each drive for a turn of its wheel forward; the right one of two hub motors sits the other way round
        :param watchdog: how long a twist counts, in s
        :param lag_m: how far a wheel may stay behind the way that it was told before both are stopped, over the ground; None is what
            it goes in 0.25 s at ``wheel_m_s``, and 0.1 m at least
        """
        order = {
            "wheels": ((*left, turns[0]), (*right, turns[1])),
            "mode": mode,
            "wheel_base_m": wheel_base_m,
            "wheel_radius_m": wheel_radius_m,
            "linear_m_s": linear_m_s,
            "angular_rad_s": angular_rad_s,
            "wheel_m_s": wheel_m_s,
            "wheel_m_s2": wheel_m_s2,
            "watchdog_s": watchdog,
            "lag_m": lag_m,
        }
        return Base(self, order, period, tolerance)

    def sleep(self, seconds: float) -> None:
        """Lets time pass on the bus, in s."""
        self._finish(self._native.sleep(seconds))

    async def async_sleep(self, seconds: float) -> None:
        """The same as a coroutine."""
        await self._finish_soon(self._native.sleep(seconds))

    def wait_for(self, node: int, within: float = 5.0) -> None:
        """Waits until a node was heard of, in s; :class:`~ferrodrive.MasterError` if it was not."""
        if not self._finish(self._native.wait_for(node, within)):
            raise MasterError(f"nothing was heard of node {node} within {within} s; is it powered, on this bus, at this bit rate?")

    def seen(self) -> list[int]:
        """Nodes that were heard of."""
        return self._native.seen()

    def nmt(self, command: str, node: Optional[int] = None) -> None:
        """NMT command to a node, or to all: ``start``, ``stop``, ``pre-operational``, ``reset``, ``reset-communication``."""
        self._native.nmt(command, node)

    def sync(self, period: Optional[float]) -> None:
        """Produces SYNC with this period in s, or stops with None. On a virtual bus it is exact."""
        self._native.sync(period)

    def upload(self, node: int, index: int, sub_index: int = 0) -> bytes:
        """SDO upload: the bytes of an object, little endian as on the wire."""
        uploaded: bytes = self._finish(self._native.upload(node, index, sub_index))
        return uploaded

    def download(self, node: int, index: int, sub_index: int, data: bytes) -> None:
        """SDO download: writes these bytes to an object."""
        self._finish(self._native.download(node, index, sub_index, data))

    async def async_upload(self, node: int, index: int, sub_index: int = 0) -> bytes:
        """:meth:`upload` as a coroutine."""
        uploaded: bytes = await self._finish_soon(self._native.upload(node, index, sub_index))
        return uploaded

    async def async_download(self, node: int, index: int, sub_index: int, data: bytes) -> None:
        """:meth:`download` as a coroutine."""
        await self._finish_soon(self._native.download(node, index, sub_index, data))


class _Orders:
    """What can be asked of a drive, as jobs. Both kinds of drive wait for these."""

    def __init__(self, network: Network, node: int, model: str, gear_ratio: Optional[float] = None) -> None:
        model_name(model)
        self.network = network
        #: Its node-ID, 1 to 127.
        self.node = node
        #: Its model.
        self.model = model
        #: Turns of its shaft for one turn of the output; None: as the machine file says, or 1.
        self.gear_ratio = gear_ratio

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.model} at {self.node}>"

    def _begin(self, do_: str, **order: Any) -> Job:
        given = {name: value for name, value in order.items() if value is not None}
        behind = {} if self.gear_ratio is None else {"gear_ratio": self.gear_ratio}
        return self.network._native.drive(self.node, self.model, {"do_": do_, **behind, **given})


def _angle(degrees: Optional[float], counts: Optional[int]) -> dict[str, Any]:
    if (degrees is None) == (counts is None):
        raise ValueError("an angle is said in degrees or in counts, one of them")
    return {"value": degrees} if counts is None else {"counts": counts}


class Drive(_Orders):
    """A drive in physical units. Every method waits until it is done, and raises :class:`~ferrodrive.MasterError` if it is not."""

    def enable(self) -> None:
        """Brings it to Operation enabled (CiA 402-2, clause 8)."""
        self.network._finish(self._begin("enable"))

    def disable(self) -> None:
        """Takes the current from the motor."""
        self.network._finish(self._begin("disable"))

    def stop(self) -> None:
        """Brings it to a stand with its own ramp; it stays enabled."""
        self.network._finish(self._begin("stop"))

    def quick_stop(self) -> None:
        """Stops as fast as it is set up to."""
        self.network._finish(self._begin("quick_stop"))

    def reset_fault(self) -> None:
        """Resets a fault whose cause is gone."""
        self.network._finish(self._begin("reset_fault"))

    def save(self) -> None:
        """Stores its parameters in the drive."""
        self.network._finish(self._begin("save"))

    def restore(self) -> None:
        """Takes the factory's parameters, from the next start on."""
        self.network._finish(self._begin("restore"))

    def check_identity(self) -> None:
        """Raises if the node says that it is another model."""
        self.network._finish(self._begin("check_identity"))

    def guard(self) -> str:
        """Arms what the drive has against the end of this program; returns in words what it will do then."""
        words: str = self.network._finish(self._begin("guard"))
        return words

    def release_guard(self) -> None:
        """Takes that back."""
        self.network._finish(self._begin("release_guard"))

    def state(self) -> dict[str, Any]:
        """What it says of itself: ``power``, ``statusword``, ``mode``, ``fault_code``, ``faults`` (each with ``name`` and
        ``remedy``), ``position`` (counts), ``angle_deg``, ``velocity_rpm``, ``current_a``, ``supply_v``, ``motor_c``, ``driver_c``,
        ``nmt``. What the model does not have is None."""
        state: dict[str, Any] = self.network._finish(self._begin("state"))
        return state

    def velocity(
        self,
        rpm: float,
        *,
        acceleration_rpm_s: Optional[float] = None,
        deceleration_rpm_s: Optional[float] = None,
        wait: bool = True,
    ) -> dict[str, Any]:
        """Turns at this speed in r/min (profile velocity) until told otherwise; enables the drive first. Accelerations in (r/min)/s;
        None leaves them as the drive has them. Returns ``reached_after_s`` and ``notes``."""
        options = {"acceleration_rpm_s": acceleration_rpm_s, "deceleration_rpm_s": deceleration_rpm_s, "wait": wait}
        report: dict[str, Any] = self.network._finish(self._begin("velocity", value=rpm, **options))
        return report

    def move(
        self,
        degrees: Optional[float] = None,
        *,
        counts: Optional[int] = None,
        relative: bool = False,
        speed_rpm: Optional[float] = None,
        acceleration_rpm_s: Optional[float] = None,
        deceleration_rpm_s: Optional[float] = None,
        wait: bool = True,
    ) -> dict[str, Any]:
        """Goes to a position of the shaft that the drive counts (of a joint the motor's) in degrees, or in its counts (profile
        position); enables the drive first. Returns ``reached_after_s`` and ``notes``."""
        ramps = {"acceleration_rpm_s": acceleration_rpm_s, "deceleration_rpm_s": deceleration_rpm_s}
        order = {**_angle(degrees, counts), **ramps, "relative": relative, "speed_rpm": speed_rpm, "wait": wait}
        report: dict[str, Any] = self.network._finish(self._begin("move", **order))
        return report

    def torque(self, current_a: float) -> dict[str, Any]:
        """Lets the motor push with this current in A (profile torque) until told otherwise. Does not wait."""
        report: dict[str, Any] = self.network._finish(self._begin("torque", value=current_a))
        return report

    def home(
        self, method: int, *, speed_rpm: Optional[float] = None, within: Optional[float] = None, wait: bool = True
    ) -> dict[str, Any]:
        """Finds its reference position with a homing method of CiA 402, within so many seconds (60 if not said)."""
        order = {"counts": method, "speed_rpm": speed_rpm, "limit_s": within, "wait": wait}
        report: dict[str, Any] = self.network._finish(self._begin("home", **order))
        return report


class AsyncDrive(_Orders):
    """:class:`Drive` with coroutines, for several drives at the same time. On a virtual bus the loop runs inside
    ``with ferrodrive.virtual_time(world)``."""

    async def enable(self) -> None:
        """As :meth:`Drive.enable`."""
        await self.network._finish_soon(self._begin("enable"))

    async def disable(self) -> None:
        """As :meth:`Drive.disable`."""
        await self.network._finish_soon(self._begin("disable"))

    async def stop(self) -> None:
        """As :meth:`Drive.stop`."""
        await self.network._finish_soon(self._begin("stop"))

    async def quick_stop(self) -> None:
        """As :meth:`Drive.quick_stop`."""
        await self.network._finish_soon(self._begin("quick_stop"))

    async def reset_fault(self) -> None:
        """As :meth:`Drive.reset_fault`."""
        await self.network._finish_soon(self._begin("reset_fault"))

    async def state(self) -> dict[str, Any]:
        """As :meth:`Drive.state`."""
        state: dict[str, Any] = await self.network._finish_soon(self._begin("state"))
        return state

    async def velocity(
        self,
        rpm: float,
        *,
        acceleration_rpm_s: Optional[float] = None,
        deceleration_rpm_s: Optional[float] = None,
        wait: bool = True,
    ) -> dict[str, Any]:
        """As :meth:`Drive.velocity`."""
        options = {"acceleration_rpm_s": acceleration_rpm_s, "deceleration_rpm_s": deceleration_rpm_s, "wait": wait}
        report: dict[str, Any] = await self.network._finish_soon(self._begin("velocity", value=rpm, **options))
        return report

    async def move(
        self,
        degrees: Optional[float] = None,
        *,
        counts: Optional[int] = None,
        relative: bool = False,
        speed_rpm: Optional[float] = None,
        acceleration_rpm_s: Optional[float] = None,
        deceleration_rpm_s: Optional[float] = None,
        wait: bool = True,
    ) -> dict[str, Any]:
        """As :meth:`Drive.move`."""
        ramps = {"acceleration_rpm_s": acceleration_rpm_s, "deceleration_rpm_s": deceleration_rpm_s}
        order = {**_angle(degrees, counts), **ramps, "relative": relative, "speed_rpm": speed_rpm, "wait": wait}
        report: dict[str, Any] = await self.network._finish_soon(self._begin("move", **order))
        return report

    async def home(
        self, method: int, *, speed_rpm: Optional[float] = None, within: Optional[float] = None, wait: bool = True
    ) -> dict[str, Any]:
        """As :meth:`Drive.home`."""
        order = {"counts": method, "speed_rpm": speed_rpm, "limit_s": within, "wait": wait}
        report: dict[str, Any] = await self.network._finish_soon(self._begin("home", **order))
        return report


@atexit.register
def _close_all() -> None:
    """The end of the program stops what it has set in motion. What a world does is over with the program."""
    for network in list(_open):
        if network._world is None:
            network.close()
