"""Everything of Python that waits, in virtual time."""

import asyncio
import concurrent.futures
import os
import queue
import random
import sched
import select
import signal
import subprocess
import sys
import threading
import time
from time import monotonic as held_by_name

import ferrodrive
import pytest
from ferrodrive import turns
from ferrodrive.real_time import REAL


@pytest.fixture
def world():
    return ferrodrive.World()


def test_sleeping_takes_virtual_time_alone(world):
    begin = REAL.monotonic()
    with ferrodrive.virtual_time(world):
        before = (time.time(), time.monotonic(), time.perf_counter_ns(), held_by_name())
        time.sleep(1000)
        assert time.time() - before[0] == 1000
        assert time.monotonic() - before[1] == 1000
        assert time.perf_counter_ns() - before[2] == 1000 * 10**9
        assert held_by_name() - before[3] == 1000
    assert world.now == 1000
    assert REAL.monotonic() - begin < 60
    assert (time.time, held_by_name, threading.Lock) == (REAL.time, REAL.monotonic, REAL.Lock)


def test_threads_run_in_the_order_of_their_moments(world):
    heard = []

    def say(name, after, every):
        time.sleep(after)
        for _ in range(3):
            heard.append((name, round(time.monotonic(), 6)))
            time.sleep(every)

    with ferrodrive.virtual_time(world):
        threads = [threading.Thread(target=say, args=args) for args in (("a", 0.03, 0.02), ("b", 0.01, 0.02))]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert time.monotonic() == pytest.approx(0.09)
    # At 0.03 and 0.05 both are due; who began to wait first goes first.
    assert heard == [("b", 0.01), ("a", 0.03), ("b", 0.03), ("a", 0.05), ("b", 0.05), ("a", 0.07)]


def test_a_queue_hands_over_at_once_and_times_out_when_told(world):
    with ferrodrive.virtual_time(world):
        for kind in (queue.Queue, queue.SimpleQueue, queue.PriorityQueue):
            begin, items = time.monotonic(), kind()
            threading.Timer(0.25, items.put, (5,)).start()
            assert items.get(timeout=1) == 5
            assert time.monotonic() - begin == pytest.approx(0.25)
            with pytest.raises(queue.Empty):
                items.get(timeout=0.5)
            assert time.monotonic() - begin == pytest.approx(0.75)


def test_what_was_made_before_waits_in_virtual_time_too(world):
    items, event, condition = queue.Queue(), threading.Event(), threading.Condition()
    with ferrodrive.virtual_time(world):
        with pytest.raises(queue.Empty):
            items.get(timeout=2)
        assert event.wait(3) is False
        with condition:
            assert condition.wait(4) is False
        assert time.monotonic() == 9


def test_locks_are_had_by_one_after_the_other(world):
    order = []

    def hold(name):
        with lock:
            order.append(name)
            time.sleep(0.1)

    with ferrodrive.virtual_time(world):
        for lock in (threading.Lock(), threading.RLock(), threading.Semaphore(1)):
            threads = [threading.Thread(target=hold, args=(name,)) for name in "abc"]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
        lock = threading.Lock()
        assert lock.acquire() and not lock.acquire(timeout=0.5) and not lock.acquire(blocking=False)
        lock.release()
        assert time.monotonic() == pytest.approx(3 * 0.3 + 0.5)
    assert order == list("abcabcabc")
    assert lock.acquire(timeout=0.01) and lock.locked()


def test_join_waits_no_longer_than_told(world):
    with ferrodrive.virtual_time(world):
        thread = threading.Thread(target=time.sleep, args=(10,))
        thread.start()
        thread.join(1)
        assert thread.is_alive() and time.monotonic() == 1
        thread.join()
        assert not thread.is_alive() and time.monotonic() == 10


def test_executors_and_barriers_work(world):
    def nap(seconds):
        time.sleep(seconds)
        return seconds

    with ferrodrive.virtual_time(world):
        with concurrent.futures.ThreadPoolExecutor(4) as pool:
            assert list(pool.map(nap, [3, 1, 2])) == [3, 1, 2]
        assert time.monotonic() == 3
        barrier = threading.Barrier(2)
        threading.Timer(2, barrier.wait).start()
        barrier.wait(timeout=5)
        assert time.monotonic() == 5


def test_asyncio_sleeps_in_virtual_time(world):
    async def main():
        loop = asyncio.get_running_loop()
        threading.Timer(1.5, loop.call_soon_threadsafe, (event.set,)).start()
        await asyncio.gather(asyncio.sleep(1), event.wait())
        with pytest.raises(asyncio.TimeoutError):
            await asyncio.wait_for(asyncio.Event().wait(), 2)
        return loop.time()

    event = asyncio.Event()
    with ferrodrive.virtual_time(world):
        assert asyncio.run(main()) == pytest.approx(3.5)


def test_a_program_that_only_looks_at_the_clock_gets_there(world):
    with ferrodrive.virtual_time(world):
        end = time.monotonic() + 0.1
        while time.monotonic() < end:
            pass
        assert time.monotonic() == pytest.approx(0.1, abs=0.001)


def odd_lengths(count, seed=1):
    """Lengths of waits of which floats hold none exactly."""
    numbers = random.Random(seed)
    return [numbers.choice((0.1, 0.2, 0.3, numbers.random())) for _ in range(count)]


