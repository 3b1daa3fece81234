"""A clock that goes only as far as the program waits, and threads that take turns under it.

While a virtual time is in use, exactly one of the threads that take part in it runs. It runs until it waits: for a moment
(``time.sleep``), for another thread (a lock, a condition, a queue, an event, ``join``) or for the bus (``recv``). Then the next
one that may run does, in the order in which they became able to. When none may, the world is moved, from event to event, up to the
first frame that a thread waits for or the first moment that a thread waits for. So what happens, and when, is decided by the
program and the world; the load of the machine only decides how long it takes.

The thread that begins it takes part, and every ``threading.Thread`` that is started by one that does. Other threads keep the real
clock. What is replaced meanwhile, and put back after, is in :mod:`ferrodrive.stand_ins`.
"""

from __future__ import annotations

import contextlib
import heapq
import itertools
import os
import threading
from collections import deque
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, Optional

from . import stand_ins
from .errors import Stalled, TimeInUse
from .real_time import REAL
from .stand_ins import EPOCH_NS as EPOCH_NS

if TYPE_CHECKING:
    from .world import World

#: How often the clock may be read in a row before reading it takes time: a program that only looks at the clock until it shows
#: what it waits for would look for ever.
FREE_GLANCES = 1000
GLANCE_NS = 10_000

#: Longest virtual time that all threads may wait before that counts as a mistake.
PATIENCE_NS = 3600 * 1_000_000_000


class Participant:
    """A thread that takes part."""

    __slots__ = ("finished", "interrupt", "joiners", "name", "real", "turn", "wait")

    def __init__(self, name: str) -> None:
        self.name = name
        #: Held except for the moment in which the thread is given its turn.
        self.turn = REAL.allocate_lock()
        self.turn.acquire()
        self.wait: Optional[Wait] = None
        self.finished = False
        self.joiners: list[Wait] = []
        #: True while it waits for the operating system, as any thread does.
        self.real = False
        #: What is raised in it when it has its turn.
        self.interrupt: Optional[BaseException] = None


class Wait:
    """One wait of one participant. It ends once: it was woken, or its time came."""

    __slots__ = ("ended", "participant", "reason", "woken")

    def __init__(self, participant: Participant, reason: str) -> None:
        self.participant = participant
        self.reason = reason
        self.ended = False
        self.woken = False


