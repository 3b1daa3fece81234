"""What a network reports, as dicts: the same fields as ``--json`` prints (docs/json.md), but for ``ok`` where what failed is an exception.

An object is a text as the manuals write it (``6064h:00``). What is not known is None. A field's unit ends its name.
"""

from __future__ import annotations

from array import array
from typing import Any, Optional, TypedDict


class Fault(TypedDict):
    """A fault that a drive has, and what to do about it."""

    name: str
    remedy: str


class DriveState(TypedDict):
    """Of :meth:`Drive.state`. ``power`` is the state by CiA 402-2, ``mode`` the number of 6061h, ``position`` in counts of the drive,
    ``angle_deg`` and ``velocity_rpm`` those of the output. What the model does not have or
    the drive refuses is None."""

    statusword: int
    power: Optional[str]
    mode: Optional[int]
    fault_code: Optional[int]
    faults: list[Fault]
    position: Optional[int]
    angle_deg: Optional[float]
    velocity_rpm: Optional[float]
    current_a: Optional[float]
    supply_v: Optional[float]
    motor_c: Optional[float]
    driver_c: Optional[float]
    nmt: Optional[str]


class MotionReport(TypedDict):
    """Of a motion: after how long it was seen to be there, None where that was not waited for; and what else is to be known."""

    reached_after_s: Optional[float]
    notes: list[str]


class Capture(TypedDict):
    """Of :meth:`Drive.capture`: the times of the rows in s, and by the name of each quantity, with its unit in it, as many values (NaN where no
    reading belongs to a time), its unit, the TPDO that it came by or ``SDO``, the period that was had, its largest deviation, and how often
    readings are missing. ``parameters`` are those of the drive as they were, by object, in the order of the wire."""

    name: str
    notes: str
    node: int
    model: str
    trigger_s: Optional[float]
    time_s: array[float]
    values: dict[str, array[float]]
    units: dict[str, str]
    by: dict[str, str]
    period_s: dict[str, Optional[float]]
    jitter_s: dict[str, Optional[float]]
    gaps: dict[str, int]
    parameters: dict[str, bytes]


class TestMotionRun(TypedDict):
    """A run of :meth:`Drive.test_motion`, as ``docs/json.md`` has it: ``followed`` of points (how long it took, and the distance from the
    set-point), ``steps`` of steps with rise, overshoot and settling, ``heating`` of the current; and what was captured."""

    run: int
    followed: Optional[dict[str, float]]
    steps: list[dict[str, Any]]
    no_steps: Optional[str]
    heating: Optional[dict[str, float]]
    capture: Capture


class Tuning(TypedDict):
    """Of :meth:`Drive.tune`, as ``docs/json.md`` has it: what was found, the gains that are proposed, their margins, and the errors on the
    twin and on the drive, before and after; the frequency response with its coherence."""

    node: int
    model: str
    inertia_kg_m2: float
    dry_friction_nm: float
    viscous_friction_nm_s: float
    load_nm: float
    torque_constant_nm_a: float
    anti_resonance_hz: Optional[float]
    resonance_hz: Optional[float]
    loop_delay_ms: float
    coherent: int
    frequencies: int
    model_off: float
    twin_off: float
    period_ms: Optional[float]
    gain_share: float
    peak_a: float
    travel_turns: float
    gains: list[dict[str, Any]]
    before: dict[str, Any]
    after: dict[str, Any]
    position: Optional[dict[str, Any]]
    twin_error: list[float]
    twin_move: Optional[list[dict[str, Optional[float]]]]
    drive_error: Optional[list[float]]
    drive_move: Optional[list[dict[str, Optional[float]]]]
    applied: bool
    notes: list[str]
    response: list[dict[str, Any]]


class CaptureTuning(TypedDict):
    """Of :func:`tune_capture`, as ``docs/json.md`` has it: what was used, what was found of the mechanics and the speed loop, and the
    frequency response with its coherence."""

    node: int
    rows: int
    period_s: float
    quantities: list[str]
    coherent: int
    frequencies: int
    gain_rad_s2_a: float
    viscous_per_s: float
    inertia_kg_m2: Optional[float]
    viscous_friction_nm_s: Optional[float]
    anti_resonance_hz: Optional[float]
    resonance_hz: Optional[float]
    delay_ms: float
    model_off: float
    proportional_a_s_rad: Optional[float]
    integral_a_rad: Optional[float]
    notes: list[str]
    response: list[dict[str, Any]]


