"""What an exchange with a physics engine costs beside the drive itself, and beside lines of text: processor time, in one run.

    python crates/python/benches/exchange.py [target/release/ferrodrive]

With the program its standard input is measured, too: the same lines of text, to a simulator in a process of its own.
"""

import os
import pathlib
import sys
import time

import ferrodrive
import numpy

STEPS = 2000


def of(drives, external=True):
    world = ferrodrive.World()
    for node in range(1, drives + 1):
        world.add("zlac8030l", node=node)
    world.add_probe()
    if external:
        world.external(range(1, drives + 1))
    world.run_for(1)
    return world


def cost_us(step, steps=STEPS, rounds=20, used=time.process_time):
    """The least processor time of a step in us."""
    least = float("inf")
    for _ in range(rounds):
        begin = used()
        for number in range(steps):
            step(number)
        least = min(least, used() - begin)
    return least / steps * 1e6


def exchange(world, drives, dt_s=0.001):
    # An engine hands its own arrays over; these stay as they are, so that only the exchange is counted.
    angle, speed = numpy.zeros(drives), numpy.zeros(drives)
    return lambda _: world.exchange(dt_s, angle, speed)


def text(apply, drives):
    def step(number):
        for node in range(1, drives + 1):
            apply(f"{node} load torque {0.001 * (number % 7)}")
        apply("run 1ms")
        for node in range(1, drives + 1):
            apply(f"{node} get")

    return step


def over_pipes_us(program, drives):
    """Of a step by lines of text to another process, both of them counted."""
    specs = [f"zlac8030l@{node}" for node in range(1, drives + 1)]
    with ferrodrive.Simulator(specs, extra=["--clock", "manual"], path=program) as simulator:
        simulator.world("run 1s")
        tasks = pathlib.Path(f"/proc/{simulator.process.pid}/task")

        def used():
            other_ns = sum(int((task / "schedstat").read_text().split()[0]) for task in tasks.iterdir())
            return time.process_time() + other_ns / 1e9

        return cost_us(text(simulator.world, drives), 200, used=used)


def main(program=None):
    print(f"load of the machine {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    for drives in (1, 3, 7):
        world = of(drives)
        with_arrays = cost_us(exchange(world, drives))
        # The same drives and the same control periods, from inside: one exchange of 200 ms instead of 200.
        inside = cost_us(exchange(world, drives, 0.2), 10) / 200
        print(
            f"{drives} drives, us for each and ms: exchange {with_arrays / drives:.2f}, of it the drive {inside / drives:.2f}; "
            f"beside the drives {with_arrays - inside:.2f} in all"
        )
        lines = {"in the process": cost_us(text(of(drives, external=False).apply, drives), 500)}
        if program:
            lines["to another"] = over_pipes_us(program, drives)
        for where, cost in lines.items():
            times = (cost - inside) / (with_arrays - inside)
            print(f"    lines of text {where} {cost / drives:.1f}, beside the drives {cost - inside:.1f} in all: {times:.0f} times as much")
    count = 64
    worlds = ferrodrive.Worlds([of(2).snapshot() for _ in range(count)])
    angle, speed = numpy.zeros((count, 2)), numpy.full((count, 2), 2.0)
    begin, began = time.process_time(), time.thread_time()
    for _ in range(200):
        worlds.exchange(0.001, angle, speed)
        angle += 0.002
    used, own = time.process_time() - begin, time.thread_time() - began
    print(f"{count} worlds of 2 drives: {used / 200 / count / 2 * 1e6:.2f} us for each drive and ms, {used / own:.2f} times what this thread took")


if __name__ == "__main__":
    main(*sys.argv[1:])
