"""The list of checks, and how a check says what it expected."""

import time
from typing import Any, Callable, NamedTuple

CHECKS = []


class Check(NamedTuple):
    #: The drive's folder.
    folder: str
    name: str
    function: Callable
    #: What the bench is made with, beside the folder's own drive: see `Bench`.
    setup: dict[str, Any]


class Skip(Exception):
    """The check cannot run here; the text says why."""


def check(name, **setup):
    """Adds a function of a bench to the list, under a sentence and for the drive in whose folder it stands."""

    def add(function):
        CHECKS.append(Check(function.__module__.partition(".")[0], name, function, setup))
        return function

    return add


class Common:
    """Checks that hold for several drives: written once, taken into the list for each."""

    def __init__(self):
        self.members = []

    def check(self, name, **setup):
        def add(function):
            self.members.append((name, function, setup))
            return function

        return add

    def into(self, folder):
        CHECKS.extend(Check(folder, *member) for member in self.members)


def equal(actual, expected, what):
    if actual != expected:
        raise AssertionError(f"{what}: expected {shown(expected)}, got {shown(actual)}")


def near(actual, expected, tolerance, what):
    if abs(actual - expected) > tolerance:
        raise AssertionError(f"{what}: expected {expected} within {tolerance}, got {actual}")


def true(condition, what):
    if not condition:
        raise AssertionError(what)


def eventually(function, accept, what, timeout_s=5.0):
    """Calls `function` until `accept(value)` holds, and returns that value."""
    end = time.monotonic() + timeout_s
    while True:
        value = function()
        if accept(value):
            return value
        if time.monotonic() > end:
            raise AssertionError(f"{what}: not within {timeout_s} s, last {shown(value)}")
        time.sleep(0.01)


def shown(value):
    if isinstance(value, bool) or not isinstance(value, int):
        return repr(value)
    return f"{value} ({value:#x})"
