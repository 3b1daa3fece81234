"""Captures as values and as files: what :meth:`Drive.capture` has given is written, read back, and looked at for what it shows of its drive."""

from __future__ import annotations

import math
import os
from array import array
from typing import Any, Optional, cast

from . import _native
from .parameters import File
from .reports import Capture, CaptureTuning


def captured(report: dict[str, Any]) -> Capture:
    """The lists of a capture as arrays, which numpy takes without a copy."""
    traces = report["traces"]
    return {
        "name": report.get("name", ""),
        "notes": report.get("notes", ""),
        "node": report["node"],
        "model": report["model"],
        "trigger_s": report["trigger_s"],
        "time_s": array("d", report["time_s"]),
        "values": {
            trace["quantity"]: array("d", (math.nan if value is None else value for value in trace["values"])) for trace in traces
        },
        "units": {trace["quantity"]: trace["unit"] for trace in traces},
        "by": {trace["quantity"]: trace["by"] for trace in traces},
        "period_s": {trace["quantity"]: trace["period_s"] for trace in traces},
        "jitter_s": {trace["quantity"]: trace["jitter_s"] for trace in traces},
        "gaps": {trace["quantity"]: trace["gaps"] for trace in traces},
        "parameters": {name: bytes(value) for name, value in report["objects"]},
    }


def save_capture(capture: Capture, path: File) -> None:
    """Writes a capture to a file that ``ferrodrive plot``, ``report`` and the studio read: a new one, or over an earlier record.

    :param capture: of :meth:`Drive.capture` or :func:`load_capture`; its ``name`` and ``notes`` may have been set
    :param path: ``NAME.mcap`` or ``NAME.csv``
    :raises MasterError: the name has another ending
    :raises OSError: the file cannot be written, or belongs to others

    >>> capture = drive.capture("velocity", duration=0.05, period=0.002)
    >>> ferrodrive.save_capture({**capture, "notes": "cold"}, "step.csv")
    >>> ferrodrive.load_capture("step.csv")["notes"]
    'cold'
    """
    values = {
        **{name: capture[name] for name in ("name", "notes", "node", "model", "trigger_s")},
        "time_s": list(capture["time_s"]),
        "traces": [(name, capture["units"].get(name, ""), list(values)) for name, values in capture["values"].items()],
        "objects": [(name, list(value)) for name, value in capture["parameters"].items()],
    }
    _native.save_capture(values, os.fspath(path))


def load_capture(path: File, node: Optional[int] = None) -> Capture:
    """Reads a capture, or what a record has of a node.

    :param path: ``NAME.mcap`` or ``NAME.csv``
    :param node: of which node, where the file has several
    :raises MasterError: it cannot be read, or has nothing of the node

    >>> ferrodrive.save_capture(drive.capture("velocity", duration=0.05, period=0.002), "run.csv")
    >>> list(ferrodrive.load_capture("run.csv")["values"])
    ['velocity_rpm']
    """
    return captured(_native.load_capture(os.fspath(path), node))


def tune_capture(path: File, node: Optional[int] = None, *, torque_constant: Optional[float] = None) -> CaptureTuning:
    """What a capture of any instrument shows of its drive: frequency response with coherence, masses, speed loop. Nothing moves. What
    ``ferrodrive tune --capture`` does with such a file; logs of frames are for the command line.

    :param path: ``NAME.mcap`` or ``NAME.csv`` with ``current_demand_a`` or ``current_a``, ``position_deg`` or ``velocity_rpm``, and best of all
        ``velocity_demand_rpm``
    :param node: of which node, where the file has several
    :param torque_constant: N m per A of its motor; of a model without a reducer that is named in the file, without it, that which it is delivered with
    :raises MasterError: what it lacks, or why nothing can be said of it

    >>> ferrodrive.save_capture(drive.capture("velocity", duration=0.05, period=0.002), "run.csv")
    >>> ferrodrive.tune_capture("run.csv")
    Traceback (most recent call last):
    ferrodrive.errors.BadRequest: nothing can be found from the capture of node 5
    """
    return cast(CaptureTuning, _native.tune_capture(os.fspath(path), node, torque_constant))
