"""What the tests stand on: two wheels on a bus, and the base on the same bus.

`FERRODRIVE_PACE=1` runs the same suite in real time.
"""

import os

import ferrodrive
import pytest
from base import LEFT, RIGHT, Base

PACE = os.environ.get("FERRODRIVE_PACE", "virtual")
#: Each test's name and the digest of its run, for whoever compares runs.
DIGESTS = os.environ.get("FERRODRIVE_DIGESTS")


@pytest.fixture
def world(request):
    world = ferrodrive.World(bitrate=500_000, seed=1)
    for node in (LEFT, RIGHT):
        world.add("zlac8030l", node=node)
    yield world
    if DIGESTS:
        with open(DIGESTS, "a", encoding="utf-8") as file:
            file.write(f"{request.node.name} {world.digest():016x}\n")


@pytest.fixture
def base(world):
    base = Base(ferrodrive.eds("zlac8030l"), interface="ferrodrive", channel=world, pace=PACE)
    base.wait_until_booted()
    yield base
    base.close()


@pytest.fixture
def rolling(base):
    """The base as it rolls ahead."""
    base.start()
    base.drive(0.5)
    return base
