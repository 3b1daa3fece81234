"""What an exchange with a physics engine costs beside the drive itself, and beside lines of text: processor time, in one run.

    python crates/python/benches/exchange.py
"""

import os
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


def cost_us(step, steps=STEPS, rounds=5):
    """The least processor time of a step in us."""
    least = float("inf")
    for _ in range(rounds):
        begin = time.process_time()
        for number in range(steps):
            step(number)
        least = min(least, time.process_time() - begin)
    return least / steps * 1e6


def exchange(world, drives, dt_s=0.001):
    # An engine hands its own arrays over; these stay as they are, so that only the exchange is counted.
    angle, speed = numpy.zeros(drives), numpy.zeros(drives)
    return lambda _: world.exchange(dt_s, angle, speed)


def text(world, drives):
    def step(number):
        for node in range(1, drives + 1):
            world.apply(f"{node} load torque {0.001 * (number % 7)}")
        world.apply("run 1ms")
        for node in range(1, drives + 1):
            world.apply(f"{node} get")

    return step


def main():
    print(f"load of the machine {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    for drives in (1, 3, 7):
        world = of(drives)
        with_arrays = cost_us(exchange(world, drives))
        # The same drives and the same control periods, from inside: one exchange of 200 ms instead of 200.
        inside = cost_us(exchange(world, drives, 0.2), 10) / 200
        lines = cost_us(text(of(drives, external=False), drives), 500)
        print(
            f"{drives} drives, us for each and ms: exchange {with_arrays / drives:.2f}, of it the drive {inside / drives:.2f}, "
            f"lines of text {lines / drives:.1f}; beside the drive {(with_arrays - inside) / drives:.2f} and {(lines - inside) / drives:.1f}, "
            f"{(lines - inside) / (with_arrays - inside):.0f} times less"
        )
    count = 64
    worlds = ferrodrive.Worlds([of(2).snapshot() for _ in range(count)])
    angle, speed = numpy.zeros((count, 2)), numpy.full((count, 2), 2.0)
    begin, began = time.process_time(), time.perf_counter()
    for _ in range(200):
        worlds.exchange(0.001, angle, speed)
        angle += 0.002
    used, took = time.process_time() - begin, time.perf_counter() - began
    print(f"{count} worlds of 2 drives: {used / 200 / count / 2 * 1e6:.2f} us of processor time for each drive and ms, {used / took:.2f} cores")


if __name__ == "__main__":
    main()
