"""A world that follows the clock: in real time, or so many times as fast."""

from __future__ import annotations

import weakref
from typing import TYPE_CHECKING, Optional

from .real_time import REAL

if TYPE_CHECKING:
    from .world import World

#: How long a reader sleeps at most before it looks at the clock and the wire again, in s.
LONGEST_NAP_S = 0.001
#: How long a thread sleeps for which no time passes, in s.
DOZE_S = 0.05

_of_world: weakref.WeakKeyDictionary[World, Pace] = weakref.WeakKeyDictionary()


class Pace:
    """Brings a world up to the clock each time that its bus is used. Nothing runs in between: a world that is not looked at stands
    still and catches up at once."""

    def __init__(self, world: World, speed: float) -> None:
        if not speed > 0:
            raise ValueError(f"{speed} is not a pace; expected virtual seconds for each second, more than 0")
        self._world = weakref.ref(world)
        self.speed = speed
        self._begin_s = REAL.monotonic()
        self._begin_ns = world.now_ns

    @staticmethod
    def of(world: World, speed: float) -> Pace:
        """The pace of a world: the first bus says which."""
        pace = _of_world.get(world)
        if pace is None:
            pace = _of_world[world] = Pace(world, speed)
        if pace.speed != speed:
            raise ValueError(f"the world goes at a pace of {pace.speed} already, not {speed}")
        return pace

    def catch_up(self) -> None:
        """Moves the world to what the clock shows."""
        if (world := self._world()) is not None:
            target_ns = self._begin_ns + int((REAL.monotonic() - self._begin_s) * self.speed * 1e9)
            if (behind_ns := target_ns - world.now_ns) > 0:
                world.run_ns(behind_ns)

    def hear(self, probe: int, timeout_s: Optional[float]) -> None:
        """Waits until an adapter has heard a frame, for so many seconds of the clock at most."""
        end_s = None if timeout_s is None else REAL.monotonic() + timeout_s
        while (world := self._world()) is not None:
            left_s = LONGEST_NAP_S if end_s is None else end_s - REAL.monotonic()
            # The world comes up to the end of the wait before it is given up.
            self.catch_up()
            if world.has_heard(probe) or left_s <= 0:
                return
            REAL.sleep(min(left_s, LONGEST_NAP_S))

    @staticmethod
    def doze(timeout_s: Optional[float]) -> None:
        """Waits where nothing can come."""
        REAL.sleep(DOZE_S if timeout_s is None else min(timeout_s, DOZE_S))
