"""A program of the handbook: tests with canopen-python against a virtual drive in virtual time."""

import time

import canopen
import pytest


@pytest.fixture
def drive(ferrodrive_world):
    wheel = ferrodrive_world.add("zlac8030l", node=4)
    network = canopen.Network()
    network.connect(interface="ferrodrive", channel=ferrodrive_world)
    node = network.add_node(4, canopen.ObjectDictionary())
    node.nmt.wait_for_bootup(5)
    time.sleep(0.5)  # it looks at its supply and sensors; takes no time of yours
    yield node.sdo, wheel
    network.disconnect()


def turn(sdo, speed_rpm):
    """Yours: what the software under test does with a drive."""
    sdo.download(0x6060, 0, b"\x03")  # profile velocity
    for controlword in (6, 7, 15):
        sdo.download(0x6040, 0, controlword.to_bytes(2, "little"))
    sdo.download(0x60FF, 0, speed_rpm.to_bytes(4, "little", signed=True))


def test_a_fault_is_seen(drive):
    sdo, wheel = drive
    turn(sdo, 60)
    time.sleep(0.5)
    assert wheel.velocity_rpm == pytest.approx(60, abs=2)
    wheel.set_fault("hall")
    time.sleep(0.3)
    assert int.from_bytes(sdo.upload(0x6041, 0), "little") & 0x4F == 0x08, "fault (CiA 402)"
