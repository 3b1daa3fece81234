"""Fixtures for pytest, and what a failing test wants to know of the bus.

``ferrodrive_world`` is an empty world whose virtual time is in use; ``ferrodrive_sim`` is the served simulator as a process, its
drives booted. What they begin with is in a marker::

    @pytest.mark.ferrodrive(drives=["zlac8030l@4"], bitrate=500_000, seed=7)
    def test_wheel(ferrodrive_world): ...

    @pytest.mark.ferrodrive(machine="machine.toml")
    def test_machine(ferrodrive_world): ...

- ``drives``: what is on the bus, each in the words of ``ferrodrive sim --drive``: ``"zlac8030l@4"``, ``"zlac8030l@4,motor=fast"``,
  ``"vendor.eds@5"``. Without it, and without ``machine``, the bus is empty.
- ``machine``: a machine file in place of them. Its path is taken from the folder of the test's file, and where it is not there from
  pytest's root. Its own bit rate, seed and timing count, but for a ``seed`` or ``timing`` that is given beside it.
- ``bitrate``: in bit/s, 500000 without it. Not beside ``machine``.
- ``seed``: decides everything random; 1 without it.
- ``timing``: whether the drives take the time that such drives take to boot, to answer and to store: ``"device"``, as real drives and
  ``ferrodrive sim``, is the default of both fixtures, so that a suite that is green in CI is green on the desk; with ``"ideal"`` none of
  that takes time.
- ``extra``: further words for the command line of ``ferrodrive sim``, such as ``["--clock", "manual"]``: of ``ferrodrive_sim`` alone.

A test that fails, or whose fixtures fail, shows of each world among its fixtures (and of each :class:`~ferrodrive.Network` in a world)
the last frames with what they say, the last events with their remedies, the state of the drives, and a plot of the last seconds: in the
report of pytest-html if there is one, else as an SVG file that the report names.
"""

from __future__ import annotations

import importlib
import json
import os
import pathlib
import re
from collections.abc import Iterable, Iterator
from typing import Any, Optional

import pytest

from .master import Network
from .simulator import Simulator
from .turns import virtual_time
from .world import World

#: Frames and events that a failing test shows.
LAST_FRAMES = 40
LAST_EVENTS = 20

#: The longest line of them, in characters.
LONGEST_LINE = 160

#: What the marker may have.
KNOWN = {"drives", "machine", "timing", "bitrate", "seed", "extra"}

#: Worlds that fixtures have made, by the fixture's name.
WORLDS = pytest.StashKey[dict[str, World]]()


def pytest_configure(config: pytest.Config) -> None:
    """Makes the marker known."""
    words = (
        "ferrodrive(drives=[], machine=FILE, timing='device', bitrate=500000, seed=1, extra=[]): what ferrodrive_world and "
        "ferrodrive_sim begin with; drives as of `ferrodrive sim --drive`, FILE from the folder of the test, timing='ideal' without the time "
        "that real drives take to boot, to answer and to store, extra words for the command line of ferrodrive_sim"
    )
    config.addinivalue_line("markers", words)


@pytest.fixture
def ferrodrive_world(request: pytest.FixtureRequest) -> Iterator[World]:
    """A virtual bus with the drives of the marker, its virtual time in use: sleeping and waiting moves it, and nothing else. Its time is 0:
    the drives begin to boot, and the first thing to do is to wait for that, as on the desk."""
    wanted = marked(request)
    if "extra" in wanted:
        raise ValueError("extra has words for the command line of ferrodrive sim, which ferrodrive_world does not have: omit it")
    if "machine" in wanted:
        world = World.machine(machine_file(request, wanted), wanted.get("seed"), timing=wanted.get("timing"))
    else:
        world = World(wanted.get("bitrate", 500_000), wanted.get("seed", 1), wanted.get("timing", "device"))
    with virtual_time(world):
        for words in wanted.get("drives", ()):
            world.add_described(words)
        yield world


@pytest.fixture
def ferrodrive_sim(request: pytest.FixtureRequest) -> Iterator[Simulator]:
    """``ferrodrive sim`` with the drives of the marker as a process of its own, in real time, its drives booted."""
    wanted = marked(request)
    extra = list(wanted.get("extra", ()))
    if "machine" in wanted:
        extra += ["--machine", os.fspath(machine_file(request, wanted))]
    if "bitrate" in wanted:
        extra += ["--bitrate", str(wanted["bitrate"])]
    if "timing" in wanted:
        extra += ["--timing", wanted["timing"]]
    with Simulator(wanted.get("drives", ()), wanted.get("seed"), extra) as simulator:
        # A clock that is moved by hand boots no drive by waiting.
        if "manual" not in simulator.command_line:
            simulator.wait_until_booted()
        yield simulator


def marked(request: pytest.FixtureRequest) -> dict[str, Any]:
    """What the test's marker has."""
    marker = request.node.get_closest_marker("ferrodrive")
    wanted: dict[str, Any] = {} if marker is None else marker.kwargs
    if marker is not None and marker.args:
        raise ValueError(f"the marker ferrodrive has {', '.join(map(repr, marker.args))} without a name; expected NAME=VALUE, of {', '.join(sorted(KNOWN))}")
    if unknown := sorted(set(wanted) - KNOWN):
        raise ValueError(f"the marker ferrodrive has no {', '.join(unknown)}; expected {', '.join(sorted(KNOWN))}")
    if isinstance(drives := wanted.get("drives", ()), str):
        raise ValueError(f"the marker ferrodrive has drives={drives!r}; expected a list, drives=[{drives!r}]")
    return wanted


