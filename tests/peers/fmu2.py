"""Checks of `ferrodrive fmu --fmi 2`: FMPy validates and steps a drive with its master by FMI 2.0."""

import ctypes
import math
import random
import tempfile

from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave
from fmpy.validation import validate_fmu

from checks import check, equal, near, true
from drive import ZLAC8030L
from fmu import Slave, pack, refused

FMI2 = ["--fmi", "2"]
READY = ["zlac8030l@4,timing=ideal", *FMI2]


class Instance(Slave):
    """By FMI 2.0, in steps of 1 ms."""

    def __init__(self, path, folder, guid=None):
        super().__init__(FMU2Slave, path, folder, "100 %s", guid)

    def begin(self):
        self.fmu.setupExperiment(startTime=0.0)
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()

    def run(self, steps):
        for _ in range(steps):
            self.fmu.doStep(currentCommunicationPoint=self.time, communicationStepSize=1e-3)
            self.time += 1e-3

    def set(self, **values):
        for name, value in values.items():
            put = self.fmu.setBoolean if isinstance(value, bool) else self.fmu.setReal
            put([self.reference[name]], [value])

    def real(self, name):
        return self.fmu.getReal([self.reference[name]])[0]

    def true(self, name):
        return bool(self.fmu.getBoolean([self.reference[name]])[0])

    def text(self, name):
        return self.fmu.getString([self.reference[name]])[0].decode()


@check("FMPy finds nothing wrong with the FMUs of drives with a master (FMI 2.0)", ZLAC8030L)
def valid(bench):
    with tempfile.TemporaryDirectory() as folder:
        for words in (READY, [*READY, "--mode", "torque"], [*READY, "--rule", "integrate"], ["m4230e17b50@5", *FMI2, "--mode", "position"]):
            equal(validate_fmu(pack(bench, folder, *words)), [], f"problems of {words}")


@check("FMPy turns, loads and stops a drive by numbers (FMI 2.0)", ZLAC8030L)
def turned(bench):
    with tempfile.TemporaryDirectory() as folder, Instance(pack(bench, folder, *READY), folder) as drive:
        drive.begin()
        drive.set(target_velocity=2 * math.pi)
        drive.run(500)
        equal((drive.real("velocity"), drive.true("follows")), (0.0, False), "speed without enable")
        drive.set(enable=True)
        drive.run(1500)
        near(drive.real("velocity"), 2 * math.pi, 0.05, "60 r/min in rad/s")
        before = drive.real("current")
        drive.set(load_torque=2.0)
        drive.run(500)
        near(drive.real("velocity"), 2 * math.pi, 0.05, "60 r/min under load in rad/s")
        true(drive.real("current") > before + 0.5, "2 N·m take more current")
        drive.set(load_torque=0.0, stop=True)
        drive.run(700)
        near(drive.real("velocity"), 0.0, 0.01, "speed after a stop in rad/s")
        true("enable has been false" in drive.text("refusal"), drive.text("refusal"))
        equal(drive.fmu.getInteger([drive.reference["statusword"]])[0] & 0x6F, 0x07, "Quick stop active (CiA 402-2, table 29)")
        drive.fmu.terminate()


@check("a drive with a master turns a joint that FMPy's importer moves, and stops it (FMI 2.0)", ZLAC8030L)
def joint(bench):
    with tempfile.TemporaryDirectory() as folder, Instance(pack(bench, folder, *READY, "--rule", "integrate"), folder) as drive:
        drive.begin()
        inertia = 0.05 + drive.real("joint_inertia")
        angle, velocity = 0.0, 0.0
        drive.set(target_velocity=2 * math.pi)
        for step in range(3000):
            if step in (500, 2000):
                near(velocity, 0.0 if step == 500 else 2 * math.pi, 0.1, "speed of the joint in rad/s")
                drive.set(enable=step == 500)
            drive.set(joint_angle=angle, joint_velocity=velocity)
            drive.run(1)
            velocity += drive.real("joint_torque") / inertia * 1e-3
            angle += velocity * 1e-3
        near(velocity, 0.0, 0.01, "speed after enable was taken away in rad/s")
        refused(lambda: drive.set(joint_angle=math.nan), "not a number")
        refused(lambda: drive.fmu.doStep(0.0, 1e-3), "a step backwards")


@check("a state that FMPy takes back, also from bytes, goes on alike (FMI 2.0)", ZLAC8030L)
def states(bench):
    with tempfile.TemporaryDirectory() as folder, Instance(pack(bench, folder, *READY), folder) as drive:
        drive.begin()
        drive.set(enable=True, target_velocity=3.0)
        drive.run(900)
        state = drive.fmu.getFMUstate()
        data = drive.fmu.serializeFMUstate(state)
        begin = drive.time

        def onward():
            drive.time = begin
            drive.set(load_torque=1.0)
            seen = []
            for _ in range(200):
                drive.run(1)
                seen.append([drive.real(name) for name in ("angle", "velocity", "current", "actual_velocity")])
            return seen

        first = onward()
        drive.fmu.setFMUstate(state)
        equal(onward(), first, "from the state")
        drive.fmu.setFMUstate(drive.fmu.deSerializeFMUstate(data))
        equal(onward(), first, "from its bytes")
        drive.fmu.freeFMUstate(state)


@check("calls of no sense are answered with fmi2Error, and the process lives (FMI 2.0)", ZLAC8030L)
def wrong(bench):
    with tempfile.TemporaryDirectory() as folder:
        path = pack(bench, folder, *READY)
        refused(lambda: Instance(path, folder, guid="of another"), "a wrong GUID")
        with Instance(path, folder) as drive:
            refused(lambda: drive.run(1), "a step before initialization")
            drive.begin()
            drive.run(1)
            refused(lambda: drive.fmu.doStep(0.0, 1e-3), "a step backwards")
            refused(lambda: drive.fmu.doStep(1e-3, -1e-3), "a step that takes time away")
            refused(lambda: drive.fmu.getReal([12345]), "a variable that is not there")
            refused(lambda: drive.fmu.getInteger([drive.reference["angle"]]), "a variable of another type")
            refused(lambda: drive.set(target_velocity=math.nan), "not a number")
            refused(lambda: drive.set(sync_period=0.01), "a parameter while it runs")
            refused(lambda: drive.fmu.setFMUstate(ctypes.c_void_p(99)), "a state that is not one")
            chance = random.Random(1)
            done = 0
            for _ in range(3000):
                reference = chance.choice([0, 7, 20, 23, 10, 11, 208, 402, chance.getrandbits(32)])
                value = chance.uniform(-1e6, 1e6)
                call, *arguments = chance.choice([
                    (drive.fmu.getReal, [reference]), (drive.fmu.getBoolean, [reference]), (drive.fmu.getString, [reference]),
                    (drive.fmu.getInteger, [reference]), (drive.fmu.setReal, [reference], [value]),
                    (drive.fmu.setInteger, [reference], [int(value)]), (drive.fmu.setBoolean, [reference], [value > 0]),
                    (drive.fmu.doStep, value, value),
                ])  # fmt: skip
                try:
                    call(*arguments)
                    done += 1
                except FMICallException as error:
                    equal(error.status, 3, f"status of {call.__name__}{arguments}")
            true(100 < done < 2900, f"{done} of 3000 were taken")
            drive.run(10)
