"""An environment of Gymnasium: a base on two hub motors on a floor in MuJoCo, led over CAN every 2 ms. Values in and out are those of PDOs.

    python examples/mujoco/square.py
"""

import math

import ferrodrive
import gymnasium
import numpy
from engine import Engine
from host import Host

WHEELS = {"left": 4, "right": 5}
NODES = tuple(WHEELS.values())
#: The right motor sits the other way round.
TURNS = (1, -1)
RADIUS_M, BASE_M, COUNTS_PER_TURN = 0.0865, 0.4, 4096
PERIOD_S = 0.002
MOST_RPM = 120
CORNERS = ((0.5, 0.0), (0.5, 0.5), (0.0, 0.5), (0.0, 0.0))
CLOSE_M = 0.05
FAULT = 0x0008
MOST_STEPS = 15_000


class Square(gymnasium.Env):
    """Drives past the corners of a square of half a metre.

    Action: the target velocity (60FFh) of each wheel in r/min, as its RPDO has it. Observation: for each wheel its position (6064h) in
    counts and its statusword (6041h), as TPDO1 has them, and the number of the next corner, twice. The reward is what the way to the
    corner became shorter by, in m. A fault of a wheel ends the episode; its reason is ``info["fault"]``.
    """

    metadata = {"render_modes": []}

    def __init__(self):
        self.action_space = gymnasium.spaces.Box(-MOST_RPM, MOST_RPM, (2,), numpy.int32)
        limits = numpy.iinfo(numpy.int32)
        self.observation_space = gymnasium.spaces.Box(limits.min, limits.max, (2, 3), numpy.int32)
        self.world = ferrodrive.World(bitrate=500_000)
        for node in NODES:
            self.world.add("zlac8030l", node=node)
        self.host = Host(self.world)
        self.world.wait_until_booted()
        self.engine = Engine("base.xml", self.world, WHEELS, turns=TURNS)
        self.host.wait = self.engine.run
        for node in NODES:
            self.host.map_pdo(node, 0x1400, 0x1600, 0x200 + node, [(0x60FF, 0, 32)])
            self.host.map_pdo(node, 0x1800, 0x1A00, 0x180 + node, [(0x6041, 0, 16), (0x6064, 0, 32)])
            self.host.write(node, 0x6060, 0, 3, 1)  # profile velocity
            self.host.write(node, 0x2000, 0, 100, 2)  # it stops when its host is silent for 100 ms
        self.host.send(0x000, b"\x01\x00")
        for controlword in (6, 7, 15):
            for node in NODES:
                self.host.write(node, 0x6040, 0, controlword, 2)
        list(self.world.events())
        self.send((0, 0))
        self.engine.run(PERIOD_S)
        self.begin = self.engine.state()

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.go_back()
        self.engine.run(PERIOD_S)
        return self.begun()

    def step(self, action):
        self.send(numpy.clip(action, -MOST_RPM, MOST_RPM))
        self.engine.run(PERIOD_S)
        return self.done()

    def go_back(self):
        """The first half of a reset, up to the time that passes."""
        self.engine.set_state(self.begin)
        # Counts of an encoder begin where it was switched on.
        self.corner = self.steps = 0
        self.send((0, 0))

    def begun(self):
        """The second half."""
        self._hear()
        self.left = self._left()
        return self._observation(), {}

    def send(self, targets_rpm):
        """The first half of a step: the targets, and SYNC."""
        for node, target_rpm in zip(NODES, targets_rpm):
            self.host.send(0x200 + node, int(target_rpm).to_bytes(4, "little", signed=True))
        self.host.send(0x080)

    def done(self):
        """The second half: what the wheels have answered, and what came of it."""
        self._hear()
        self.steps += 1
        reward, self.left = self.left - self._left(), self._left()
        if self.left < CLOSE_M and self.corner < len(CORNERS):
            self.corner += 1
            self.left = self._left()
        fault = self._fault()
        info = {} if fault is None else {"fault": fault}
        ended = self.corner == len(CORNERS) or fault is not None
        return self._observation(), reward, ended, self.steps >= MOST_STEPS, info

    def _hear(self):
        self.host.hear()
        said = [self.host.heard.get(0x180 + node, bytes(6)) for node in NODES]
        self.statusword = [int.from_bytes(data[:2], "little") for data in said]
        self.position = [int.from_bytes(data[2:6], "little", signed=True) for data in said]

    def _observation(self):
        return numpy.array([self.position, self.statusword, [self.corner] * 2], numpy.int32).T

    def pose(self):
        """Where the base truly is: x and y in m, and its heading in rad."""
        x, y, _, w, _, _, z = self.engine.data.qpos[:7]
        return x, y, 2 * math.atan2(z, w)

    def _left(self):
        x, y, _ = self.pose()
        corner = CORNERS[min(self.corner, len(CORNERS) - 1)]
        return math.dist(corner, (x, y))

    def _fault(self):
        """What the first wheel that has one says."""
        for node, statusword in zip(NODES, self.statusword):
            if statusword & FAULT:
                said = [f"node {event['node']}: {event['text']}" for event in self.world.events() if event["kind"] == "fault"]
                return said[0] if said else f"node {node}: fault {self.world[node].error_code:X}h"
        return None


class Odometry:
    """A policy that knows no more than the PDOs: counts where it is, and steers to the next corner."""

    def __init__(self):
        self.x = self.y = self.heading = 0.0
        self.last = None

    def __call__(self, observation):
        counts = observation[:, 0].astype(int) * TURNS
        before, self.last = self.last if self.last is not None else counts, counts
        left, right = (counts - before) * (2 * math.pi * RADIUS_M / COUNTS_PER_TURN)
        self.heading += (right - left) / BASE_M
        self.x += (left + right) / 2 * math.cos(self.heading)
        self.y += (left + right) / 2 * math.sin(self.heading)
        x, y = CORNERS[min(observation[0, 2], len(CORNERS) - 1)]
        turn = math.remainder(math.atan2(y - self.y, x - self.x) - self.heading, math.tau)
        speed = 60 * max(0.0, math.cos(turn)) ** 3
        steer = max(-25.0, min(25.0, 60 * turn))
        return numpy.array([speed - steer, -(speed + steer)]).round().astype(numpy.int32)


if __name__ == "__main__":
    environment, policy = Square(), Odometry()
    observation, _ = environment.reset(seed=1)
    ended = cut = False
    while not (ended or cut):
        observation, reward, ended, cut, info = environment.step(policy(observation))
    x, y, _ = environment.pose()
    print(f"{environment.steps} steps, at {x:.2f} {y:.2f} m, {info.get('fault', 'no fault')}")
