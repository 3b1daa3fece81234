"""An environment of Gymnasium: three joint motors of an arm in MuJoCo, led over CAN every 2 ms. Values in and out are those of PDOs.

    python examples/mujoco/reach.py
"""

import ferrodrive
import gymnasium
import numpy
from engine import Engine
from host import Host

JOINTS = {"turntable": 1, "shoulder": 2, "elbow": 3}
NODES = tuple(JOINTS.values())
#: Counts of a motor's shaft for one turn of the joint: 32,768 times the reducer's 50.
COUNTS_PER_TURN = 32_768 * 50
PERIOD_S = 0.002
#: Counts in a period at 300 r/min of the motor.
MOST_COUNTS = 320
#: What counts as there: 0.5 degrees.
CLOSE_COUNTS = COUNTS_PER_TURN // 720
FAULT = 0x0008
#: The joints watch for the heartbeat of this node (1016h:01), for 2 s as delivered.
HEARTBEAT = 0x700 + 0x7F
MOST_STEPS = 4000


def enable_arm(host):
    """Sets the joints up for positions in time (mode 7, led by SYNC), and enables them."""
    for node in NODES:
        host.write(node, 0x261C, 0, 1, 2)  # the stretch to a new point begins with SYNC
        host.write(node, 0x6060, 0, 7, 1)
        host.write(node, 0x6040, 0, 0x0F, 2)


class Reach(gymnasium.Env):
    """Brings the joints to a pose.

    Action: how far each target position (607Ah) goes in this period, in counts. Observation: for each joint its position (6064h) and its
    statusword (6041h), as TPDO4 has them, and the position it should come to, in counts. The reward is what the way to the goal became
    shorter by, in turns of the joints. A fault of a joint ends the episode; its reason is ``info["fault"]``.
    """

    metadata = {"render_modes": []}

    def __init__(self):
        self.action_space = gymnasium.spaces.Box(-MOST_COUNTS, MOST_COUNTS, (3,), numpy.int32)
        limits = numpy.iinfo(numpy.int32)
        self.observation_space = gymnasium.spaces.Box(limits.min, limits.max, (3, 3), numpy.int32)
        self.world = ferrodrive.World(bitrate=1_000_000)
        for node in NODES:
            self.world.add("m4230e17b50", node=node)
        self.host = Host(self.world)
        self.world.wait_until_booted()
        self.engine = Engine("arm.xml", self.world, JOINTS)
        self.host.wait = self.engine.run
        enable_arm(self.host)
        self.engine.run(0.5)
        list(self.world.events())
        self.begin = self.engine.state()
        self.target = numpy.array([self.world[node].position for node in NODES], numpy.int64)
        self.first = self.target.copy()

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.engine.set_state(self.begin)
        self.target[:] = self.first
        self.goal = self.first + self.np_random.integers(-COUNTS_PER_TURN // 8, COUNTS_PER_TURN // 8, 3)
        self.steps = 0
        self._exchange()
        self.left = self._left()
        return self._observation(), {}

    def step(self, action):
        self.target += numpy.clip(action, -MOST_COUNTS, MOST_COUNTS)
        self._exchange()
        self.steps += 1
        before, self.left = self.left, self._left()
        fault = self._fault()
        there = bool(numpy.all(numpy.abs(self.goal - self.position) < CLOSE_COUNTS))
        info = {} if fault is None else {"fault": fault}
        return self._observation(), before - self.left, there or fault is not None, self.steps >= MOST_STEPS, info

    def _exchange(self):
        """A cycle: the targets, SYNC, and what the joints answer; then its time passes."""
        if self.steps % 100 == 0:
            self.host.send(HEARTBEAT, b"\x05")
        for node, target in zip(NODES, self.target):
            self.host.send(0x500 + node, int(target).to_bytes(4, "little", signed=True))
        self.host.send(0x080)
        self.engine.run(PERIOD_S)
        self.host.hear()
        said = [self.host.heard[0x480 + node] for node in NODES]
        self.position = numpy.array([int.from_bytes(data[:4], "little", signed=True) for data in said])
        self.statusword = [int.from_bytes(data[4:6], "little") for data in said]

    def _observation(self):
        return numpy.array([self.position, self.statusword, self.goal]).T.astype(numpy.int32)

    def _left(self):
        return float(numpy.abs(self.goal - self.position).sum()) / COUNTS_PER_TURN

    def _fault(self):
        """What the first joint that has one says."""
        for node, statusword in zip(NODES, self.statusword):
            if statusword & FAULT:
                said = [f"node {event['node']}: {event['text']}" for event in self.world.events() if event["kind"] == "fault"]
                return said[0] if said else f"node {node}: alarm {self.world[node].error_code:X}h"
        return None


def straight_there(observation):
    """A policy: as fast as it may towards the goal."""
    position, goal = observation[:, 0].astype(int), observation[:, 2].astype(int)
    return numpy.clip((goal - position) // 20, -MOST_COUNTS, MOST_COUNTS).astype(numpy.int32)


if __name__ == "__main__":
    environment = Reach()
    observation, _ = environment.reset(seed=1)
    ended = cut = False
    total = 0.0
    while not (ended or cut):
        observation, reward, ended, cut, info = environment.step(straight_there(observation))
        total += reward
    print(f"{environment.steps} steps, reward {total:.3f}, {info.get('fault', 'no fault')}")
