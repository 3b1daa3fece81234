"""A vector environment of Gymnasium: bases as in square.py side by side, their drives on all cores.

    python examples/mujoco/squares.py
"""

import ferrodrive
import gymnasium
import numpy
from gymnasium.vector.utils import batch_space
from square import MOST_RPM, PERIOD_S, Odometry, Square


class Squares(gymnasium.vector.VectorEnv):
    """Several of :class:`Square`, each with a world and a floor of its own, whose worlds make each step in one exchange.

    Seeds, observations, rewards and the reset after an end (in the next step) are those of ``gymnasium.vector.SyncVectorEnv``.
    """

    metadata = {"render_modes": [], "autoreset_mode": gymnasium.vector.AutoresetMode.NEXT_STEP}

    def __init__(self, count):
        self.squares = [Square() for _ in range(count)]
        self.worlds = ferrodrive.Worlds([square.world for square in self.squares])
        self.num_envs = count
        self.single_action_space = self.squares[0].action_space
        self.single_observation_space = self.squares[0].observation_space
        self.action_space = batch_space(self.single_action_space, count)
        self.observation_space = batch_space(self.single_observation_space, count)
        self.has_ended = numpy.zeros(count, bool)

    def reset(self, *, seed=None, options=None):
        seeds = [None if seed is None else seed + number for number in range(self.num_envs)] if not isinstance(seed, list) else seed
        for square, own in zip(self.squares, seeds, strict=True):
            gymnasium.Env.reset(square, seed=own)
            square.go_back()
        self._run()
        self.has_ended[:] = False
        return numpy.array([square.begun()[0] for square in self.squares]), {}

    def step(self, actions):
        again = self.has_ended.copy()
        for square, action, has_ended in zip(self.squares, actions, again, strict=True):
            if has_ended:
                square.go_back()
            else:
                square.send(numpy.clip(action, -MOST_RPM, MOST_RPM))
        self._run()
        observations, rewards, ended, cut, infos = [], numpy.zeros(self.num_envs), again & False, again & False, {}
        for number, square in enumerate(self.squares):
            if again[number]:
                observation, info = square.begun()
            else:
                observation, rewards[number], ended[number], cut[number], info = square.done()
            observations.append(observation)
            infos = self._add_info(infos, info, number)
        self.has_ended = ended | cut
        return numpy.array(observations), rewards, ended, cut, infos

    def _run(self):
        """A period of all: an exchange of all worlds for each step of MuJoCo."""
        engines = [square.engine for square in self.squares]
        step_s = engines[0].model.opt.timestep
        for _ in range(round(PERIOD_S / step_s)):
            angle_rad, velocity_rad_s = (numpy.stack(rows) for rows in zip(*(engine.motion() for engine in engines)))
            for engine, torque_nm in zip(engines, self.worlds.exchange(step_s, angle_rad, velocity_rad_s)):
                engine.step_with(torque_nm)


if __name__ == "__main__":
    environment = Squares(16)
    policies = [Odometry() for _ in environment.squares]
    observations, _ = environment.reset(seed=1)
    arrived = 0
    while not arrived:
        observations, _, ended, _, infos = environment.step(numpy.array([policy(seen) for policy, seen in zip(policies, observations)]))
        arrived = ended.sum()
    print(f"{arrived} of {environment.num_envs} after {environment.squares[0].steps} steps, {infos.get('fault', 'no fault')}")