def test_what_rounding_leaves_of_a_wait_is_waited_for(world):
    """``end - monotonic()`` leaves less than half a nanosecond, for which the clock must not stand still."""
    items, condition, semaphore = queue.Queue(), threading.Condition(), threading.Semaphore(0)

    def of_queue(length):
        with pytest.raises(queue.Empty):
            items.get(timeout=length)

    def of_condition(length):
        with condition:
            assert not condition.wait_for(lambda: False, length)

    def of_semaphore(length):
        assert not semaphore.acquire(timeout=length)

    def of_loop(length):
        end = time.monotonic() + length
        while (now := time.monotonic()) < end:
            time.sleep(end - now)

    with ferrodrive.virtual_time(world):
        for wait in (of_queue, of_condition, of_semaphore, of_loop):
            for length in odd_lengths(250):
                begin = time.monotonic()
                wait(length)
                assert time.monotonic() - begin == pytest.approx(length, abs=1e-8)
        # Where two floats have nothing between them, the shortest wait of all.
        before = world.now_ns
        time.sleep(1e-12)
        assert world.now_ns == before + 1


def test_what_waits_for_the_operating_system_takes_no_virtual_time(world):
    with ferrodrive.virtual_time(world):
        subprocess.run([sys.executable, "-c", "import time; time.sleep(0.05)"], check=True)
        reader, writer = os.pipe()
        select.select([reader], [], [], 0.01)
        os.close(reader), os.close(writer)
        assert world.now == 0
        by_name = sched.scheduler(time.monotonic, time.sleep)
        by_name.enter(0.7, 1, lambda: None)
        by_name.run()
        assert world.now == pytest.approx(0.7)


def test_sleeping_for_no_time_again_and_again_takes_time(world):
    with ferrodrive.virtual_time(world):
        end = time.monotonic() + 0.1
        while time.monotonic() < end:
            time.sleep(0)
        assert time.monotonic() == pytest.approx(0.1, abs=0.001)
        # Once in a while it only lets the others have their turns.
        time.sleep(1)
        before = world.now_ns
        time.sleep(0)
        assert world.now_ns == before


def test_waiting_for_what_can_never_come_is_an_error_that_says_who_waits(world):
    with ferrodrive.virtual_time(world), pytest.raises(ferrodrive.Stalled, match="MainThread waits for another thread"):
        threading.Event().wait()
    with ferrodrive.virtual_time(world):
        thread = threading.Thread(target=threading.Event().wait, name="the other", daemon=True)
        thread.start()
        with pytest.raises(ferrodrive.Stalled, match="the other waits"):
            thread.join()


def test_threads_from_before_keep_the_real_clock(world):
    go, seen = threading.Event(), []

    def look():
        go.wait()
        seen.append(time.time())

    outsider = threading.Thread(target=look)
    outsider.start()
    with ferrodrive.virtual_time(world):
        go.set()
        outsider.join()
        assert abs(seen[0] - REAL.time()) < 60


def test_a_thread_that_is_left_behind_goes_on_in_real_time(world):
    done = threading.Event()

    def outlive():
        time.sleep(1000)
        done.set()

    with ferrodrive.virtual_time(world):
        thread = threading.Thread(target=outlive)
        thread.start()
        time.sleep(1)
    assert done.wait(30)
    thread.join(30)
    assert not thread.is_alive()


def test_an_error_ends_the_time_too(world):
    with pytest.raises(ZeroDivisionError), ferrodrive.virtual_time(world):
        time.sleep(1 / 0)
    assert time.sleep is REAL.sleep


def test_one_program_has_one_time(world):
    with ferrodrive.virtual_time(world), ferrodrive.virtual_time(world):
        with pytest.raises(ferrodrive.TimeInUse), ferrodrive.virtual_time(ferrodrive.World()):
            pass
        time.sleep(1)
    assert world.now == 1


def test_the_clock_does_not_go_back_with_the_world(world):
    with ferrodrive.virtual_time(world):
        before = world.snapshot()
        time.sleep(2)
        world.restore(before)
        assert (world.now, time.monotonic()) == (0, 2)
        time.sleep(1)
        assert (world.now, time.monotonic()) == (1, 3)


def test_a_program_that_forgets_to_end_its_time_ends_all_the_same():
    script = """
import threading, time, ferrodrive
from ferrodrive import turns
turns.enter(ferrodrive.World())
threading.Thread(target=time.sleep, args=(5,)).start()
time.sleep(1)
print("the end", flush=True)
"""
    ended = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60)
    assert (ended.returncode, ended.stdout, ended.stderr) == (0, "the end\n", "")


def test_waits_that_end_early_leave_nothing_behind(world):
    with ferrodrive.virtual_time(world):
        items = queue.Queue()
        for number in range(2000):
            threading.Timer(0.001, items.put, (number,)).start()
            assert items.get(timeout=10_000) == number
        assert len(turns.active()._moments) < 100


@pytest.fixture
def ctrl_c_interrupts():
    # A shell starts what runs in its background with SIGINT ignored, and Python leaves it so: the signal would be lost.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("ctrl_c_interrupts")
def test_ctrl_c_comes_through_while_the_world_moves(world):
    world.add("zlac8030l", node=4)
    killer = threading.Timer(0.5, signal.raise_signal, (signal.SIGINT,))
    killer.start()
    with ferrodrive.virtual_time(world), pytest.raises(KeyboardInterrupt):
        while True:
            time.sleep(3000)
    killer.join()
    world.run_for(0.1)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork on this system")
@pytest.mark.filterwarnings("ignore:.*multi-threaded.*:DeprecationWarning")
def test_a_forked_process_goes_by_the_real_clock(world):
    with ferrodrive.virtual_time(world):
        thread = threading.Thread(target=time.sleep, args=(5,))
        thread.start()
        child = os.fork()
        if child == 0:
            status = 1
            try:
                lock = threading.Lock()
                time.sleep(0.001)
                real = abs(time.time() - REAL.time()) < 60
                status = 42 if real and lock.acquire(timeout=1) else 2
            finally:
                os._exit(status)
        assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 42
        thread.join()
        assert time.monotonic() == 5
