"""What replaces the clock and for threads while a virtual time is in use, and how it gets there.

Replaced are ``time.time``, ``monotonic``, ``perf_counter`` (with their ``_ns``) and ``sleep``; ``threading.Lock``, ``RLock`` and
what ``Condition`` makes its locks with, so that all of ``threading`` and ``queue`` waits here; ``queue.SimpleQueue``;
``Thread.start`` and ``join``; and the wait of an asyncio loop. Modules that hold one of these by name (``from time import
monotonic``) have it replaced there too. A lock that was made meanwhile is an ordinary lock after.
"""

from __future__ import annotations

import asyncio.events
import queue
import sys
import threading
from collections import deque
from types import ModuleType
from typing import TYPE_CHECKING, Any, Optional

from .real_time import REAL

if TYPE_CHECKING:
    from .turns import VirtualTime, Wait

#: What ``time.time()`` begins with: 2001-09-09 01:46:40 UTC. Any moment would do; runs must not differ by it.
EPOCH_NS = 1_000_000_000 * 1_000_000_000

#: Modules that keep the real clock: those that look at the program from outside, or wait for other processes.
LEFT_ALONE = (
    "_frozen_importlib", "_pytest", "_thread", "_queue", "coverage", "debugpy", "execnet", "faulthandler", "ferrodrive.real_time",
    "ferrodrive.stand_ins", "importlib", "multiprocessing", "pluggy", "pydevd", "pytest", "pytest_timeout", "subprocess", "xdist",
)  # fmt: skip


#: The virtual time that the stand-ins go by.
_time: Optional[VirtualTime] = None


def current_time() -> Optional[VirtualTime]:
    """The virtual time in which this thread takes part."""
    time = _time
    return None if time is None or time.current() is None else time


def time_ns() -> int:
    """Stands in for ``time.time_ns``."""
    return REAL.time_ns() if (time := current_time()) is None else EPOCH_NS + time.glance_ns()


def time_s() -> float:
    """Stands in for ``time.time``."""
    return REAL.time() if (time := current_time()) is None else (EPOCH_NS + time.glance_ns()) / 1e9


def monotonic_ns() -> int:
    """Stands in for ``time.monotonic_ns``."""
    return REAL.monotonic_ns() if (time := current_time()) is None else time.glance_ns()


def monotonic() -> float:
    """Stands in for ``time.monotonic``."""
    return REAL.monotonic() if (time := current_time()) is None else time.glance_ns() / 1e9


def perf_counter_ns() -> int:
    """Stands in for ``time.perf_counter_ns``."""
    return REAL.perf_counter_ns() if (time := current_time()) is None else time.glance_ns()


def perf_counter() -> float:
    """Stands in for ``time.perf_counter``."""
    return REAL.perf_counter() if (time := current_time()) is None else time.glance_ns() / 1e9


def wait_ns(seconds: float) -> int:
    """How long a wait of so many seconds is. One that is longer than nothing takes 1 ns at least: programs wait for the rest,
    ``end - time.monotonic()``, again and again until there is none, and the rounding of floats leaves less than 1 ns of it."""
    return max(round(seconds * 1e9), 1 if seconds > 0 else 0)


def sleep(seconds: float) -> None:
    """Stands in for ``time.sleep``."""
    if (time := current_time()) is None:
        REAL.sleep(seconds)
    elif seconds < 0:
        raise ValueError("sleep length must be non-negative")
    else:
        time.sleep_ns(wait_ns(seconds))


class Lock:
    """Stands in for ``threading.Lock``: a participant that waits for it lets the others have their turns."""

    __slots__ = ("__weakref__", "_lock", "_waits")

    def __init__(self) -> None:
        self._lock = REAL.allocate_lock()
        self._waits: deque[Wait] = deque()

    def acquire(self, blocking: bool = True, timeout: float = -1) -> bool:
        """As that of a lock."""
        if not blocking:
            return self._lock.acquire(False) if timeout == -1 else self._lock.acquire(False, timeout)
        if self._lock.acquire(False):
            return True
        time = current_time()
        return self._lock.acquire(True, timeout) if time is None else self._acquire(time, timeout)

    def _acquire(self, time: VirtualTime, timeout_s: float) -> bool:
        if timeout_s < 0 and timeout_s != -1:
            raise ValueError("timeout value must be a non-negative number")
        until_ns = None if timeout_s == -1 else time.now_ns() + wait_ns(timeout_s)
        while True:
            wait = time.begin("waits for another thread")
            self._waits.append(wait)
            # A thread that takes no part may have released it just now, and seen no thread wait.
            if self._lock.acquire(False):
                self._waits.remove(wait)
                return True
            try:
                woken = time.wait(wait, until_ns)
            finally:
                if wait in self._waits:
                    self._waits.remove(wait)
            if time.closed:
                return self._lock.acquire(True, timeout_s)
            if not woken:
                return False
            if self._lock.acquire(False):
                return True

    def release(self) -> None:
        """As that of a lock."""
        self._lock.release()
        if self._waits and (time := _time) is not None:
            time.wake(self._waits.popleft())

    def locked(self) -> bool:
        """As that of a lock."""
        return self._lock.locked()

    def __enter__(self) -> bool:
        return self.acquire()

    def __exit__(self, *_: object) -> None:
        self.release()

    def _at_fork_reinit(self) -> None:
        self._lock = REAL.allocate_lock()
        self._waits.clear()


