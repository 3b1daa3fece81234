"""Programs of the handbook: canopen-python by the names of CiA, and its profile of CiA 402, with every model."""

import random
import time

import canopen
import ferrodrive
import pytest
from canopen.profiles.p402 import BaseNode402

#: What 1 r/min is in "Target velocity" and in "Velocity actual value".
COUNTS = {"zlac8030l": (1, 10), "zlim42c": (1, 1), "zlim42c-82": (1, 1), "cia402": (131_072 / 60, 131_072 / 60)}
COUNTS_OF_JOINTS = (1, 10)
#: Those with the power states of CiA 402; the joints have none.
CIA_402 = list(COUNTS)


@pytest.fixture
def on_bus(ferrodrive_world, tmp_path):
    network = canopen.Network()
    network.connect(interface="ferrodrive", channel=ferrodrive_world)

    def add(model, kind):
        drive = ferrodrive_world.add(model, node=5)
        sheet = tmp_path / f"{model}.eds"
        sheet.write_text(ferrodrive.eds(model))
        node = network.add_node(kind(5, str(sheet)))
        node.nmt.wait_for_bootup(5)
        time.sleep(0.5)  # it looks at its supply and sensors; takes no time of yours
        return node, drive

    yield add
    network.disconnect()


def test_two_nodes_have_booted(ferrodrive_world):
    network = canopen.Network()
    network.connect(interface="ferrodrive", channel=ferrodrive_world)
    for number in (4, 5):
        ferrodrive_world.add("zlac8030l", node=number)
        network.add_node(number, canopen.ObjectDictionary())
    for node in network.values():
        # The boot-up of the second one passes while the first is waited for: reset each node before waiting for it.
        node.nmt.state = "RESET"
        node.nmt.wait_for_bootup(5)
    for node in network.values():
        assert node.sdo.upload(0x1000, 0)
    # Without the line of the reset: both boot-ups have passed.
    with pytest.raises(canopen.nmt.NmtError, match="Timeout"):
        network[4].nmt.wait_for_bootup(5)
    network.disconnect()


def ask_until_it_answers(node):
    """Waits for a node whose boot-up message may have gone before."""
    while True:
        try:
            node.sdo.upload(0x1000, 0)
            break
        except canopen.SdoCommunicationError:
            pass
    time.sleep(0.1)  # the earlier requests are answered too, late: after this, canopen drops what came


def test_a_node_that_is_asked_until_it_answers_answers_what_is_asked_next(ferrodrive_world, monkeypatch):
    ferrodrive_world.add("zlac8030l", node=5)
    network = canopen.Network()
    network.connect(interface="ferrodrive", channel=ferrodrive_world)
    node = network.add_node(5, canopen.ObjectDictionary())
    with monkeypatch.context() as without:
        without.setattr(time, "sleep", lambda seconds: None)
        ask_until_it_answers(node)
    # Several requests waited on the wire for a node to acknowledge them; an answer of 1000h is not one of 1018h.
    with pytest.raises(canopen.SdoCommunicationError, match="instead"):
        node.sdo.upload(0x1018, 1)
    node.nmt.state = "RESET"
    ask_until_it_answers(node)
    assert node.sdo.upload(0x1018, 1) == b"\0\1\0\0"
    network.disconnect()


def test_a_cut_cable_is_named_after_the_time_limit_whenever_it_is_cut(on_bus):
    node, drive = on_bus("zlac8030l", canopen.RemoteNode)
    starts = random.Random(4)
    for _ in range(50):
        time.sleep(starts.random())
        drive.cut_cable()
        began = time.monotonic()
        with pytest.raises(canopen.SdoCommunicationError, match="No SDO response received"):
            node.sdo.upload(0x6041, 0)
        assert time.monotonic() - began == pytest.approx(node.sdo.MAX_RETRIES * node.sdo.RESPONSE_TIMEOUT, abs=1e-6)
        drive.join_cable()
        time.sleep(0.1)  # the request is still on its way
        node.sdo.upload(0x6041, 0)


@pytest.mark.parametrize("model", ferrodrive.models())
def test_every_model_turns_by_the_names_of_its_objects(on_bus, model):
    node, drive = on_bus(model, canopen.RemoteNode)
    target, actual = COUNTS.get(model, COUNTS_OF_JOINTS)
    node.sdo["Modes of operation"].raw = 3  # profile velocity
    for controlword in (6, 7, 15) if model in CIA_402 else (15,):
        node.sdo["Controlword"].raw = controlword
    node.sdo["Target velocity"].raw = round(100 * target)
    time.sleep(0.8)  # within the second after which the ZLAC8030L stops if it hears nothing
    # A stepper swings about its speed; 606Ch is what the drive makes of it.
    assert drive.velocity_rpm == pytest.approx(100, rel=0.15)
    assert node.sdo["Velocity actual value"].raw == pytest.approx(100 * actual, rel=0.05)
    assert node.sdo["Statusword"].raw & 0x07 == 0x07 or model not in CIA_402
    before = node.sdo["Position actual value"].raw
    time.sleep(0.2)
    assert node.sdo["Position actual value"].raw > before
    node.sdo["Controlword"].raw = 0
    time.sleep(5)
    assert node.sdo["Identity object"]["Vendor-ID"].raw == node.object_dictionary.device_information.vendor_number
    assert drive.velocity_rpm == pytest.approx(0, abs=1)


@pytest.mark.parametrize("model", CIA_402)
def test_the_profile_of_canopen_python_drives_what_has_the_power_states(on_bus, model):
    node, drive = on_bus(model, BaseNode402)
    if 0x6502 not in node.object_dictionary:
        node.is_op_mode_supported = lambda mode: True  # the drive itself refuses a mode that it does not have
    node.op_mode = "PROFILED VELOCITY"
    node.state = "OPERATION ENABLED"
    node.sdo["Target velocity"].raw = round(100 * COUNTS[model][0])
    time.sleep(0.8)
    assert (node.state, node.op_mode) == ("OPERATION ENABLED", "PROFILED VELOCITY")
    assert drive.velocity_rpm == pytest.approx(100, rel=0.15)
    node.state = "SWITCHED ON"
    time.sleep(5)
    assert drive.velocity_rpm == pytest.approx(0, abs=1)


@pytest.mark.parametrize("model", [model for model in ferrodrive.models() if model not in CIA_402])
def test_a_joint_has_no_state_that_the_profile_of_canopen_python_knows(on_bus, model):
    node, _ = on_bus(model, BaseNode402)
    with pytest.raises(ValueError, match="Illegal state transition from UNKNOWN"):
        node.state = "OPERATION ENABLED"


def test_a_mode_that_a_drive_does_not_have_is_refused_by_the_drive(on_bus):
    node, _ = on_bus("zlac8030l", BaseNode402)
    # The file does not have 6502h, nor does the drive: without the line above the profile cannot set a mode.
    with pytest.raises(KeyError, match="0x6502"):
        node.op_mode = "PROFILED VELOCITY"
    node.is_op_mode_supported = lambda mode: True
    with pytest.raises(canopen.SdoAbortedError) as refused:
        node.op_mode = "HOMING"
    assert refused.value.code == 0x0609_0030
