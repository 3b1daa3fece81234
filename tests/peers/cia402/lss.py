"""canopen-python's LSS master (CiA 305) and a servo that has no node-ID yet."""

from canopen.lss import LssError

from checks import check, equal, true

from cia402 import TURN, FileDrive

#: 1018h of `cia402`: vendor, product, revision, serial number.
ADDRESS = (0, 402, 0x10000, 1)
UNCONFIGURED = 255
WAITING, CONFIGURATION = 0, 1


class DeliveredDrive(FileDrive):
    """Without a node-ID: its EDS says that it has LSS."""

    def arguments(self, program):
        return tuple(f"{drive},node-id=none" for drive in super().arguments(program))


DRIVE = DeliveredDrive("cia402", model="cia402", node_id=5, device_type=0x00020192, per_rpm=TURN / 60)


def node_id(lss):
    lss.send_switch_state_global(CONFIGURATION)
    return lss.inquire_node_id()


@check("canopen-python finds a device without a node-ID by fastscan, and gives it one", DRIVE, absent=True)
def fast_scan(bench):
    lss = bench.network.lss
    lss.RESPONSE_TIMEOUT = 2.0
    lss.send_switch_state_global(WAITING)
    mark = bench.trace.mark()
    lss.send_identify_non_configured_remote_slave()
    # The library does not wait for this answer, and would take it for the next one.
    bench.trace.wait(0x7E4, mark, "a device has no node-ID", lambda frame: frame.data[0] == 0x50)
    bench.sleep(0.3)
    equal(lss.fast_scan(), (True, list(ADDRESS)), "fastscan")
    equal(lss.inquire_node_id(), UNCONFIGURED, "node-ID")
    mark = bench.trace.mark()
    lss.configure_node_id(9)
    lss.store_configuration()
    lss.send_switch_state_global(WAITING)
    bench.trace.wait(0x709, mark, "boot-up as node 9", lambda frame: frame.data == b"\0")
    equal(bench.other(9).sdo.upload(0x1018, 2), (402).to_bytes(4, "little"), "1018h:02 of node 9")
    equal(lss.fast_scan(), (False, None), "fastscan once every device has a node-ID")
    equal(node_id(lss), 9, "node-ID")


@check("canopen-python selects a device by its address, and no other address", DRIVE, absent=True)
def selective(bench):
    lss = bench.network.lss
    lss.RESPONSE_TIMEOUT = 2.0
    lss.send_switch_state_global(WAITING)
    try:
        selected = lss.send_switch_state_selective(*ADDRESS[:3], 2)
    except LssError:
        selected = False
    true(not selected, "a device with another serial number does not answer")
    true(lss.send_switch_state_selective(*ADDRESS), "the device with this address answers")
    numbers = tuple(lss.inquire_lss_address(0x5A + number) for number in range(4))
    equal(numbers, ADDRESS, "the address inquired")
    lss.configure_bit_timing(2)
    try:
        lss.configure_bit_timing(5)
    except LssError:
        return
    raise AssertionError("bit rate 5 of CiA 305, table 1 is reserved, and was taken")
