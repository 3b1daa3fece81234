"""Checks of `ferrodrive fmu` in containers of fmu-manipulation-toolbox: an FMU of others that holds ours, and steps them.

Its release 2.0 hands a frame from a node on to the bus; of one from the bus it has the node's clock tick, and does not set the data that
belong to it (also with the layered standard's own demonstration FMUs). So what is asked here is what it does carry."""

import logging
import pathlib
import tempfile

import fmpy
import numpy

import ferrodrive
from checks import Skip, check, equal, near, true
from drive import ZLAC8030L
from fmu import Instance, pack

STEP_S = 1e-3


def contained(folder, version, files, links=(), inputs=(), outputs=(), starts=()):
    """The path of a container of these files; links go by terminals, inputs and outputs are (file, variable, name), starts (file, variable,
    value)."""
    try:
        from fmu_manipulation_toolbox.container import FMUContainer
    except ImportError as error:
        raise Skip(f"{error.name} is not installed: pip install -r tests/peers/requirements.txt") from error
    # It reports each variable that nothing is joined to.
    logging.getLogger("fmu_manipulation_toolbox").setLevel(logging.CRITICAL)
    container = FMUContainer("whole", folder, fmi_version=version)
    for file in files:
        container.get_fmu(file)
    for link in links:
        container.add_link(*link)
    for file, variable, name in inputs:
        container.add_input(name, file, variable)
    for file, variable, name in outputs:
        container.add_output(file, variable, name)
    for start in starts:
        container.add_start_value(*start)
    container.make_fmu("whole.fmu", step_size=STEP_S)
    return str(pathlib.Path(folder) / "whole.fmu")


@check("a drive with its master turns in a container of fmu-manipulation-toolbox as it does alone, to the last bit", ZLAC8030L)
def driven(bench):
    with tempfile.TemporaryDirectory() as folder:
        alone = pack(bench, folder, "zlac8030l@4,timing=ideal", "--fmi", "2")
        file = pathlib.Path(alone).name
        names = ("enable", "target_velocity", "load_torque")
        whole = contained(
            folder, 2, [file], inputs=[(file, name, name) for name in names], outputs=[(file, "velocity", "velocity"), (file, "current", "current")]
        )
        signals = numpy.array(
            [(0.0, False, 0.0, 0.0), (0.2, True, 6.283, 0.0), (2.5, True, 6.283, 0.0), (2.5, True, 6.283, 1.0)],
            dtype=[("time", "f8"), ("enable", "?"), ("target_velocity", "f8"), ("load_torque", "f8")],
        )
        runs = [
            fmpy.simulate_fmu(path, stop_time=3.0, step_size=STEP_S, output_interval=STEP_S, input=signals, output=["velocity", "current"])
            for path in (alone, whole)
        ]
        equal(len(runs[0]), 3001, "samples")
        true(numpy.array_equal(*runs), "speed and current are the same to the last bit")
        near(runs[1]["velocity"][-1], 6.283, 0.1, "speed in rad/s")
        true(runs[1]["current"][-1] > runs[1]["current"][2400] + 0.5, "1 N·m takes more current")


@check("a container of fmu-manipulation-toolbox carries what two drives send to the bus; frames and supply are those of a world", ZLAC8030L)
def on_a_bus(bench):
    # Node 5 has a heartbeat each 100 ms (CiA 301, 7.2.8.3.2.2).
    words = (["zlac8030l@5,timing=ideal,1017=100"], ["zlac8030l@6,timing=ideal"])
    with tempfile.TemporaryDirectory() as folder:
        paths = [pack(bench, folder, "bus", "--nodes", "2"), *(pack(bench, folder, *each, "--clock", "triggered") for each in words)]
        bus, *drives = [pathlib.Path(path).name for path in paths]
        whole = contained(
            folder,
            3,
            [bus, *drives],
            links=[(drive, "CAN", bus, f"Node{number}") for number, drive in enumerate(drives, 1)],
            inputs=[(drives[0], "supply_voltage", "supply")],
            outputs=[(bus, "frames", "frames"), (bus, "errors", "errors"), (drives[0], "bus_voltage", "volts")],
        )
        with Instance(whole, folder) as container:
            container.begin()
            for step in range(1050):
                if step == 700:
                    container.fmu.setFloat64([container.reference["supply"]], [40.0])
                container.step(STEP_S)
            frames, errors = (container.fmu.getUInt64([container.reference[name]])[0] for name in ("frames", "errors"))
            volts = container.real("volts")
    world = ferrodrive.World(timing="ideal")
    of_python = world.add("zlac8030l", node=5, **{"1017": 100})
    world.add("zlac8030l", node=6)
    probe = world.add_probe()
    world.run_for(0.7)
    world.apply("5 supply 40")
    world.run_for(0.35)
    heard = 0
    while world.poll(probe):
        heard += 1
    equal((frames, errors, heard), (2 + 10, 0, 2 + 10), "frames and errors on the bus, frames in a world")
    equal(volts, of_python.supply_v, "voltage at the drive")
    near(volts, 40.0, 0.5, "voltage at the drive")


@check("a drive in a container of fmu-manipulation-toolbox 2.0 gets no confirmation from the bus, and sends no more than its controller holds", ZLAC8030L)
def unheard(bench):
    # What docs/handbook/fmu.md states of that release: another one that does set the data is to be described, and this check to be turned round.
    words = (["zlac8030l@5,timing=ideal,1017=100"], ["zlac8030l@6,timing=ideal"])
    with tempfile.TemporaryDirectory() as folder:
        paths = [pack(bench, folder, "bus", "--nodes", "2"), *(pack(bench, folder, *each, "--clock", "triggered") for each in words)]
        bus, *drives = [pathlib.Path(path).name for path in paths]
        links = [(drive, "CAN", bus, f"Node{number}") for number, drive in enumerate(drives, 1)]
        starts = [(drives[0], "CAN.BusNotifications", "true")]
        whole = contained(folder, 3, [bus, *drives], links=links, outputs=[(bus, "frames", "frames")], starts=starts)
        with Instance(whole, folder) as container:
            container.begin()
            for _ in range(1050):
                container.step(STEP_S)
            frames = container.fmu.getUInt64([container.reference["frames"]])[0]
    # Three frames of node 5, which wait for the bus (docs/handbook/fmu.md), and the boot-up of node 6; ten heartbeats would come in this time.
    equal(frames, 3 + 1, "frames on the bus")