class RampTuning(TypedDict):
    """Of :meth:`Drive.tune_ramps`, as ``docs/json.md`` has it: the torques at the speed, the values that are proposed, the least margin on
    the ramp before and after, and how many steps the twin lost under a load so many times as large."""

    node: int
    model: str
    supply_v: float
    inertia_kg_m2: float
    speed_rpm: float
    pull_out_nm: float
    needed_nm: float
    highest_rpm: float
    start_rpm: float
    margin: float
    margin_before: float
    margin_after: float
    values: list[dict[str, Any]]
    twin: list[dict[str, Any]]
    applied: bool
    notes: list[str]


class AxisState(TypedDict):
    """An axis of a group in its last cycle. ``following_error_deg`` is how far its shaft was from the set-point that it had then, as the
    group judges it: behind the time that the drive is allowed."""

    angle_deg: Optional[float]
    set_point_deg: float
    following_error_deg: Optional[float]
    power: Optional[str]


class GroupState(TypedDict):
    """Of :meth:`Group.state`; ``cause`` is what stopped it."""

    phase: str
    cause: Optional[str]
    missed_cycles: int
    axes: list[AxisState]


class BaseState(TypedDict):
    """Of :meth:`Base.state`: where it is by its wheels, from where it was opened, the twist that it is driven with, and the ``cause`` of a
    stop."""

    x_m: float
    y_m: float
    heading_deg: float
    linear_m_s: float
    angular_rad_s: float
    cause: Optional[str]


class BaseTwist(TypedDict):
    """Of :meth:`Base.command` and :meth:`Base.drive`: the twist that the base is driven with, and whether its limits are why that is less
    than what was asked for."""

    linear_m_s: float
    angular_rad_s: float
    limited: bool


class Heard(TypedDict):
    """Frames that others sent during a scan, of one kind."""

    service: str
    node: Optional[int]
    count: int
    text: str


class ScannedNode(TypedDict):
    """A node that was found."""

    node: int
    model: Optional[str]
    models: list[str]
    guess: Optional[str]
    evidence: Optional[str]
    nmt_state: Optional[str]
    heartbeat_ms: Optional[int]
    device_type: Optional[int]
    vendor_id: Optional[int]
    product_code: Optional[int]
    revision_number: Optional[int]
    remark: Optional[str]


class ScanReport(TypedDict):
    """Of :meth:`Network.scan`."""

    nodes: list[ScannedNode]
    heard: list[Heard]


class BootStep(TypedDict):
    """One step of the boot-up of a node (CiA 302-2); ``verdict`` is ``passed``, ``noted``, ``left`` or ``failed``."""

    step: str
    object: Optional[str]
    expected: str
    found: str
    verdict: str
    next: Optional[str]


class BootedNode(TypedDict):
    """What came of one node; ``letter`` is the error status of CiA 302-2, None for booted."""

    node: int
    model: Optional[str]
    mandatory: bool
    letter: Optional[str]
    meaning: Optional[str]
    state: Optional[str]
    unconfigured: list[str]
    steps: list[BootStep]


class BootReport(TypedDict):
    """Of :meth:`Network.boot`."""

    ok: bool
    nodes: list[BootedNode]
    notes: list[str]


class WatchedEvent(TypedDict):
    """Something that happened on a network that is watched; ``t`` is the time of the bus in s, ``code`` that of an emergency message."""

    t: float
    kind: str
    node: Optional[int]
    code: Optional[int]
    text: str


class ExplainedFinding(TypedDict):
    """A finding; a ``weight`` of ``cause`` keeps the drive from moving, a ``warning`` does not, or not yet."""

    rule: str
    topic: str
    weight: str
    expected: str
    found: str
    follows: str
    remedy: str


class ExplainedPdo(TypedDict):
    """A PDO of the drive; ``silent`` is why it was not heard."""

    pdo: str
    id: int
    valid: bool
    heard: int
    silent: Optional[str]


class ExplainReport(TypedDict):
    """Of :meth:`Network.explain`."""

    node: int
    model: Optional[str]
    nmt: Optional[str]
    state: Optional[str]
    mode: Optional[int]
    velocity_rpm: Optional[float]
    supply_v: Optional[float]
    listened_s: float
    causes: int
    findings: list[ExplainedFinding]
    pdos: list[ExplainedPdo]


