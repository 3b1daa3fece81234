"""A virtual bus with drives on it."""

from __future__ import annotations

import contextlib
import json
import os
import weakref
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any, Optional, Union

from . import _native
from .body import Body
from .errors import Refused
from .external import ExternalShaft
from .virtual_drive import VirtualDrive
from .turns import taking_part
from .words import number

if TYPE_CHECKING:
    from typing_extensions import Self

NANOSECONDS = 1_000_000_000

#: Worlds by the channel under which `can.Bus` finds them, while a reference to them exists.
_by_channel: weakref.WeakValueDictionary[str, World] = weakref.WeakValueDictionary()


class World(_native.World):
    """A CAN bus, the drives on it and the physics around them, in virtual time.

    Time moves only in :meth:`run_for` and :meth:`run_until`, or as far as a program waits while
    :func:`~ferrodrive.virtual_time` or ``can.Bus(interface="ferrodrive")`` is in use. The same seed and the same calls give the
    same frames at the same nanoseconds on every run and every machine.

    A world may be used from several threads; they take turns.

    :param bitrate: bit rate of the bus in bit/s, or as text (``"500k"``)
    :param seed: decides everything random
    :param timing: ``device``: boot, answers and stores take the time that such a device takes, as on the desk; ``ideal``: none beyond the
        wire
    :param fidelity: ``full``: each control period is computed; ``mechanical``: mechanics and outer loops only, many times faster, without
        ripple and faults of single phases (docs/fidelity.md). A drive may have its own: ``add(..., fidelity="full")``
    :param channel: a name under which ``can.Bus(interface="ferrodrive", channel=...)`` finds this world
    :param threads: how many compute the drives, which makes no difference but of speed, and pays from some 20 turning drives on

    >>> world = ferrodrive.World(bitrate=500_000, seed=1)
    >>> servo = world.add("cia402", node=5)
    >>> world.wait_until_booted() < 3
    True
    """

    #: The file of :meth:`machine`, if it is of one.
    machine_file: Optional[str] = None
    _watched = False
    _keeps_trail = False

    def __new__(cls, bitrate: Union[int, str] = 500_000, seed: int = 1, timing: str = "device", *, fidelity: Optional[str] = None, channel: Optional[str] = None, threads: int = 1) -> Self:
        world = super().__new__(cls, str(bitrate), seed)
        world.set_timing(timing)
        world.set_threads(threads)
        if fidelity is not None:
            world.set_fidelity(fidelity)
        if channel is not None:
            _by_channel[channel] = world
        return world

    @classmethod
    def machine(cls, path: Union[str, os.PathLike[str]], seed: Optional[int] = None, *, timing: Optional[str] = None, fidelity: Optional[str] = None) -> World:
        """The world that a machine file describes: its drives and what is around them. Data sheets that it names are looked for beside
        it.

        :param seed: instead of the file's
        :param timing: ``device`` or ``ideal`` instead of the file's, which is ``device`` unless the file has another; a drive that has its
            own in the file keeps it
        :param fidelity: ``full`` or ``mechanical`` instead of the file's, likewise
        :raises OSError: the file is not there
        :raises ValueError: it makes no sense, with everything that is wrong in it

        >>> ferrodrive.World.machine("base.toml").nodes
        [4, 5]
        """
        os.stat(path)
        world = cls()
        world.become_machine(os.fspath(path), seed, timing, fidelity)
        world.machine_file = os.fspath(path)
        return world

    def add(
        self,
        model: Optional[str] = None,
        *,
        node: int,
        eds: Optional[Union[str, os.PathLike[str]]] = None,
        **options: Union[int, str],
    ) -> VirtualDrive:
        """Puts a drive onto the bus, factory-fresh but for its node-ID and bit rate, and powers it.

        :param model: as :func:`~ferrodrive.models` lists them
        :param eds: instead of a model, an EDS or DCF file: a servo with its objects, or, if it describes no drive, a node with them
        :param node: node-ID at the first start, 1 to 127; the drive keeps this number in the world
        :param options: what is special about this one, in the words of ``ferrodrive sim --drive``: ``motor="fast"``,
            ``firmware="2.01"``, ``maximum_current=100``; an object by its index as ``**{"6060": 3}``
        :raises ValueError: the model, the file or an option is not one
        :raises Refused: the number is in use, or the drive does not take an option

        >>> world.add("zlac8030l", node=4, motor="fast")
        <zlac8030l at 4>
        """
        if (model is None) == (eds is None):
            raise ValueError("a drive is of a model or of a file (eds=...), one of them")
        described = model if eds is None else os.fspath(eds)
        self.add_drive(str(described), node, [(key, str(value)) for key, value in options.items()])
        return VirtualDrive(self, node)

    def __getitem__(self, node: int) -> VirtualDrive:
        """The drive that was added under this number."""
        if node not in self.nodes:
            present = ", ".join(str(node) for node in self.nodes) or "none"
            raise KeyError(f"no drive was added as node {node}; there is {present}")
        return VirtualDrive(self, node)

    def __iter__(self) -> Iterator[VirtualDrive]:
        """The drives in the order in which they were added."""
        return iter([VirtualDrive(self, node) for node in self.nodes])

    def __repr__(self) -> str:
        return f"<World at {self.now} s with {len(self.nodes)} drives>"

    def apply(self, line: str) -> dict[str, Any]:
        """Does what a world command says (``4 load torque 2.5``, ``bus corrupt 0.01``) and returns its answer.

        :raises Refused: the command is not one, or the drive does not take it; nothing has changed

        >>> world.apply("5 load torque 2.5")["ok"]
        True
        """
        answer: dict[str, Any] = json.loads(self.command(line) or "{}")
        if not answer.get("ok"):
            error = answer.get("error", "expected a world command, got nothing")
            raise Refused(error["message"] if isinstance(error, dict) else error)
        return answer

    def body(self, name: str) -> Body:
        """A machine that several drives move, by its name. That there is none of this name shows with its first use.

        :raises ValueError: the name is not one word

        >>> ferrodrive.World.machine("base.toml").body("base")
        <Body base>
        """
        return Body(self, name)

    def external(
        self,
        drives: Sequence[Union[int, str]],
        *,
        angle_rad: Union[float, Sequence[float]] = 0.0,
        turns: Union[float, Sequence[float]] = 1.0,
        inertia_kg_m2: Union[float, Sequence[float]] = 0.0,
        rule: str = "integrate",
        name: str = "external",
    ) -> None:
        """From now on a physics engine moves the shafts of these drives, by :meth:`exchange`. In a machine file: a ``[[body]]`` of the kind
        ``external``. Needs NumPy.

        :param drives: one to seven of them, ``"5.2"`` for an axis; more by a second call with another name
        :param angle_rad: where the joints stand in the engine now
        :param turns: turns of the joint for one turn of the drive's output, negative for a motor that sits the other way round
        :param inertia_kg_m2: what the engine has at each joint beside the drive, if that is known; with ``torque`` what the drive moves
        :param rule: what a shaft does between two exchanges: ``integrate``, ``hold``, ``interpolate``, or ``torque`` for the other form
            (:meth:`exchange_torque`). What each is off by is in the handbook, "In your physics engine"
        :param name: of the body that they become
        :raises Refused: a drive is not there, is part of a body, or has a gear of its own; nothing has changed
        :raises ValueError: the rule is not one, or there are not as many values as drives
        :raises ImportError: NumPy is not installed

        >>> world.external([5])
        """
        count = len(drives)
        columns = [_each("turns", turns, count), _each("angle_rad", angle_rad, count), _each("inertia_kg_m2", inertia_kg_m2, count)]
        _native.couple_external(self, name, rule, list(zip([str(drive) for drive in drives], *columns)))

    def external_shafts(self) -> list[ExternalShaft]:
        """The shafts that a physics engine moves, in the order of :meth:`exchange`: that in which they were joined.

        >>> world.external([5])
        >>> [shaft.place for shaft in world.external_shafts()]
        ['5']
        """
        return [ExternalShaft(*shaft) for shaft in _native.external_shafts(self)]

    def exchange(self, dt_s: float, angle_rad: Any, velocity_rad_s: Any) -> Any:
        """Moves on by a step of the engine: where its joints are goes in, and for each the torque that its drive gives comes out, to be
        applied in the engine's next step. In a thread that takes part in the virtual time it waits for that time.

        The torque is the mean over the step at the joint, less the drive's friction; the engine has the drive's inertia as the armature
        of the joint (:meth:`external_shafts`). Time that passes outside of an exchange finds the shafts held fast.

        :param dt_s: the step in s, a whole number of the drives' control periods: 50 us, with fidelity ``mechanical`` 500 us
        :param angle_rad: an array of the joints' angles in rad, many turns; ``velocity_rad_s`` one of their velocities in rad/s. What is
            returned is a new array of torques in N m
        :raises ValueError: a length, a value or the step is wrong, or a joint has come further than its velocities explain; nothing is
            stored then, and no time passes

        >>> world.external([5])
        >>> world.exchange(0.001, [0.0], [0.0]).shape
        (1,)
        """
        if (time := taking_part(self)) is None:
            return _native.exchange(self, dt_s, angle_rad, velocity_rad_s)
        time.sleep_ns(_native.begin_exchange(self, dt_s, angle_rad, velocity_rad_s))
        return _native.exchanged(self)[0]

    def exchange_torque(self, dt_s: float, torque_nm: Any) -> tuple[Any, Any]:
        """The other form, of shafts that were joined with the rule ``torque``: the engine's torque at each joint goes in, for one that moves
        the drive in positive direction above 0; the joints' angles in rad and velocities in rad/s at the end of the step come out.

        :raises ValueError: as :meth:`exchange`

        >>> world = ferrodrive.World()
        >>> wheel = world.add("zlac8030l", node=4)
        >>> world.external([4], rule="torque", inertia_kg_m2=0.2)
        >>> angle_rad, velocity_rad_s = world.exchange_torque(0.001, [0.5])
        """
        if (time := taking_part(self)) is None:
            return _native.exchange_torque(self, dt_s, torque_nm)
        time.sleep_ns(_native.begin_exchange(self, dt_s, torque_nm, None))
        return _native.exchanged(self)[1:]

    @property
    def now(self) -> float:
        """Virtual time in s since the world began."""
        return self.now_ns / NANOSECONDS

    def run_for(self, seconds: float) -> None:
        """Lets time pass, in s. Threads that take part in the virtual time of this world go on meanwhile.

        :raises ValueError: the time is less than 0

        >>> world.run_for(0.5)
        """
        ns = nanoseconds(seconds)
        self._let_pass(ns)

    def run_until(self, condition: Callable[[], object], within: float, every: float = 0.001) -> float:
        """Lets time pass until `condition()` is true; returns the time at which it was, in s.

        :param within: longest time in s that may pass; after that :class:`TimeoutError` is raised
        :param every: how often the condition is looked at, in s of virtual time

        An exception that the condition raises comes out here; the world stands where it was raised.

        >>> world[5].power_cut()
        >>> world.run_until(lambda: world[5].statusword is None, within=1) > 0
        True
        """
        end_ns = self.now_ns + nanoseconds(within)
        step_ns = max(1, nanoseconds(every))
        while not condition():
            left_ns = end_ns - self.now_ns
            if left_ns <= 0:
                raise TimeoutError(f"not so within {within} s; it is {self.now} s")
            self._let_pass(min(step_ns, left_ns))
        return self.now

    def _let_pass(self, ns: int) -> None:
        if (time := taking_part(self)) is not None:
            time.sleep_ns(ns)
        else:
            self.run_ns(ns)

    def wait_until_booted(self, within: float = 30.0) -> float:
        """Lets time pass until every drive that was added has booted; returns the time at which it had, in s. With ``timing="device"`` a
        drive takes about a second, in which it is deaf, as a real one.

        :param within: longest time in s of virtual time
        :raises TimeoutError: not all had by then

        >>> world = ferrodrive.World()
        >>> servo = world.add("cia402", node=5)
        >>> world.wait_until_booted() > 0.1
        True
        """
        return self.run_until(lambda: all(self.apply(f"{node} get")["power"] == "on" for node in self.nodes), within)

    def snapshot(self) -> World:
        """A copy of everything: drives, physics, frames under way. It goes its own way from here, or is come back to with
        :meth:`restore`.

        :raises RuntimeError: a master is in the world: it would be in two

        >>> copy = world.snapshot()
        >>> world.run_for(1)
        >>> copy.now < world.now
        True
        """
        copy = type(self)(self.bitrate)
        copy.become_copy_of(self)
        copy.machine_file = self.machine_file
        return copy

    def restore(self, snapshot: World) -> None:
        """Becomes again what it was when `snapshot` was taken from it. May be done any number of times.

        >>> before = world.snapshot()
        >>> world.run_for(1)
        >>> world.restore(before)
        >>> world.now == before.now
        True
        """
        self.become_copy_of(snapshot)

    def events(self) -> Iterator[dict[str, Any]]:
        """What happened since the last call, oldest first: boots, changes of state, faults with their remedies, EMCY, arrivals,
        stores, errors of the bus. Each has ``t`` (s), ``t_ns``, ``kind``, ``text`` for people, ``node`` where it is about one,
        ``remedy`` where there is one. The first call begins the watch, and yields nothing.

        >>> list(world.events())
        []
        >>> world[5].power_cut()
        >>> world.run_for(0.1)
        >>> [event["node"] for event in world.events()][:1]
        [5]
        """
        if not self._watched:
            self._watched = True
            self.watch(True)
        while lines := self.take_events():
            for line in lines:
                yield json.loads(line)

    @contextlib.contextmanager
    def record(self, path: Union[str, os.PathLike[str]], every: float = 0.001) -> Iterator[None]:
        """Records every signal of every drive and body while the block runs, to a file ``.mcap`` (for Foxglove, PlotJuggler, Rerun; with the
        frames) or ``.csv``.

        :param every: time between two samples in s of virtual time
        :raises OSError: the file cannot be written
        :raises RuntimeError: the world is being recorded already

        >>> with world.record("run.csv", every=0.01):
        ...     world.run_for(0.1)
        """
        self.begin_record(os.fspath(path), max(1, nanoseconds(every)))
        try:
            yield
        finally:
            self.end_record()

    def keep_trail(self, last: float = 20.0, every: float = 0.01) -> None:
        """Keeps the last seconds of what moves from here on in memory, for :meth:`picture`. Changes nothing in the run.

        :param last: how far back it goes, in s of virtual time
        :param every: time between two samples in s of virtual time
        :raises ValueError: more samples than memory is kept for

        >>> world.keep_trail(last=5)
        """
        self.begin_trail(nanoseconds(last), max(1, nanoseconds(every)))
        self._keeps_trail = True

    @property
    def keeps_trail(self) -> bool:
        """True after :meth:`keep_trail`."""
        return self._keeps_trail

    def picture(self, title: str = "the last of a run") -> str:
        """What :meth:`keep_trail` has kept, as the text of an SVG: position, velocity, current, supply and faults of each drive, and
        where bodies were, over time.

        :raises RuntimeError: nothing was kept, or nothing has moved

        >>> world.keep_trail()
        >>> world.run_for(1)
        >>> world.picture("a second")[:4]
        '<svg'
        """
        return self.trail_picture(title)

    def corrupt(self, probability: float) -> None:
        """From now on each frame is destroyed on the wire with this probability, 0 to 1, and sent again (``bus corrupt 0.01``).

        :raises Refused: it is not a probability

        >>> world.corrupt(0.01)
        """
        self.disturb("corrupt", number("probability", probability))

    def destroy(self, nth_frame: int, bit: int) -> None:
        """The n-th frame from here on is destroyed at this bit of it, counted from 1 at start of frame (``bus destroy 3 20``).

        :raises Refused: the frame or the bit is less than 1

        >>> world.destroy(3, bit=20)
        """
        self.disturb("destroy", int(nth_frame), int(bit))

    @property
    def bus_load(self) -> float:
        """Share of the time since the beginning that the wire was busy, from 0 to 1."""
        return self.statistics()[0]


def nanoseconds(seconds: float) -> int:
    """A length of time as a whole number of nanoseconds."""
    ns = round(seconds * NANOSECONDS)
    if ns < 0:
        raise ValueError(f"expected a time of 0 s or more, got {seconds} s")
    return ns


def _each(what: str, values: Union[float, Sequence[float]], count: int) -> list[float]:
    """A value for each of so many drives; a single one is that of all."""
    each = [float(value) for value in values] if isinstance(values, Iterable) else [float(values)] * count
    if len(each) != count:
        raise ValueError(f"{what}: {len(each)} values for {count} drives")
    return each


def at_channel(channel: object) -> World:
    """The world that a channel of python-can means: a world, the name of one, or drives to make one of (``zlac8030l@4``)."""
    if isinstance(channel, World):
        return channel
    text = os.fspath(channel) if isinstance(channel, os.PathLike) else str(channel)
    if (world := _by_channel.get(text)) is not None:
        return world
    if "@" in text:
        world = World(channel=text)
        for words in text.split():
            world.add_described(words)
        return world
    raise ValueError(
        f"{text!r} is not a channel; expected a World, the name of one (World(channel={text!r})), or drives, "
        'as in "zlac8030l@4 m4230e17b50@1"'
    )
