"""canopen-python's CiA 402 profile drives a servo that is made from an EDS: pp, pv, hm and csp."""

import time

from checks import check, equal, eventually, near, true

from cia402 import DRIVE, TURN

TARGET_REACHED = 1 << 10
ATTAINED = 1 << 12


def ready(bench, mode):
    """The profile's own state machine brings the drive to Operation enabled."""
    node = bench.node
    node.nmt.state = "OPERATIONAL"
    # The library takes a PDO that came twice for a periodic one, and waits for the next: so all go with SYNC.
    for number in range(1, 5):
        node.tpdo[number].read()
        node.tpdo[number].trans_type = 1
        node.tpdo[number].save()
    bench.network.sync.start(0.01)
    node.setup_402_state_machine()
    node.op_mode = mode
    node.state = "OPERATION ENABLED"
    equal(node.state, "OPERATION ENABLED", "state")
    equal(node.op_mode, mode, "mode")
    return node


@check("canopen-python reads the modes of a servo made from an EDS, and finds those of 6502h", DRIVE)
def modes(bench):
    node = bench.node
    for mode in ("PROFILED POSITION", "VELOCITY", "PROFILED VELOCITY", "PROFILED TORQUE", "HOMING", "INTERPOLATED POSITION",
                 "CYCLIC SYNCHRONOUS POSITION", "CYCLIC SYNCHRONOUS VELOCITY", "CYCLIC SYNCHRONOUS TORQUE"):
        true(node.is_op_mode_supported(mode), f"{mode} is supported")
    # Bit n - 1 is mode n (CiA 402-2, 6502h): 1 to 4 and 6 to 11, of which the library has no name for the last.
    equal(node.sdo[0x6502].raw, sum(1 << mode - 1 for mode in (1, 2, 3, 4, 6, 7, 8, 9, 10, 11)), "6502h")


@check("a servo made from an EDS goes to a position", DRIVE)
def profile_position(bench):
    node = ready(bench, "PROFILED POSITION")
    node.sdo[0x6081].raw = 20 * TURN
    node.sdo[0x607A].raw = 7 * TURN
    node.controlword = 0x1F
    node.controlword = 0x0F
    bench.status_becomes(TARGET_REACHED, TARGET_REACHED, "target reached")
    near(node.sdo[0x6064].raw, 7 * TURN, TURN // 1000, "6064h")
    near(bench.world("get")["position"], 7 * TURN, TURN // 1000, "position in the world")


@check("a servo made from an EDS turns at a velocity, and stops", DRIVE)
def profile_velocity(bench):
    node = ready(bench, "PROFILED VELOCITY")
    node.sdo[0x60FF].raw = 25 * TURN
    eventually(lambda: bench.world("get")["velocity_rpm"], lambda rpm: abs(rpm - 1500) < 15, "1500 r/min")
    eventually(lambda: node.sdo[0x606C].raw, lambda speed: abs(speed - 25 * TURN) <= TURN // 4, "606Ch")
    node.state = "SWITCHED ON"
    eventually(lambda: abs(bench.world("get")["velocity_rpm"]), lambda rpm: rpm < 1, "it stands")


@check("a servo made from an EDS homes at a switch and at the index pulse", DRIVE)
def homing(bench):
    node = ready(bench, "HOMING")
    bench.world(f"switch HOME {2 * TURN} {4 * TURN}")
    for method in (24, 8):
        node.sdo[0x6098].raw = method
        true(node.homing(), f"method {method}: homing attained")
        equal(bench.statusword() & ATTAINED, ATTAINED, "bit 12")
        node.controlword = 0x0F


@check("a servo made from an EDS follows set-points that come with SYNC", DRIVE)
def cyclic_position(bench):
    node = ready(bench, "CYCLIC SYNCHRONOUS POSITION")
    # 10 ms a set-point: what Python keeps to.
    node.sdo[0x60C2][1].raw = 10
    rpdo = node.rpdo[3]
    rpdo.read()
    rpdo.trans_type = 1
    rpdo.save()
    position = node.sdo[0x6064].raw
    for step in range(1, 171):
        # The host ends at rest.
        position += TURN // 20 if step <= 150 else 0
        rpdo[0x6040].raw = 0x0F
        rpdo[0x607A].raw = position
        rpdo.transmit()
        # A pause, not a schedule: what a busy machine has missed would come in a burst, which is a jump.
        time.sleep(0.010)
    eventually(lambda: node.sdo[0x6064].raw, lambda at: abs(at - position) < TURN // 50, "it ends at the last set-point")
    true(not node.is_faulted(), "no fault")
