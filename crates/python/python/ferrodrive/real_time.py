"""The clock and the threads of the operating system, as they were before anything stood in for them."""

from __future__ import annotations

import _thread
import queue
import selectors
import threading
import time as clock


class Real:
    """What the stand-ins replace, and fall back to."""

    time = staticmethod(clock.time)
    time_ns = staticmethod(clock.time_ns)
    monotonic = staticmethod(clock.monotonic)
    monotonic_ns = staticmethod(clock.monotonic_ns)
    perf_counter = staticmethod(clock.perf_counter)
    perf_counter_ns = staticmethod(clock.perf_counter_ns)
    sleep = staticmethod(clock.sleep)
    allocate_lock = staticmethod(_thread.allocate_lock)
    get_ident = staticmethod(_thread.get_ident)
    Lock = threading.Lock
    RLock = threading.RLock
    SimpleQueue = queue.SimpleQueue
    start = staticmethod(threading.Thread.start)
    join = staticmethod(threading.Thread.join)
    DefaultSelector = selectors.DefaultSelector
    select = staticmethod(selectors.DefaultSelector.select)


REAL = Real