def start(thread: threading.Thread) -> None:
    """Stands in for ``Thread.start``: what a participant starts takes part."""
    if (time := current_time()) is None:
        REAL.start(thread)
    else:
        time.start(thread)


def join(thread: threading.Thread, timeout: Optional[float] = None) -> None:
    """Stands in for ``Thread.join``."""
    time, newcomer = current_time(), getattr(thread, "_ferrodrive", None)
    if time is None or newcomer is None or thread is threading.current_thread():
        REAL.join(thread, timeout)
    else:
        time.join(thread, newcomer, None if timeout is None else time.now_ns() + wait_ns(timeout))


def select(selector: Any, timeout: Optional[float] = None) -> Any:
    """Stands in for the wait of an asyncio loop. Other selectors wait for the operating system, as ever."""
    time, loop = current_time(), asyncio.events._get_running_loop()
    of_loop: Any = getattr(loop, "_selector", None)
    if time is None or of_loop is not selector:
        return REAL.select(selector, timeout)
    ready = REAL.select(selector, 0)
    if ready or (timeout is not None and timeout <= 0):
        return ready
    until_ns = None if timeout is None else time.now_ns() + wait_ns(timeout)

    def happened() -> bool:
        ready.extend(REAL.select(selector, 0))
        return bool(ready)

    time.watch(happened, until_ns)
    return ready


#: What is replaced where a module holds it by name, by identity.
BY_NAME: dict[int, tuple[Any, Any]] = {
    id(real): (real, stand_in)
    for real, stand_in in (
        (REAL.time, time_s),
        (REAL.time_ns, time_ns),
        (REAL.monotonic, monotonic),
        (REAL.monotonic_ns, monotonic_ns),
        (REAL.perf_counter, perf_counter),
        (REAL.perf_counter_ns, perf_counter_ns),
        (REAL.sleep, sleep),
        (REAL.allocate_lock, Lock),
        (REAL.Lock, Lock),
        # The pure ones of the standard library, which stand on the lock above.
        (REAL.RLock, threading._PyRLock),  # type: ignore[attr-defined]
        (REAL.SimpleQueue, queue._PySimpleQueue),  # type: ignore[attr-defined]
    )
}

_replaced: list[tuple[ModuleType, str, Any]] = []
#: Where names were found before: a module's dictionary seldom changes, and there are hundreds.
_found: dict[str, tuple[int, int, list[str]]] = {}


def install(time: VirtualTime) -> None:
    """Puts the stand-ins into place, which go by `time` from then on."""
    global _time
    for module_name, module in list(sys.modules.items()):
        if not isinstance(module, ModuleType) or module_name.startswith(LEFT_ALONE):
            continue
        for name in _names_in(module_name, module):
            real, stand_in = BY_NAME[id(vars(module)[name])]
            _replaced.append((module, name, real))
            setattr(module, name, stand_in)
    put_methods(start, join, select)
    _time = time


def remove() -> None:
    """Puts everything back."""
    global _time
    _time = None
    while _replaced:
        module, name, real = _replaced.pop()
        setattr(module, name, real)
    put_methods(REAL.start, REAL.join, REAL.select)


def put_methods(start: Any, join: Any, select: Any) -> None:
    """Puts three functions into the classes whose methods they are."""
    setattr(threading.Thread, "start", start)
    setattr(threading.Thread, "join", join)
    setattr(REAL.DefaultSelector, "select", select)


def _names_in(module_name: str, module: ModuleType) -> list[str]:
    """The names by which a module holds what is to be replaced."""
    held = vars(module)
    known = _found.get(module_name)
    if known is not None and known[:2] == (id(module), len(held)):
        return [name for name in known[2] if id(held.get(name)) in BY_NAME]
    names = [name for name, value in list(held.items()) if id(value) in BY_NAME]
    _found[module_name] = (id(module), len(held), names)
    return names
