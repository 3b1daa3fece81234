"""What the tests stand on: the machine of `base.toml` on a bus, and its controller on the same bus.

`FERRODRIVE_PACE=1` runs the same suite in real time.
"""

import os
import pathlib

import ferrodrive
import pytest
from base import Base

PACE = os.environ.get("FERRODRIVE_PACE", "virtual")
#: The name of each test and the digest of its run, to compare runs.
DIGESTS = os.environ.get("FERRODRIVE_DIGESTS")


@pytest.fixture
def world(request):
    world = ferrodrive.World.machine(pathlib.Path(__file__).with_name("base.toml"), seed=1)
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