class VirtualTime:
    """The turns of the participants, and the world that is moved when all of them wait."""

    def __init__(self, world: World) -> None:
        self.world = world
        self.process = os.getpid()
        #: In use so many times over.
        self.depth = 0
        #: The test that began it, in pytest's words.
        self.begun_in = os.environ.get("PYTEST_CURRENT_TEST", "")
        self.closed = False
        self._owner = Participant(threading.current_thread().name)
        self._participants: dict[int, Participant] = {REAL.get_ident(): self._owner}
        self._ready: deque[Participant] = deque()
        self._moments: list[tuple[int, int, Wait]] = []
        self._numbers = itertools.count()
        self._listeners: dict[int, Wait] = {}
        self._watchers: list[tuple[Callable[[], bool], Wait]] = []
        self._jobs: dict[int, Callable[[], None]] = {}
        #: Woken by threads that take no part: their turn is not now.
        self._from_outside: deque[Wait] = deque()
        self._glances = 0
        #: A world that is restored goes back; its clock never does.
        self._offset_ns = 0
        self._latest_ns = 0

    # The clock.

    def now_ns(self) -> int:
        """Time since the world began, in ns; goes on when the world is restored."""
        now_ns = self.world.now_ns + self._offset_ns
        if now_ns < self._latest_ns:
            self._offset_ns += self._latest_ns - now_ns
            now_ns = self._latest_ns
        self._latest_ns = now_ns
        return now_ns

    def glance_ns(self) -> int:
        """What the clock shows to a participant that reads it."""
        self._glance()
        return self.now_ns()

    def _glance(self) -> None:
        self._glances += 1
        if self._glances > FREE_GLANCES:
            self._go_on(GLANCE_NS)

    def _go_on(self, ns: int) -> None:
        """Lets the others have their turns, and so much time pass, without being a wait that the program asked for."""
        glances = self._glances
        self.wait(self.begin("sleeps"), self.now_ns() + ns)
        self._glances = glances

    def current(self) -> Optional[Participant]:
        """The participant that this thread is; None for one that takes no part, or waits as any thread does."""
        participant = self._participants.get(REAL.get_ident())
        return None if participant is None or participant.real or self.closed else participant

    # Waiting.

    def sleep_ns(self, ns: int) -> None:
        """Waits so long. To sleep for no time is to look again whether something has happened."""
        if ns == 0:
            self._go_on(0)
            self._glance()
            return
        self.wait(self.begin("sleeps"), self.now_ns() + ns)

    def begin(self, reason: str) -> Wait:
        """A wait of this thread, to be handed to what ends it before it is waited for."""
        participant = self.current()
        if participant is None:
            raise RuntimeError("this thread takes no part in the virtual time")
        return Wait(participant, reason)

    def wait(self, wait: Wait, until_ns: Optional[int] = None) -> bool:
        """Waits until it is woken (True), or until then (False)."""
        me = wait.participant
        self._glances = 0
        if until_ns is not None:
            self._note_moment(until_ns, wait)
        me.wait = wait
        try:
            following = self._next()
        except BaseException:
            wait.ended = True
            raise
        if following is not me:
            try:
                following.turn.release()
            finally:
                # Whatever is raised here (Ctrl-C), two must not run.
                self._take_turn(me)
        me.wait = None
        wait.ended = True
        if me.interrupt is not None:
            interrupt, me.interrupt = me.interrupt, None
            raise interrupt
        return wait.woken

    def _note_moment(self, until_ns: int, wait: Wait) -> None:
        heapq.heappush(self._moments, (until_ns, next(self._numbers), wait))
        # Waits that ended early stay until their time comes, which may be long.
        if len(self._moments) > 64 + 4 * len(self._participants):
            self._moments = [moment for moment in self._moments if not moment[2].ended]
            heapq.heapify(self._moments)

    def hear(self, probe: int, until_ns: Optional[int]) -> bool:
        """Waits for a frame at an adapter of the world."""
        if probe in self._listeners:
            raise RuntimeError("two threads wait for frames of one bus; give each a bus of its own")
        wait = self.begin("waits for a frame")
        self._listeners[probe] = wait
        try:
            return self.wait(wait, until_ns)
        finally:
            self._listeners.pop(probe, None)

    def watch(self, happened: Callable[[], bool], until_ns: Optional[int]) -> bool:
        """Waits until `happened()`, which is asked whenever a thread has had a turn."""
        wait = self.begin("waits for events")
        entry = (happened, wait)
        self._watchers.append(entry)
        try:
            return self.wait(wait, until_ns)
        finally:
            self._watchers.remove(entry)

    def on_done(self, job: int, callback: Callable[[], None]) -> None:
        """Has `callback` called when a job of the world has ended."""
        self._jobs[job] = callback

    def forget(self, job: int) -> None:
        """A job that was given up."""
        self._jobs.pop(job, None)

    def wake(self, wait: Wait) -> None:
        """Ends a wait. Its thread runs when its turn comes."""
        if self.current() is None and not self.closed:
            self._from_outside.append(wait)
        else:
            self._end(wait, woken=True)

    # Threads.

    def start(self, thread: threading.Thread) -> None:
        """Starts a thread that takes part; it runs when its turn comes."""
        me, newcomer, run = self.current(), Participant(thread.name), thread.run
        assert me is not None

        def take_part() -> None:
            self._participants[REAL.get_ident()] = newcomer
            self._take_turn(newcomer)
            try:
                run()
            finally:
                self._leave(newcomer)

        thread.run = take_part  # type: ignore[method-assign]
        thread._ferrodrive = newcomer  # type: ignore[attr-defined]
        # The operating system starts it; that takes none of our time.
        me.real = True
        try:
            REAL.start(thread)
        except BaseException:
            thread.run = run  # type: ignore[method-assign]
            raise
        finally:
            me.real = False
        self._ready.append(newcomer)

    def join(self, thread: threading.Thread, newcomer: Participant, until_ns: Optional[int]) -> None:
        """Waits for the end of a thread that takes part."""
        if not newcomer.finished:
            wait = self.begin(f"waits for the end of {newcomer.name}")
            newcomer.joiners.append(wait)
            self.wait(wait, until_ns)
        if newcomer.finished or self.closed:
            me = self._participants.get(REAL.get_ident())
            if me is not None:
                me.real = True
            try:
                REAL.join(thread)
            finally:
                if me is not None:
                    me.real = False

    def close(self) -> None:
        """Ends it. Threads that still wait go on in real time, as if their wait had run out."""
        me = self._participants.get(REAL.get_ident())
        self.closed = True
        # A thread that was started and had no turn yet may be in the one or in both.
        for participant in {*self._participants.values(), *self._ready}:
            if participant is not me:
                participant.turn.release()

    # Whose turn it is.

    def _next(self) -> Participant:
        """Which thread runs next: moves the world until one may."""
        idle_since_ns = self.now_ns()
        while True:
            while self._from_outside:
                self._end(self._from_outside.popleft(), woken=True)
            self._ask_watchers()
            if self._ready:
                return self._ready.popleft()
            if not self._move_world(idle_since_ns + PATIENCE_NS):
                self._interrupt_owner(Stalled(f"no thread can go on: {self._who_waits()}"))

    def _move_world(self, patience_ns: int) -> bool:
        """Moves the world to the first event that a thread waits for; False if there will never be any."""
        until_ns = patience_ns
        while self._moments and self._moments[0][2].ended:
            heapq.heappop(self._moments)
        if self._moments:
            until_ns = min(until_ns, self._moments[0][0])
        probes = list(self._listeners)
        came = self.world.advance(max(0, until_ns - self._offset_ns), probes)
        if came is None:
            return self._end_moments() or self.now_ns() < patience_ns
        what, which = came
        if what == "heard":
            self._end(self._listeners[probes[which]], woken=True)
        elif what == "done" and (callback := self._jobs.pop(which, None)) is not None:
            callback()
        return True

    def _end_moments(self) -> bool:
        """Ends the waits whose time has come, in the order in which they were begun."""
        now_ns, any_ended = self.now_ns(), False
        while self._moments and self._moments[0][0] <= now_ns:
            wait = heapq.heappop(self._moments)[2]
            any_ended = any_ended or not wait.ended
            self._end(wait, woken=False)
        return any_ended

    def _ask_watchers(self) -> None:
        for happened, wait in list(self._watchers):
            if not wait.ended and happened():
                self._end(wait, woken=True)

    def _end(self, wait: Wait, woken: bool) -> None:
        if not wait.ended:
            wait.ended, wait.woken = True, woken
            self._ready.append(wait.participant)

    def _take_turn(self, me: Participant) -> None:
        """Waits for the turn. An interrupt (Ctrl-C) that comes meanwhile is raised when the thread has it."""
        while True:
            try:
                me.turn.acquire()
                return
            except BaseException as interrupt:
                me.interrupt = interrupt
                if me.wait is not None:
                    self._from_outside.append(me.wait)

    def _leave(self, me: Participant) -> None:
        """The end of a thread: those that wait for it go on, and the next one has its turn."""
        me.finished = True
        self._participants.pop(REAL.get_ident(), None)
        if self.closed:
            return
        for wait in me.joiners:
            self._end(wait, woken=True)
        while True:
            try:
                self._next().turn.release()
                return
            except BaseException as error:
                self._interrupt_owner(error)

    def _interrupt_owner(self, error: BaseException) -> None:
        """Has an error raised in the thread that began it all, where people look for it."""
        owner = self._owner
        if owner.wait is None or owner.wait.ended:
            raise error
        owner.interrupt = error
        self._end(owner.wait, woken=False)

    def _who_waits(self) -> str:
        waiting = (p for p in self._participants.values() if p.wait is not None)
        return "; ".join(f"{participant.name} {participant.wait.reason}" for participant in waiting if participant.wait)


