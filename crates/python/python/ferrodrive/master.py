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
the next call that waits; the message of a call that fails while the connection is lost ends with that.
"""

from __future__ import annotations

import asyncio
import atexit
import os
import warnings
import weakref
from collections.abc import Callable, Mapping, Sequence
from types import TracebackType
from typing import Any, Optional, Union, cast

from . import _native
from ._native import Job, model_name
from ._native import Network as NativeNetwork
from .axes import AsyncBase, AsyncGroup, Axis, Base, Group
from .drive import AsyncDrive, Drive
from .errors import BusWarning, MasterError, Stalled, made
from .parameters import AsyncParameters, File, Parameters
from .real_time import REAL
from .reports import CheckReport
from .supervisor import AsyncSupervisor, Supervisor, path_of
from .turns import taking_part
from .whole import Whole
from .world import World

_open: weakref.WeakSet[Network] = weakref.WeakSet()


class Network(Whole):
    """The network as its master sees it.

    :param bus: a :class:`~ferrodrive.World`, ``socketcand://HOST:PORT/can0`` or ``slcan:///dev/ttyACM0?bitrate=500k``
    :param machine: the machine file that describes what is there: which models are where, what stands behind their shafts (``units``), how
        they are set up, groups and the base. A world of :meth:`World.machine` has one already; one that is given here counts instead
    :param sdo_servers: the SDO server by which a node is asked, by its node-ID: ``{4: 2}`` for that of 1201h, up to 128, 127Fh. For a device
        that another master asks too: neither takes the other's answers. The record is read at the default server, 1, with the first
        request. Without it what ``sdo_server`` of the machine file says
    :param sync_counter: the SYNC that this network sends has a counter, from 1 up to this, 2 to 240, equal to 1019h of the devices; without
        it what the machine file says
    :raises ValueError: the bus is not one, the file makes no sense (:class:`BadRequest`), or a number is out of its range
    :raises RuntimeError: the bus does not open

    >>> network = ferrodrive.Network(world)
    >>> network.wait_for(5)
    >>> drive = network.drive(5)
    >>> drive.velocity(60)["reached_after_s"] is not None
    True
    >>> network.close()
    """

    def __init__(
        self,
        bus: Union[World, str],
        *,
        machine: Optional[File] = None,
        sdo_servers: Optional[Mapping[int, int]] = None,
        sync_counter: Optional[int] = None,
    ) -> None:
        self._world = bus if isinstance(bus, World) else None
        self._bus = "virtual world" if isinstance(bus, World) else bus
        path = None if machine is None else os.fspath(machine)
        self._machine = path if path is not None else getattr(bus, "machine_file", None)
        servers = dict(sdo_servers or {})
        if isinstance(bus, World):
            self._native = NativeNetwork.in_world(bus, path, servers, sync_counter)
        else:
            self._native = NativeNetwork.on_bus(bus, path, servers, sync_counter)
        #: What tells the coroutines that wait for jobs in a world that these have ended.
        self._awaited: set[Callable[[], None]] = set()
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
            # What went wrong first is what is raised; that a drive may still be moving is a warning beside it.
            warnings.warn(str(moving), BusWarning, stacklevel=2)

    def close(self) -> None:
        """Gives up what is still asked of drives, quick-stops what this program has set in motion, and leaves the bus: nothing is
        sent after that. Does nothing the second time.

        :raises MasterError: a drive was not seen to stand

        >>> network.close()
        >>> network.closed
        True
        """
        if self not in _open:
            return
        _open.discard(self)
        if self._world is None:
            moving: list[str] = self._native.close()
        else:
            moving = self._finish(self._native.close_in_world())
            # Their jobs were given up, and nothing of them is heard in the world any more.
            for report in list(self._awaited):
                report()
        if moving:
            raise MasterError("; ".join(moving))

    @property
    def closed(self) -> bool:
        """True once it was closed."""
        return self not in _open

    # Waiting for the master.

    def _finish(self, job: Job, keep: bool = False) -> Any:
        """The result of a job, waited for. One that is interrupted is given up, unless it is to be kept."""
        try:
            if job.ended:
                pass
            elif self._world is None:
                job.wait()
            elif (time := taking_part(self._world)) is not None:
                wait = time.begin("waits for the master")
                time.on_done(job.number, lambda: time.wake(wait))
                time.wait(wait)
            else:
                self._move_world(self._world, job)
        except BaseException:
            if not keep:
                job.cancel()
            if job.leads_back:
                self._await_way_back(job)
            raise
        return self._result(job)

    def _await_way_back(self, job: Job) -> None:
        """Lets what was given up put back what it has changed. Where others move the time, that goes on by itself."""
        if self._world is None:
            job.wait()
        elif taking_part(self._world) is None:
            self._move_world(self._world, job)

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

    async def _finish_soon(self, job: Job, keep: bool = False) -> Any:
        """The result of a job, awaited. One whose coroutine is cancelled is given up, unless it is to be kept; one that leads back is
        awaited until it has: a second cancellation leaves it to go on by itself."""
        loop = asyncio.get_running_loop()
        ended: asyncio.Future[None] = loop.create_future()

        def end() -> None:
            if not ended.done():
                ended.set_result(None)

        def report() -> None:
            if not loop.is_closed():
                loop.call_soon_threadsafe(end)

        if self._world is None:
            job.on_end(report)
        elif (time := taking_part(self._world)) is not None:
            time.on_done(job.number, report)
            self._awaited.add(report)
        else:
            job.cancel()
            raise RuntimeError("time stands still in this world: run the loop inside `with ferrodrive.virtual_time(world)`")
        try:
            # Which leaves the future as it is when it is cancelled.
            await asyncio.wait([ended])
        except BaseException as stopped:
            if not keep:
                job.cancel()
                # A coroutine that is closed may not await; nor can one without its loop.
                if job.leads_back and not isinstance(stopped, GeneratorExit) and not loop.is_closed():
                    await asyncio.wait([ended])
            raise
        finally:
            self._awaited.discard(report)
        return self._result(job)

    @property
    def _now(self) -> Callable[[], float]:
        world = self._world
        return REAL.monotonic if world is None else lambda: world.now

    # What a network does.

    def drive(self, node: int, model: Optional[str] = None, *, gear_ratio: Optional[float] = None) -> Drive:
        """A drive, to be moved in physical units.

        :param node: its node-ID, 1 to 127
        :param model: as :func:`~ferrodrive.models` lists them, or a file that describes it (``FILE.eds``); without it the machine file's, else
            its identity and objects are read. Where several models answer alike, the one whose objects the node has is a guess
            (:attr:`Drive.guessed`): enough to read and to move, not to :meth:`Drive.save` and :meth:`Drive.restore`
        :param gear_ratio: turns of its shaft for one turn of the output behind a gear: angles and speeds are the output's, counts the
            drive's; without it what ``units`` of the machine file say, or 1
        :raises MasterError: its model was not given, and nothing speaks for one (kind ``unknown_model``), or it does not answer
        :raises ValueError: the model is not known

        >>> network.drive(5).model
        'cia402'
        """
        guessed = False
        model = model or self._native.model_by_file(node)
        if model is None:
            identified = self._finish(self._native.identify(node))
            if identified is None:
                advice = f'name its model: network.drive({node}, "MODEL"), or a machine file: Network(bus, machine=FILE)'
                what = f"node {node}: its identity and objects do not show its model"
                raise made(f"{what}; {advice}", ("unknown_model", what, [], [advice], (node, None, None)))
            model, guessed = identified
        return Drive(self, node, model, gear_ratio, guessed)

    def async_drive(self, node: int, model: Optional[str] = None, *, gear_ratio: Optional[float] = None) -> AsyncDrive:
        """:meth:`drive` with coroutines; a model that the machine file does not have is to be given.

        :raises ValueError: the model is not known, or neither given nor in the machine file

        >>> network.async_drive(5, "cia402")
        <AsyncDrive cia402 at 5>
        """
        model = model or self._native.model_by_file(node)
        if model is None:
            raise ValueError(f"which model is node {node}? The machine file does not have it: async_drive({node}, MODEL)")
        return AsyncDrive(self, node, model, gear_ratio)

    def group(
        self, axes: Union[str, Sequence[Axis]], *, period: Optional[float] = None, tolerance: int = 2
    ) -> Group:
        """Opens a group of axes that move as one, and enables its drives; nothing moves. Close it, or use it with ``with``. Boot its nodes
        first (:meth:`boot`). A cycle that the bus cannot carry is refused before anything is written (kind ``bus_load``; on a real bus
        where the machine file has the bit rate).

        :param axes: the name of a ``[[group]]`` of the machine file, or its axes
        :param period: from one SYNC to the next in s, 0.0005 to 0.1; without it the file's, or 0.005
        :param tolerance: cycles in a row that this program may be late for, or a drive's TPDO, before the drives are stopped
        :raises MasterError: a drive does not answer (:class:`NoAnswer`) or was not enabled, with what keeps it; the bus cannot carry the
            cycle; the file has no such group (:class:`BadRequest`)

        >>> with network.group([ferrodrive.Axis(5, "cia402", mode="csp")]) as group:
        ...     group.state()["phase"]
        'holding'
        """
        return Group(self, axes, period, tolerance)

    async def async_group(
        self, axes: Union[str, Sequence[Axis]], *, period: Optional[float] = None, tolerance: int = 2
    ) -> AsyncGroup:
        """As :meth:`group`, for ``async with await network.async_group(..) as group``."""
        return await AsyncGroup(self)._open(axes, period, tolerance)

    def base(
        self,
        left: Optional[tuple[int, str]] = None,
        right: Optional[tuple[int, str]] = None,
        *,
        wheel_base_m: Optional[float] = None,
        wheel_radius_m: Optional[float] = None,
        linear_m_s: Optional[float] = None,
        angular_rad_s: Optional[float] = None,
        wheel_m_s: Optional[float] = None,
        wheel_m_s2: Optional[float] = None,
        turns: Optional[tuple[float, float]] = None,
        mode: Optional[str] = None,
        watchdog: Optional[float] = None,
        lag_m: Optional[float] = None,
        period: Optional[float] = None,
        tolerance: int = 2,
    ) -> Base:
        """Opens a base on two wheels and enables both; nothing moves. Close it, or use it with ``with``. Without wheels it is the ``[base]``
        of the machine file, and nothing but ``period`` and ``tolerance`` may be given beside. Boot its nodes first (:meth:`boot`). A cycle
        that the bus cannot carry is refused before anything is written (kind ``bus_load``).

        :param left: node and model of the left wheel, ``right`` those of the right one
        :param wheel_base_m: distance between the wheels in m; ``wheel_radius_m`` their radius in m
        :param linear_m_s: highest speed along the heading; ``angular_rad_s`` that of the heading, ``wheel_m_s`` that of a wheel over
            the ground, ``wheel_m_s2`` how fast that may change. A twist beyond them is driven as fast as they allow
            (:meth:`Base.command`)
        :param turns: turns of each drive for a turn of its wheel forward; without it (1, -1): the right one of two hub motors sits the
            other way round
        :param mode: mode of operation of the wheels, ``pv`` or ``csv``; without it ``pv``
        :param watchdog: how long a twist counts, in s; without it 0.3
        :param lag_m: how far a wheel may stay behind its way over the ground before both are stopped, in m; None is what it goes in
            0.25 s at ``wheel_m_s``, and 0.1 m at least
        :param period: from one SYNC to the next in s; without it the file's, or 0.01
        :param tolerance: cycles in a row that this program may be late for, or a drive's TPDO, before the drives are stopped
        :raises MasterError: a wheel does not answer (:class:`NoAnswer`) or was not enabled; the file has no base (:class:`BadRequest`)
        :raises TypeError: an argument is given that the machine file decides, or that only a base with wheels has
        :raises ValueError: one wheel is given and the other is not

        >>> with ferrodrive.Network(ferrodrive.World.machine("base.toml")) as network:
        ...     network.boot()["ok"]
        ...     with network.base() as base:
        ...         base.drive(0.2, 0.0, seconds=1)["limited"]
        True
        False
        """
        order = _order_of_base(
            left,
            right,
            {"wheel_base_m": wheel_base_m, "wheel_radius_m": wheel_radius_m},
            {"linear_m_s": linear_m_s, "angular_rad_s": angular_rad_s, "wheel_m_s": wheel_m_s, "wheel_m_s2": wheel_m_s2},
            {"turns": turns, "mode": mode, "watchdog": watchdog, "lag_m": lag_m},
        )
        return Base(self, order, period, tolerance)

    async def async_base(
        self,
        left: Optional[tuple[int, str]] = None,
        right: Optional[tuple[int, str]] = None,
        *,
        wheel_base_m: Optional[float] = None,
        wheel_radius_m: Optional[float] = None,
        linear_m_s: Optional[float] = None,
        angular_rad_s: Optional[float] = None,
        wheel_m_s: Optional[float] = None,
        wheel_m_s2: Optional[float] = None,
        turns: Optional[tuple[float, float]] = None,
        mode: Optional[str] = None,
        watchdog: Optional[float] = None,
        lag_m: Optional[float] = None,
        period: Optional[float] = None,
        tolerance: int = 2,
    ) -> AsyncBase:
        """As :meth:`base`, for ``async with await network.async_base(..) as base``."""
        order = _order_of_base(
            left,
            right,
            {"wheel_base_m": wheel_base_m, "wheel_radius_m": wheel_radius_m},
            {"linear_m_s": linear_m_s, "angular_rad_s": angular_rad_s, "wheel_m_s": wheel_m_s, "wheel_m_s2": wheel_m_s2},
            {"turns": turns, "mode": mode, "watchdog": watchdog, "lag_m": lag_m},
        )
        return await AsyncBase(self)._open(order, period, tolerance)

    def supervise(self, file: Optional[File] = None, *, nodes: Sequence[int] = (), own_node: int = 127) -> Supervisor:
        """Boots as :meth:`boot` does, has each drive stop by itself when this program dies, where its model has something for that, and
        watches the network from then on. Close it, or use it with ``with``.

        :param own_node: node-ID of this master, for drives whose watch over a heartbeat (1016h) is off as yet
        :raises MasterError: a node that was left as it is does not have what the file says

        >>> with network.supervise() as supervisor:
        ...     supervisor.report["ok"]
        True
        """
        return Supervisor(self, path_of(file), nodes, own_node)

    async def async_supervise(
        self, file: Optional[File] = None, *, nodes: Sequence[int] = (), own_node: int = 127
    ) -> AsyncSupervisor:
        """As :meth:`supervise`, for ``async with await network.async_supervise() as supervisor``."""
        return await AsyncSupervisor(self)._open(path_of(file), nodes, own_node)

    def params(self, node: int, model: Optional[str] = None) -> Parameters:
        """The parameters of a node, to be kept, compared, written as a transaction and checked.

        :param model: as for :meth:`drive`; without it the machine file's, or what its identity and objects say
        :raises ValueError: the model is not known

        >>> network.params(5).backup()["values"] > 10
        True
        """
        return Parameters(self, node, model if model is None else model_name(model))

    def async_params(self, node: int, model: Optional[str] = None) -> AsyncParameters:
        """As :meth:`params`, with coroutines.

        >>> network.async_params(5).node
        5
        """
        return AsyncParameters(self, node, model if model is None else model_name(model))

    def sleep(self, seconds: float) -> None:
        """Lets time pass on the bus, in s.

        >>> network.sleep(0.25)
        """
        self._finish(self._native.sleep(seconds))

    async def async_sleep(self, seconds: float) -> None:
        """:meth:`sleep` as a coroutine, in s.

        >>> with ferrodrive.virtual_time(world):
        ...     asyncio.run(network.async_sleep(0.25))
        """
        await self._finish_soon(self._native.sleep(seconds))

    def wait_for(self, node: int, within: float = 5.0) -> None:
        """Waits until a node was heard of: by its boot-up message, a heartbeat or an answer. One that has been silent for two seconds is
        asked for its device type (1000h): a drive that booted long ago may say nothing by itself.

        :param within: longest time to wait, in s
        :raises MasterError: it was not heard of (kind ``no_answer``)

        >>> network.wait_for(5)
        """
        if not self._finish(self._native.wait_for(node, within)):
            raise _unheard(node, within)

    async def async_wait_for(self, node: int, within: float = 5.0) -> None:
        """As :meth:`wait_for`."""
        if not await self._finish_soon(self._native.wait_for(node, within)):
            raise _unheard(node, within)

    def seen(self) -> list[int]:
        """Nodes that were heard of.

        >>> network.seen()
        [5]
        """
        return self._native.seen()

    def nmt(self, command: str, node: Optional[int] = None) -> None:
        """NMT command (CiA 301, 7.2.8) to a node, or to all without one.

        :param command: ``start``, ``stop``, ``pre-operational``, ``reset``, ``reset-communication``
        :raises ValueError: it is not one of these

        >>> network.nmt("start", 5)
        """
        self._native.nmt(command, node)

    def sync(self, period: Optional[float]) -> None:
        """Produces SYNC with this period in s, or stops with None. On a virtual bus it is exact.

        :raises ValueError: the period is not a time

        >>> network.sync(0.01)
        """
        self._native.sync(period)

    def upload(self, node: int, index: int, sub_index: int = 0) -> bytes:
        """SDO upload: the bytes of an object, little endian as on the wire.

        :raises MasterError: the node refused (:class:`Aborted`) or did not answer (:class:`NoAnswer`)

        >>> int.from_bytes(network.upload(5, 0x1000), "little") & 0xFFFF     # the device profile
        402
        """
        uploaded: bytes = self._finish(self._native.upload(node, index, sub_index))
        return uploaded

    def download(self, node: int, index: int, sub_index: int, data: bytes) -> None:
        """SDO download: writes these bytes to an object, little endian.

        :raises MasterError: the node refused (:class:`Aborted`) or did not answer (:class:`NoAnswer`)

        >>> network.download(5, 0x1017, 0, (250).to_bytes(2, "little"))
        """
        self._finish(self._native.download(node, index, sub_index, data))

    async def async_upload(self, node: int, index: int, sub_index: int = 0) -> bytes:
        """:meth:`upload` as a coroutine.

        >>> with ferrodrive.virtual_time(world):
        ...     int.from_bytes(asyncio.run(network.async_upload(5, 0x1000)), "little") & 0xFFFF
        402
        """
        uploaded: bytes = await self._finish_soon(self._native.upload(node, index, sub_index))
        return uploaded

    async def async_download(self, node: int, index: int, sub_index: int, data: bytes) -> None:
        """:meth:`download` as a coroutine.

        >>> with ferrodrive.virtual_time(world):
        ...     asyncio.run(network.async_download(5, 0x1017, 0, (250).to_bytes(2, "little")))
        """
        await self._finish_soon(self._native.download(node, index, sub_index, data))


def _unheard(node: int, within: float) -> MasterError:
    advice = "is it powered, on this bus, at this bit rate?"
    what = f"nothing was heard of node {node} within {within} s"
    return made(f"{what}; {advice}", ("no_answer", what, [], [advice], (node, None, None)))


def check(file: File, *, strict: bool = False) -> CheckReport:
    """Checks the description of a bus before it is started, as ``ferrodrive check`` does: a machine file, or a ``bus.yml`` of ros2_canopen
    with its data sheets. The bus that it means is booted in virtual time; nothing is sent. What is wrong with it is in the report, and
    raises nothing.

    :param strict: ``ok`` is False for warnings too
    :raises MasterError: the file cannot be read, or makes no sense (:class:`BadRequest`)

    >>> ferrodrive.check("base.toml")["ok"]
    True
    """
    return cast(CheckReport, _native.check_file(os.fspath(file), strict))


@atexit.register
def _close_all() -> None:
    """The end of the program stops what it has set in motion. What a world does is over with the program."""
    for network in list(_open):
        if network._world is None:
            network.close()


def _order_of_base(
    left: Optional[tuple[int, str]],
    right: Optional[tuple[int, str]],
    lengths: dict[str, Optional[float]],
    speeds: dict[str, Optional[float]],
    beside: dict[str, Any],
) -> Optional[dict[str, Any]]:
    """A base with these wheels; None for that of the machine file."""
    if left is not None and right is not None:
        of_left, of_right = (1.0, -1.0) if beside["turns"] is None else beside["turns"]
        return {
            "wheels": ((*left, of_left), (*right, of_right)),
            "mode": "pv" if beside["mode"] is None else beside["mode"],
            # What is not stated is refused with what is expected.
            **{name: 0.0 if value is None else value for name, value in {**lengths, **speeds}.items()},
            "watchdog_s": 0.3 if beside["watchdog"] is None else beside["watchdog"],
            "lag_m": beside["lag_m"],
        }
    if left is not None or right is not None:
        raise ValueError("a base has two wheels: give left and right, or neither for the [base] of the machine file")
    if given := [name for name, value in {**lengths, **speeds, **beside}.items() if value is not None]:
        raise TypeError(
            f"base() without wheels is the [base] of the machine file, which decides {', '.join(given)}: change it there, or give "
            "the whole base, with left and right"
        )
    return None
