"""MuJoCo with drives of Ferrodrive at its joints: a step of the engine is an exchange and a step of MuJoCo."""

import contextlib
import pathlib
import threading

import ferrodrive
import mujoco
import numpy

HERE = pathlib.Path(__file__).resolve().parent


class Engine:
    """A model of MuJoCo whose named joints are moved by drives of a world, one each."""

    def __init__(self, file, world, drives, *, turns=1.0, rule="integrate", pose=None):
        self.world = world
        self.model = mujoco.MjModel.from_xml_path(str(HERE / file))
        self.data = mujoco.MjData(self.model)
        joints = [self.model.joint(name) for name in drives]
        self.angles = [joint.qposadr[0] for joint in joints]
        self.speeds = [joint.dofadr[0] for joint in joints]
        pose = self.data.qpos[self.angles] if pose is None else pose
        world.external(list(drives.values()), angle_rad=pose, turns=turns, rule=rule)
        # What turns in the drives turns with the joints.
        self.model.dof_armature[self.speeds] = [shaft.inertia_kg_m2 for shaft in world.external_shafts()]
        mujoco.mj_setConst(self.model, self.data)
        self.data.qpos[self.angles] = pose
        mujoco.mj_forward(self.model, self.data)

    def step(self):
        """One step of both."""
        self.step_with(self.world.exchange(self.model.opt.timestep, *self.motion()))

    def motion(self):
        """Angles and velocities of the joints."""
        return self.data.qpos[self.angles], self.data.qvel[self.speeds]

    def step_with(self, torque_nm):
        """One step of MuJoCo alone, after an exchange that gave these torques."""
        self.data.qfrc_applied[self.speeds] = torque_nm
        mujoco.mj_step(self.model, self.data)

    def run(self, seconds):
        for _ in range(round(seconds / self.model.opt.timestep)):
            self.step()

    def state(self):
        """What :meth:`set_state` comes back to, the world with it."""
        kind = mujoco.mjtState.mjSTATE_INTEGRATION
        own = numpy.empty(mujoco.mj_stateSize(self.model, kind))
        mujoco.mj_getState(self.model, self.data, own, kind)
        return self.world.snapshot(), own

    def set_state(self, state):
        world, own = state
        self.world.restore(world)
        mujoco.mj_setState(self.model, self.data, own, mujoco.mjtState.mjSTATE_INTEGRATION)
        mujoco.mj_forward(self.model, self.data)

    @contextlib.contextmanager
    def going_on(self):
        """While the block runs, the engine goes on as far as the program waits: for a master, for canopen-python, for ``time.sleep``."""
        stopped, failed = threading.Event(), []

        def keep_stepping():
            try:
                while not stopped.is_set():
                    self.step()
            except Exception as error:
                failed.append(error)

        with ferrodrive.virtual_time(self.world):
            thread = threading.Thread(target=keep_stepping, name="MuJoCo")
            thread.start()
            try:
                yield self
            finally:
                stopped.set()
                thread.join()
                if failed:
                    raise failed[0]
