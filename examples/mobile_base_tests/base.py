"""The software under test: a mobile base with two hub wheels, in canopen-python. It knows nothing of simulators or virtual time."""

import io
import math
import threading
import time

import canopen

LEFT, RIGHT = 1, 2
WHEEL_RADIUS_M = 0.084
WHEEL_BASE_M = 0.40
COUNTS_PER_TURN = 4096
SYNC_PERIOD_S = 0.020
PROFILE_VELOCITY = 3
FAULT = 0x0008
#: 1018h:01 of the ZLTECH drives.
VENDOR = 0x100


class Fault(Exception):
    """A drive does not do what the base needs."""


class Base:
    """Drives at a speed and a turning rate, and counts where it came to."""

    def __init__(self, sheet, **bus):
        self.network = canopen.Network()
        self.network.connect(**bus)
        self.wheels = {}
        self.counts = {}
        self.counted_s = {}
        self.statuswords = {}
        self.x_m = self.y_m = self.heading_rad = 0.0
        self.fault = threading.Event()
        for node_id in (LEFT, RIGHT):
            file = io.StringIO(sheet)
            file.name = "wheel.eds"
            self.wheels[node_id] = self.network.add_node(node_id, file)

    def wait_until_booted(self, timeout_s=10):
        """Asks each wheel until it answers: its boot-up message may have gone before we were on the bus."""
        end = time.monotonic() + timeout_s
        for node_id, node in self.wheels.items():
            while True:
                try:
                    node.sdo[0x1000].raw
                    break
                except canopen.SdoCommunicationError:
                    if time.monotonic() > end:
                        raise Fault(f"wheel {node_id} is silent") from None
        # What was asked while a wheel booted is answered too, late; canopen drops what came before it asks again.
        time.sleep(0.1)

    def start(self):
        """Sets both drives up for cyclic velocities and enables them."""
        self.fall_silent()
        self.fault.clear()
        self.counts.clear()
        self.counted_s.clear()
        for node_id, node in self.wheels.items():
            self.check_model(node)
            node.nmt.state = "PRE-OPERATIONAL"
            self.map_process_data(node_id, node)
            node.sdo[0x6060].raw = PROFILE_VELOCITY
            node.nmt.state = "OPERATIONAL"
            for controlword in (6, 7, 15):
                node.sdo[0x6040].raw = controlword
            if node.sdo[0x6041].raw & 0x6F != 0x27:
                raise Fault(f"wheel {node_id} is not enabled: statusword {node.sdo[0x6041].raw:04X}h")
        # A wheel whose host is silent stops: the set-points are repeated. Both and the SYNC begin together and go one behind the
        # other from then on: with a SYNC between the two, one wheel would set off a period before the other.
        for node in self.wheels.values():
            node.rpdo[1].start(SYNC_PERIOD_S)
        self.network.sync.start(SYNC_PERIOD_S)

    @staticmethod
    def check_model(node):
        """Raises if the node is another maker's: its objects would mean other things."""
        vendor = node.sdo[0x1018][1].raw
        if vendor != VENDOR:
            raise Fault(f"wheel {node.id} is another drive: its vendor is {vendor:X}h and not {VENDOR:X}h")

    def map_process_data(self, node_id, node):
        node.tpdo.read()
        node.rpdo.read()
        tpdo, rpdo = node.tpdo[1], node.rpdo[1]
        tpdo.clear()
        tpdo.add_variable(0x6041)
        tpdo.add_variable(0x6064)
        tpdo.trans_type, tpdo.event_timer, tpdo.enabled = 1, 0, True
        tpdo.save()
        tpdo.add_callback(lambda message: self.on_actual_values(node_id, message))
        rpdo.clear()
        rpdo.add_variable(0x60FF)
        rpdo.trans_type, rpdo.enabled = 1, True
        rpdo.save()

    def drive(self, speed_m_s, turning_rad_s=0.0):
        """Sets both set-points; a SYNC makes them valid together."""
        for node_id, side in ((LEFT, -1), (RIGHT, 1)):
            wheel_m_s = speed_m_s + side * turning_rad_s * WHEEL_BASE_M / 2
            rpdo = self.wheels[node_id].rpdo[1]
            rpdo[0].raw = round(wheel_m_s / (2 * math.pi * WHEEL_RADIUS_M) * 60)
            rpdo.update()

    def on_actual_values(self, node_id, message):
        """One wheel's values; the pose is counted on with those of both wheels to the same SYNC. Which of them answers first is the
        drives' own: values of two cycles would turn the base by what a wheel rolls in one."""
        statusword, counts = (variable.raw for variable in message)
        if statusword & FAULT:
            self.fault.set()
        self.statuswords[node_id] = statusword
        before = self.counts.setdefault(node_id, [counts, counts])
        before[1] = counts
        self.counted_s[node_id] = message.timestamp
        times = self.counted_s.values()
        if len(times) == 2 and max(times) - min(times) < SYNC_PERIOD_S / 2:
            arcs = [self.arc_m(self.counts[wheel]) for wheel in (LEFT, RIGHT)]
            middle = self.heading_rad + (arcs[1] - arcs[0]) / WHEEL_BASE_M / 2
            self.x_m += sum(arcs) / 2 * math.cos(middle)
            self.y_m += sum(arcs) / 2 * math.sin(middle)
            self.heading_rad += (arcs[1] - arcs[0]) / WHEEL_BASE_M
            for wheel in (LEFT, RIGHT):
                self.counts[wheel][0] = self.counts[wheel][1]

    @staticmethod
    def arc_m(span):
        return (span[1] - span[0]) / COUNTS_PER_TURN * 2 * math.pi * WHEEL_RADIUS_M

    def emergency_stop(self):
        """Quick stop of both wheels (CiA 402, controlword bit 2)."""
        for node in self.wheels.values():
            node.sdo[0x6040].raw = 2

    def reset(self):
        """Resets faults whose cause is gone."""
        for node in self.wheels.values():
            node.sdo[0x6040].raw = 0x80
            node.sdo[0x6040].raw = 0

    def fall_silent(self):
        """No set-points and no SYNC any more."""
        self.network.sync.stop()
        for node in self.wheels.values():
            node.rpdo[1].stop()

    def close(self):
        self.fall_silent()
        self.network.disconnect()
