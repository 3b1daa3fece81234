"""The list of checks, and how a check says what it expected."""

import time
from typing import Any, Callable, NamedTuple

CHECKS = []


class Check(NamedTuple):
    drive: Any
    name: str
    function: Callable
    #: What the function is given behind the bench: a row of its table, or nothing.
    arguments: tuple
    #: What the bench is made with: see `Bench`.
    setup: dict[str, Any]


class Skip(Exception):
    """The check cannot run here; the text says why."""


def check(name, *drives, rows=None, **setup):
    """Adds a function of a bench to the list, under a sentence, once for each drive.

    With `rows` (a table, or a function of the drive that gives one) it is added once for each row, which the function is
    given behind the bench. A row is a dictionary: the sentence may hold its fields in braces, and a field `drives` is an
    argument of the bench.
    """

    def add(function):
        for drive in drives:
            for row in (rows(drive) if callable(rows) else rows) or [None]:
                title = name if row is None else name.format_map(row)
                made_with = setup | {"drives": row["drives"]} if row and "drives" in row else setup
                CHECKS.append(Check(drive, title, function, () if row is None else (row,), made_with))
        return function

    return add


def table(fields, *rows):
    """Rows of a check from tuples under the names of their fields."""
    return [dict(zip(fields.split(), row, strict=True)) for row in rows]


def equal(actual, expected, what):
    if actual != expected:
        raise AssertionError(f"{what}: expected {shown(expected)}, got {shown(actual)}")


def near(actual, expected, tolerance, what):
    if abs(actual - expected) > tolerance:
        raise AssertionError(f"{what}: expected {expected} within {tolerance}, got {actual}")


def true(condition, what):
    if not condition:
        raise AssertionError(what)


# A watchdog against hangs, which no check is about: a busy machine takes its time.
PATIENCE_S = 600.0


def eventually(function, accept, what):
    """Calls `function` until `accept(value)` holds, and returns that value."""
    end = time.monotonic() + PATIENCE_S
    while True:
        value = function()
        if accept(value):
            return value
        if time.monotonic() > end:
            raise AssertionError(f"{what}: not so, last {shown(value)}")
        time.sleep(0.01)


def shown(value):
    if isinstance(value, bool) or not isinstance(value, int):
        return repr(value)
    return f"{value} ({value:#x})"
