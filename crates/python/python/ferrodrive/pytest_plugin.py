"""Fixtures for pytest, and what a failing test wants to know of the bus.

``ferrodrive_world`` is an empty world whose virtual time is in use; ``ferrodrive_sim`` is the served simulator as a process, ready.
What they begin with is said by a marker::

    @pytest.mark.ferrodrive(drives=["zlac8030l@4"], bitrate=500_000, seed=7)
    def test_wheel(ferrodrive_world): ...
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from .simulator import Simulator
from .turns import virtual_time
from .world import World

#: Frames that a failing test shows.
LAST_FRAMES = 40


def pytest_configure(config: pytest.Config) -> None:
    """Makes the marker known."""
    words = "ferrodrive(drives=[], bitrate=500000, seed=1, extra=[]): what ferrodrive_world and ferrodrive_sim begin with"
    config.addinivalue_line("markers", words)


@pytest.fixture
def ferrodrive_world(request: pytest.FixtureRequest) -> Iterator[World]:
    """A virtual bus with the drives of the marker, its virtual time in use: sleeping and waiting moves it, and nothing else."""
    wanted = marked(request)
    world = World(wanted.get("bitrate", 500_000), wanted.get("seed", 1))
    with virtual_time(world):
        for place in wanted.get("drives", ()):
            model, _, node = place.rpartition("@")
            world.add(model, node=int(node))
        yield world


@pytest.fixture
def ferrodrive_sim(request: pytest.FixtureRequest) -> Iterator[Simulator]:
    """``ferrodrive sim`` with the drives of the marker as a process of its own, in real time, ready."""
    wanted = marked(request)
    with Simulator(wanted.get("drives", ()), wanted.get("seed", 1), wanted.get("extra", ())) as simulator:
        yield simulator


def marked(request: pytest.FixtureRequest) -> dict[str, Any]:
    """What the test's marker says."""
    marker = request.node.get_closest_marker("ferrodrive")
    return {} if marker is None else marker.kwargs


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo[None]) -> Iterator[None]:
    """Attaches the last frames and the state of the drives to a failing test."""
    outcome: Any = yield
    report = outcome.get_result()
    if call.when != "call" or not report.failed:
        return
    for world in getattr(item, "funcargs", {}).values():
        if isinstance(world, World):
            report.sections.append(("last frames on the bus", "\n".join(world.frames(LAST_FRAMES))))
            report.sections.append(("drives", f"{world.now} s\n" + "\n".join(state(world))))


def state(world: World) -> Iterator[str]:
    """A line on each drive."""
    for drive in world:
        statusword = drive.statusword
        word = "no power" if statusword is None else f"statusword {statusword:04X}h"
        yield (
            f"{drive!r}: {word}, error {drive.error_code:X}h, position {drive.position}, "
            f"{drive.velocity_rpm:.1f} r/min, {drive.current_a:.2f} A, {drive.supply_v:.1f} V"
        )