def machine_file(request: pytest.FixtureRequest, wanted: dict[str, Any]) -> pathlib.Path:
    """The machine file of the marker, from the folder of the test's file, else from pytest's root."""
    if "bitrate" in wanted:
        raise ValueError("the bit rate is in the machine file: omit bitrate, or change it there")
    if "drives" in wanted:
        raise ValueError("the drives are in the machine file: omit drives, or add them there")
    folders = (request.path.parent, request.config.rootpath)
    places: list[pathlib.Path] = [folder / wanted["machine"] for folder in folders]
    for place in places:
        if place.exists():
            return place
    raise FileNotFoundError(f"no machine file {wanted['machine']}; looked for {' and '.join(map(str, dict.fromkeys(places)))}")


@pytest.hookimpl(hookwrapper=True)
def pytest_fixture_setup(fixturedef: Any, request: pytest.FixtureRequest) -> Iterator[None]:
    """Keeps the last seconds of every world that a fixture makes, from there on."""
    outcome: Any = yield
    if outcome.excinfo is None and (world := world_of(outcome.get_result())) is not None:
        if not world.keeps_trail:  # a fixture may have wanted another length
            world.keep_trail()
        world.keep_events()
        request.node.stash.setdefault(WORLDS, {})[fixturedef.argname] = world


def world_of(made: object) -> Optional[World]:
    """The world that a fixture gives, itself or with a master in it."""
    if isinstance(made, Network):
        return made._world
    return made if isinstance(made, World) else None


def pytest_fixture_post_finalizer(fixturedef: Any, request: pytest.FixtureRequest) -> None:
    """Lets go of a fixture's world."""
    request.node.stash.get(WORLDS, {}).pop(fixturedef.argname, None)


def worlds(item: pytest.Item) -> Iterator[tuple[str, World]]:
    """The worlds among the fixtures of a test, also of those that it does not name itself; each once."""
    seen: list[World] = []
    for node in item.listchain():
        for name, world in node.stash.get(WORLDS, {}).items():
            if name in getattr(item, "fixturenames", ()) and not any(world is known for known in seen):
                seen.append(world)
                yield name, world


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo[None]) -> Iterator[None]:
    """Attaches the last frames and events, the state of the drives and a plot to a failing test."""
    outcome: Any = yield
    report = outcome.get_result()
    if call.when == "teardown" or not report.failed:
        return
    for name, world in worlds(item):
        report.sections.append(("last frames on the bus", lines(world.decoded_frames(LAST_FRAMES), "nothing was sent")))
        report.sections.append(("last events", lines(events(world), "nothing happened")))
        report.sections.append(("drives", f"{world.now} s\n" + "\n".join(state(world))))
        report.sections.append(("plot of the drives", plot(item, report, name, world)))


def lines(texts: Iterable[str], otherwise: str) -> str:
    """The texts, a line each of a bounded length."""
    cut = (text if len(text) <= LONGEST_LINE else text[: LONGEST_LINE - 3] + "..." for text in texts)
    return "\n".join(cut) or otherwise


def events(world: World) -> Iterator[str]:
    """A line on each of the last events."""
    for event in map(json.loads, world.last_events(LAST_EVENTS)):
        place = f"node {event['node']}: " if "node" in event else ""
        remedy = f"; {event['remedy']}" if "remedy" in event else ""
        yield f"{event['t']:.6f}  {place}{event['text']}{remedy}"


def plot(item: pytest.Item, report: Any, name: str, world: World) -> str:
    """Draws the last seconds of a world, and says where: in the report of pytest-html, or in a file."""
    try:
        svg = world.picture(item.nodeid)
    except RuntimeError as error:  # a world without drives, or one that has not moved
        return str(error)
    if (extras := html_extras(item.config)) is not None:
        report.extras = [*getattr(report, "extras", []), extras.html(svg)]
        return "in the HTML report"
    try:
        folder: pathlib.Path = item.config._tmp_path_factory.mktemp("ferrodrive")  # type: ignore[attr-defined]
        path = folder / (re.sub(r"[^A-Za-z0-9_.-]+", "_", f"{item.name}-{name}")[:100] + ".svg")
        path.write_text(svg, encoding="utf-8")
    except (AttributeError, OSError) as error:  # pytest runs without its folders for tests, or the disk is full
        return f"cannot be written: {error}"
    return str(path)


def html_extras(config: pytest.Config) -> Optional[Any]:
    """pytest-html's kinds of attachments, if it is to write a report."""
    if not config.getoption("htmlpath", None):
        return None
    try:
        return importlib.import_module("pytest_html").extras
    except ImportError:
        return None


def state(world: World) -> Iterator[str]:
    """A line on each drive."""
    for drive in world:
        statusword = drive.statusword
        word = "no power" if statusword is None else f"statusword {statusword:04X}h"
        yield (
            f"{drive!r}: {word}, error {drive.error_code:X}h, position {drive.position}, "
            f"{drive.velocity_rpm:.1f} r/min, {drive.current_a:.2f} A, {drive.supply_v:.1f} V"
        )
