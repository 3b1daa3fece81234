"""What the tests stand on: three joints on a bus, and the arm on the same bus. `FERRODRIVE_PACE=1` runs them in real time."""

import os

import ferrodrive
import pytest
from arm import JOINTS, Arm

PACE = os.environ.get("FERRODRIVE_PACE", "virtual")
#: The name of each test and the digest of its run, to compare runs.
DIGESTS = os.environ.get("FERRODRIVE_DIGESTS")


@pytest.fixture
def world(request):
    world = ferrodrive.World(bitrate=1_000_000, seed=1)
    for joint in JOINTS:
        world.add("m4230e17b50", node=joint)
    yield world
    if DIGESTS:
        with open(DIGESTS, "a", encoding="utf-8") as file:
            file.write(f"{request.node.name} {world.digest():016x}\n")


@pytest.fixture
def arm(world):
    arm = Arm(interface="ferrodrive", channel=world, pace=PACE)
    arm.wait_until_booted()
    arm.start()
    yield arm
    arm.close()
