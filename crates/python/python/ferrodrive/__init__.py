"""CANopen motor drives, virtual and real.

Virtual drives on a virtual bus, in virtual time::

    import ferrodrive

    world = ferrodrive.World(bitrate=500_000, seed=1)
    wheel = world.add("zlac8030l", node=4)
    world.wait_until_booted()
    wheel.set_load_torque(0.5)
    print(wheel.supply_v, wheel.velocity_rpm)

The same drives under your own program, unchanged, with python-can or canopen-python::

    bus = can.Bus(interface="ferrodrive", channel=world)

A scenario file, as ``ferrodrive run`` takes it::

    outcome = ferrodrive.run("brown_out.toml", seed=7)
    assert outcome.passed, outcome

Quantities have their units in their names: ``velocity_rpm``, ``current_a``, ``supply_v``.
"""

from ._native import __version__, eds, models, stimulus_forms
from .axes import AsyncBase, AsyncGroup, Axis, Base, Group
from .body import Body
from .captures import load_capture, save_capture, tune_capture
from .control import Control
from .errors import (
    Aborted,
    BadRequest,
    BusWarning,
    FerrodriveError,
    MasterError,
    NoAnswer,
    NotReached,
    Refused,
    SimulatorError,
    Stalled,
    TimeInUse,
)
from .drive import AsyncDrive, Drive
from .external import ExternalShaft, Worlds
from .master import Network, check
from .parameters import AsyncParameters, Parameters
from .scenario import Outcome, Row, Sweep, SweepSummary, run, sweep_table
from .simulator import Simulator
from .supervisor import AsyncSupervisor, Supervisor
from .virtual_drive import VirtualDrive
from .turns import virtual_time
from .world import World

__all__ = [
    "Aborted",
    "AsyncBase",
    "AsyncDrive",
    "AsyncGroup",
    "AsyncParameters",
    "AsyncSupervisor",
    "Axis",
    "BadRequest",
    "Base",
    "Body",
    "BusWarning",
    "Control",
    "Drive",
    "ExternalShaft",
    "FerrodriveError",
    "Group",
    "MasterError",
    "Network",
    "NoAnswer",
    "NotReached",
    "Outcome",
    "Parameters",
    "Refused",
    "Row",
    "Simulator",
    "SimulatorError",
    "Stalled",
    "Supervisor",
    "Sweep",
    "SweepSummary",
    "TimeInUse",
    "VirtualDrive",
    "World",
    "Worlds",
    "__version__",
    "check",
    "eds",
    "load_capture",
    "models",
    "run",
    "save_capture",
    "stimulus_forms",
    "sweep_table",
    "tune_capture",
    "virtual_time",
]