_active: Optional[VirtualTime] = None


def active() -> Optional[VirtualTime]:
    """The virtual time in use."""
    return _active


def taking_part(world: Any = None) -> Optional[VirtualTime]:
    """The virtual time in which this thread takes part, if it is that of this world, or of any."""
    time = _active
    if time is None or time.current() is None or (world is not None and time.world is not world):
        return None
    return time


def enter(world: World) -> VirtualTime:
    """Begins the virtual time of a world, or uses the one in use once more. Each needs its :func:`leave`."""
    global _active
    if _active is None:
        time = VirtualTime(world)
        stand_ins.install(time)
        _active = time
    elif _active.world is not world:
        since = f" since {_active.begun_in}" if _active.begun_in else ""
        raise TimeInUse(
            f"the virtual time of another world, {_active.world!r}, is in use{since}, and a program has one time. Where that was left over "
            "(by an earlier test), close what uses it there: bus.shutdown() of a can.Bus, network.disconnect() of canopen, or the `with` "
            "block of virtual_time; the fixture ferrodrive_world does so by itself. Otherwise put all drives into one world"
        )
    elif _active.current() is None:
        raise TimeInUse("a thread that took no part when the virtual time began cannot use it; open the bus in the thread that began it")
    _active.depth += 1
    return _active


def leave(time: VirtualTime, for_good: bool = False) -> None:
    """Ends one use; after the last, or for good, the clock is the real one again."""
    global _active
    if time is not _active:
        return
    time.depth -= 1
    if time.depth == 0 or for_good:
        _active = None
        stand_ins.remove()
        time.close()


@contextlib.contextmanager
def virtual_time(world: World) -> Iterator[World]:
    """While in use, ``time.sleep``, ``time.time`` and what waits in ``threading``, ``queue``, ``concurrent.futures``, ``asyncio`` and
    python-can go by the time of `world`. A program has one such time, and so one world in it.

    ::

        with ferrodrive.virtual_time(world):
            bus = can.Bus(interface="ferrodrive", channel=world)
            ...

    It ends with the block, whatever was left open in it. What waits for the operating system (``select.select``, sockets,
    ``subprocess``) takes no virtual time; nor does ``sched.scheduler()``, which keeps the real clock by its defaults.

    >>> import time
    >>> with ferrodrive.virtual_time(world):
    ...     begin = world.now
    ...     time.sleep(2)
    ...     round(world.now - begin, 3)
    2.0
    """
    time = enter(world)
    began_it = time.depth == 1
    try:
        yield world
    finally:
        leave(time, for_good=began_it)


def _after_fork_in_child() -> None:
    """The child has one thread and a copy of a world that is not its own: it goes by the real clock."""
    global _active
    if _active is not None:
        _active.closed = True
        _active = None
        stand_ins.remove()


def _at_exit() -> None:
    """The interpreter is about to wait for its threads: they go on in real time."""
    if _active is not None:
        leave(_active, for_good=True)


threading._register_atexit(_at_exit)  # type: ignore[attr-defined]
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork_in_child)