class NodeReport(TypedDict):
    """Of :meth:`Network.report`: what its page has, but for the pictures."""

    node: int
    model: str
    title: str
    manual: str
    at: str
    by: Optional[str]
    bus: str
    identity: list[dict[str, Any]]
    state: list[dict[str, Any]]
    compared: int
    not_compared: int
    differences: list[dict[str, Any]]
    refused: list[dict[str, Any]]
    pdos: list[dict[str, Any]]
    limits: list[dict[str, Any]]
    guard: dict[str, Any]
    fault: Optional[dict[str, Any]]
    fault_not_known: Optional[str]
    remembered: Optional[list[dict[str, Any]]]
    remembered_not_known: Optional[str]
    captures: list[dict[str, Any]]
    tunings: list[dict[str, Any]]


class _CheckReport(TypedDict):
    ok: bool
    file: str
    nodes: list[dict[str, Any]]
    errors: int
    warnings: int
    notes: int
    findings: list[dict[str, Any]]
    predicted: Optional[dict[str, Any]]
    live: Optional[list[dict[str, Any]]]


class CheckReport(_CheckReport, total=False):
    """Of :func:`check` and :meth:`Network.check`. ``findings`` have ``severity``, ``rule``, ``at``, ``node``, ``what`` and ``next``;
    ``predicted`` is how the bus boots and what is sent then, ``live`` what the drives of a bus answered, ``error`` why ``ok`` is False."""

    error: dict[str, Any]


class PlannedFrame(TypedDict):
    """A frame of a planned bus, times in us; a worst time of None has no bound."""

    frame: str
    node: Optional[int]
    id: str
    bytes: int
    every_us: float
    wire_us: float
    worst_us: Optional[float]
    cycle_worst_us: Optional[float]
    deadline_us: float
    in_time: bool


class _PlanReport(TypedDict):
    ok: bool
    fits: bool
    bitrate: int
    cycle_us: float
    load: float
    cycle_load: float
    frames: list[PlannedFrame]
    most_drives: int
    most_drives_in_cycle: int
    drives: int
    notes: list[str]


class PlanReport(_PlanReport, total=False):
    """Of :meth:`Network.plan`; loads are from 0 to 1, ``bitrate`` in bit/s. ``moved`` is there where a group or the base of the machine
    file is planned."""

    moved: str


class Shown(TypedDict):
    """A value: its bytes on the wire, and in words and units."""

    bytes: str
    text: str


class NamedObject(TypedDict):
    """An object that was left out or refused, and why."""

    object: str
    name: Optional[str]
    why: str


class BackupReport(TypedDict, total=False):
    """Of :meth:`Parameters.backup`: ``file`` where one was written, else ``parameters``, the file itself as TOML."""

    node: int
    file: str
    parameters: str
    values: int
    refused: list[NamedObject]


class Difference(TypedDict):
    """An object that differs; None where a value is absent."""

    object: str
    name: Optional[str]
    first: Optional[Shown]
    second: Optional[Shown]


class DiffReport(TypedDict):
    """Of :meth:`Parameters.diff`."""

    first: str
    second: str
    differences: list[Difference]


class PlannedWrite(TypedDict):
    """A write of a transaction, and what it is for."""

    object: str
    name: Optional[str]
    before: Optional[Shown]
    value: Shown
    purpose: str


class ParametersPlan(TypedDict):
    """Of :meth:`Parameters.plan`; ``same`` is how many values are there already."""

    node: int
    file: str
    same: int
    steps: list[PlannedWrite]
    left: list[NamedObject]
    notes: list[str]


class Rounded(TypedDict):
    """A value that the drive made another of."""

    object: str
    name: Optional[str]
    asked: Shown
    found: Shown


class ApplyReport(TypedDict):
    """Of :meth:`Parameters.apply`; ``proved`` is how the drive was started anew, after which everything read as written."""

    node: int
    file: str
    writes: int
    rounded: list[Rounded]
    left: list[NamedObject]
    saved: bool
    proved: Optional[str]
    notes: list[str]


class _Deviation(TypedDict):
    object: str
    name: Optional[str]
    wanted: Shown
    found: Optional[Shown]


class Deviation(_Deviation, total=False):
    """An object that has another value than it should; ``found`` is None where the node refused to show it, and ``refused`` says why."""

    refused: str


class VerifyReport(TypedDict):
    """Of :meth:`Parameters.verify`."""

    ok: bool
    node: int
    file: str
    compared: int
    deviations: list[Deviation]


class RollbackReport(TypedDict):
    """Of :meth:`Parameters.rollback`."""

    node: int
    journal: str
    put_back: int
    nmt_back: Optional[str]
