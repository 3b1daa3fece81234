"""The software under test: an arm of three joint motors, in canopen-python. It knows nothing of simulators or virtual time."""

import time

import canopen

JOINTS = (1, 2, 3)
#: Counts of a motor shaft for one turn of it.
COUNTS_PER_TURN = 32_768
SPEED_RPM = 300
#: The joints watch for the heartbeat of this node (1016h:01).
HOST = 0x7F
HEARTBEAT_PERIOD_S = 0.5
REACHED = 1 << 10
ALARM = 1 << 3


class Alarm(Exception):
    """A joint does not do what the arm needs."""


class Arm:
    """Moves its joints together, and stops together."""

    def __init__(self, **bus):
        self.network = canopen.Network()
        self.network.connect(**bus)
        self.joints = {joint: self.network.add_node(joint, canopen.ObjectDictionary()) for joint in JOINTS}
        self.watch = None

    def wait_until_booted(self, timeout_s=10):
        """Asks each joint until it answers: its boot-up message may have gone before we were on the bus."""
        end = time.monotonic() + timeout_s
        for joint in JOINTS:
            while True:
                try:
                    self.read(joint, 0x1000)
                    break
                except canopen.SdoCommunicationError:
                    if time.monotonic() > end:
                        raise Alarm(f"joint {joint} is silent") from None

    def start(self):
        """Enables the joints and lets them watch this program."""
        self.watch = self.network.send_periodic(0x700 + HOST, [5], HEARTBEAT_PERIOD_S)
        for joint in JOINTS:
            self.write(joint, 0x6060, 1, 1)
            self.write(joint, 0x6081, SPEED_RPM, 4)
            self.write(joint, 0x6040, 0x0F, 2)

    def write(self, joint, index, value, size):
        self.joints[joint].sdo.download(index, 0, value.to_bytes(size, "little", signed=value < 0))

    def read(self, joint, index):
        return int.from_bytes(self.joints[joint].sdo.upload(index, 0), "little", signed=index == 0x6064)

    def begin_move(self, turns):
        """Hands each joint its target, in turns of its motor, and lets them go."""
        for joint, target in zip(JOINTS, turns):
            self.write(joint, 0x607A, round(target * COUNTS_PER_TURN), 4)
            self.write(joint, 0x6040, 0x0F, 2)
        for joint in JOINTS:
            self.write(joint, 0x6040, 0x1F, 2)

    def move(self, turns, timeout_s=30):
        """The same, and waits until all have arrived. An alarm of one stops all."""
        self.begin_move(turns)
        end = time.monotonic() + timeout_s
        waiting = set(JOINTS)
        while waiting:
            for joint in sorted(waiting):
                statusword = self.read(joint, 0x6041)
                if statusword & ALARM:
                    self.stop()
                    raise Alarm(f"joint {joint} has alarm {self.read(joint, 0x260E):X}h")
                if statusword & REACHED and abs(self.error(joint, turns)) < 0.01:
                    waiting.discard(joint)
            if time.monotonic() > end:
                self.stop()
                raise Alarm(f"joints {sorted(waiting)} did not arrive within {timeout_s} s")
            time.sleep(0.02)

    def error(self, joint, turns):
        return self.read(joint, 0x6064) / COUNTS_PER_TURN - turns[JOINTS.index(joint)]

    def stop(self):
        """Quick stop of all joints."""
        for joint in JOINTS:
            self.write(joint, 0x6040, 0x02, 2)

    def reset(self):
        """Resets alarms whose cause is gone."""
        for joint in JOINTS:
            self.write(joint, 0x6040, 0x80, 2)
            self.write(joint, 0x6040, 0x0F, 2)

    def fall_silent(self):
        """No heartbeat any more, as when the program dies."""
        if self.watch is not None:
            self.watch.stop()
            self.watch = None

    def close(self):
        self.fall_silent()
        self.network.disconnect()
