"""A drive in physical units: what is asked of it, blocking and as coroutines."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Optional, Union

from . import _native
from ._native import Job, model_name
from .captures import captured
from .errors import MasterError
from .reports import Capture, DriveState, MotionReport, RampTuning, TestMotionRun, Tuning
from .words import number

if TYPE_CHECKING:
    from .master import Network


class _Orders:
    """What can be asked of a drive, as jobs. Both kinds of drive wait for these."""

    def __init__(
        self, network: Network, node: int, model: str, gear_ratio: Optional[float] = None, guessed: bool = False
    ) -> None:
        model_name(model)
        self.network = network
        #: Its node-ID, 1 to 127.
        self.node = node
        #: Its model.
        self.model = model
        #: Its model is what its objects show, where others have the same identity: enough to read and to move it.
        self.guessed = guessed
        #: Turns of its shaft for one turn of the output; None: as the machine file says, or 1.
        self.gear_ratio = gear_ratio

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.model} at {self.node}>"

    def _begin(self, do_: str, **order: Any) -> Job:
        given = {name: _given(do_, name, value) for name, value in order.items() if value is not None}
        behind = {} if self.gear_ratio is None else {"gear_ratio": self.gear_ratio}
        return self.network._native.drive(self.node, self.model, {"do_": do_, "guessed": self.guessed, **behind, **given})


    def _capture(
        self, quantities: tuple[str, ...], take: Sequence[str], journal: Optional[Union[str, "os.PathLike[str]"]], **order: Any
    ) -> Job:
        return self._whole(_native.capture, journal, {**order, "quantities": list(quantities), "take": list(take)})

    def _test_motion(
        self, shape: str, quantities: tuple[str, ...], journal: Optional[Union[str, "os.PathLike[str]"]], **order: Any
    ) -> Job:
        usual = 0.001 if shape == "steps" else order["period"]
        whole = {**order, "shape": shape, "quantities": list(quantities), "capture_period": order["capture_period"] or usual}
        return self._whole(_native.test_motion, journal, whole)

    def _tune(self, journal: Optional[Union[str, "os.PathLike[str]"]], **order: Any) -> Job:
        return self._whole(_native.tune_drive, journal, order)

    def _tune_ramps(self, journal: Optional[Union[str, "os.PathLike[str]"]], **order: Any) -> Job:
        return self._whole(_native.tune_ramps_of, journal, order)

    def _whole(
        self,
        begin: Callable[[Any, int, Optional[str], dict[str, Any]], Job],
        journal: Optional[Union[str, "os.PathLike[str]"]],
        order: dict[str, Any],
    ) -> Job:
        kept = None if journal is None else os.fspath(journal)
        return begin(self.network._native, self.node, self.model, {**order, "journal": kept})


#: What the values of an order are called where they are given.
_ASKED = {("velocity", "value"): "rpm", ("move", "value"): "degrees", ("torque", "value"): "current_a", ("home", "limit_s"): "within"}


def _given(do_: str, name: str, value: Any) -> Any:
    if name in ("value", "limit_s") or name.endswith(("_rpm", "_rpm_s")):
        return number(_ASKED.get((do_, name), name), value)
    return value


def _runs(report: dict[str, Any]) -> list[TestMotionRun]:
    return [{**run, "capture": captured(run["capture"])} for run in report["runs"]]  # type: ignore[typeddict-item]


@contextmanager
def _reported_as(made: Callable[[dict[str, Any]], Any]) -> Iterator[None]:
    """What came of something that was stopped or cut off has the same form as the whole of it."""
    try:
        yield
    except MasterError as error:
        if error.report is not None:
            error.report = made(error.report)
        raise


def _angle(degrees: Optional[float], counts: Optional[int]) -> dict[str, Any]:
    if (degrees is None) == (counts is None):
        raise ValueError("expected an angle in degrees or in counts, one of them")
    return {"value": degrees} if counts is None else {"counts": counts}


class Drive(_Orders):
    """A drive in physical units. From :meth:`Network.drive`. Every method waits until it is done, and raises :class:`MasterError` if it is
    not: :class:`NoAnswer`, :class:`Aborted`, :class:`NotReached`, :class:`BadRequest` for a value beyond what it takes.

    >>> drive = network.drive(5, "cia402")
    >>> report = drive.velocity(60)
    >>> drive.stop()
    """

    def enable(self) -> None:
        """Brings it to Operation enabled (CiA 402-2, clause 8).

        :raises NotReached: it does not get there, with what keeps it

        >>> drive.enable()
        >>> drive.state()["power"]
        'Operation enabled'
        """
        self.network._finish(self._begin("enable"))

    def disable(self) -> None:
        """Takes the current from the motor; what turns runs out.

        :raises MasterError: it refused or did not answer

        >>> drive.disable()
        """
        self.network._finish(self._begin("disable"))

    def stop(self) -> None:
        """Brings it to a stand with its own ramp; it stays enabled.

        :raises NotReached: it was not seen to stand

        >>> report = drive.velocity(60)
        >>> drive.stop()
        """
        self.network._finish(self._begin("stop"))

    def quick_stop(self) -> None:
        """Stops it as fast as it is set up to (605Ah), and leaves it as that option says.

        :raises NotReached: it was not seen to stand

        >>> drive.quick_stop()
        """
        self.network._finish(self._begin("quick_stop"))

    def reset_fault(self) -> None:
        """Resets a fault whose cause is gone.

        :raises NotReached: the fault stays, with its remedy

        >>> drive.reset_fault()
        """
        self.network._finish(self._begin("reset_fault"))

    def save(self) -> None:
        """Stores its parameters in the drive (1010h, or what its model has for that).

        :raises MasterError: its model has no store or is guessed, or it refused

        >>> drive.save()
        """
        self.network._finish(self._begin("save"))

    def restore(self) -> None:
        """Has the drive take its factory values from the next start on (1011h). What was set is lost.

        :raises MasterError: its model has no such command or is guessed, or it refused

        >>> drive.restore()
        """
        self.network._finish(self._begin("restore"))

    def check_identity(self) -> None:
        """Checks that the drive is of the model that it is taken for (1018h).

        :raises MasterError: it is another one

        >>> drive.check_identity()
        """
        self.network._finish(self._begin("check_identity"))

    def guard(self) -> str:
        """Has the drive stop by itself when this program dies, where its model has something for that; returns what it does then, in words.

        :raises MasterError: it refused or did not answer

        >>> drive.guard().startswith("it stops")
        True
        """
        loss: str = self.network._finish(self._begin("guard"))
        return loss

    def release_guard(self) -> None:
        """Takes that back.

        :raises MasterError: it refused or did not answer

        >>> drive.release_guard()
        """
        self.network._finish(self._begin("release_guard"))

    def state(self) -> DriveState:
        """What the drive says of itself. What its model does not have is None.

        :raises MasterError: it does not answer

        >>> drive.state()["power"]
        'Switch on disabled'
        """
        state: DriveState = self.network._finish(self._begin("state"))
        return state

    def velocity(
        self,
        rpm: float,
        *,
        acceleration_rpm_s: Optional[float] = None,
        deceleration_rpm_s: Optional[float] = None,
        wait: bool = True,
    ) -> MotionReport:
        """Turns at this speed until another command comes (profile velocity); enables the drive first.

        :param rpm: speed of the output in r/min; below 0 the other way round
        :param acceleration_rpm_s: in (r/min)/s; None leaves it as the drive has it, ``deceleration_rpm_s`` the same
        :param wait: until the speed is reached
        :raises NotReached: the speed was not reached, with what was seen
        :raises BadRequest: the speed is beyond what the drive takes
        :raises MasterError: an open group or base of this network moves the drive (kind ``in_cycles``), as for all that moves it

        >>> drive.velocity(60, acceleration_rpm_s=600)["reached_after_s"] is not None
        True
        """
        options = {"acceleration_rpm_s": acceleration_rpm_s, "deceleration_rpm_s": deceleration_rpm_s, "wait": wait}
        report: MotionReport = self.network._finish(self._begin("velocity", value=rpm, **options))
        return report

    def move(
        self,
        degrees: Optional[float] = None,
        *,
        counts: Optional[int] = None,
        relative: bool = False,
        speed_rpm: Optional[float] = None,
        acceleration_rpm_s: Optional[float] = None,
        deceleration_rpm_s: Optional[float] = None,
        wait: bool = True,
    ) -> MotionReport:
        """Goes to a position (profile position); enables the drive first.

        :param degrees: of the output, or of the shaft that the drive counts where nothing stands behind it
        :param counts: instead of degrees, in the drive's counts
        :param relative: by this much from where it is
        :param speed_rpm: highest speed on the way in r/min; None leaves it as the drive has it
        :param acceleration_rpm_s: in (r/min)/s; None leaves it as the drive has it, ``deceleration_rpm_s`` the same
        :param wait: until the position is reached
        :raises NotReached: the position was not reached, with what was seen
        :raises BadRequest: the position is beyond what the drive takes
        :raises ValueError: both or neither of ``degrees`` and ``counts``

        >>> report = drive.move(90, relative=True, speed_rpm=30)
        >>> round(drive.state()["angle_deg"] or 0)
        90
        """
        ramps = {"acceleration_rpm_s": acceleration_rpm_s, "deceleration_rpm_s": deceleration_rpm_s}
        order = {**_angle(degrees, counts), **ramps, "relative": relative, "speed_rpm": speed_rpm, "wait": wait}
        report: MotionReport = self.network._finish(self._begin("move", **order))
        return report

    def torque(self, current_a: float) -> MotionReport:
        """Lets the motor push with this current until another command comes (profile torque); enables the drive first. Does not wait.

        :param current_a: in A; below 0 the other way round
        :raises BadRequest: the current is beyond what the drive takes
        :raises MasterError: its model has no profile torque (kind ``no_such_mode``)

        >>> drive.torque(0.5)["reached_after_s"] is None
        True
        """
        report: MotionReport = self.network._finish(self._begin("torque", value=current_a))
        return report

    def home(
        self,
        method: int,
        *,
        speed_rpm: Optional[float] = None,
        within: Optional[float] = None,
        wait: bool = True,
    ) -> MotionReport:
        """Finds its reference position (homing).

        :param method: of CiA 402-2 (6098h), -128 to 127
        :param speed_rpm: of the search, in r/min; refused by a drive without an object for it. None leaves it as the drive has it
        :param within: longest time in s; 60 without it
        :param wait: until it is done
        :raises NotReached: it was not done in this time
        :raises ValueError: the method is not such a number

        >>> drive.home(35)["reached_after_s"] is not None
        True
        """
        order = {"counts": method, "speed_rpm": speed_rpm, "limit_s": within, "wait": wait}
        report: MotionReport = self.network._finish(self._begin("home", **order))
        return report

    def capture(
        self,
        *quantities: str,
        duration: float = 1.0,
        period: float = 0.001,
        trigger: Optional[str] = None,
        pre_trigger: float = 0.0,
        take: Sequence[str] = (),
        sdo: bool = False,
        journal: Optional[Union[str, "os.PathLike[str]"]] = None,
    ) -> Capture:
        """Captures quantities while the drive does what it does: spare TPDOs are mapped to them, and put back as they were. What
        ``ferrodrive capture`` does.

        :param quantities: ``velocity``, ``target_velocity``, ``current``, ``position`` and others, or objects by name or number; in a ``World``
            also what is true of the drive: ``true_velocity``, ``true_shaft_angle`` and the other signals of records
        :param duration: in s, from the begin or the trigger
        :param period: time between two readings in s
        :param trigger: begins when a quantity passes a value: ``"velocity > 10"`` rising, ``"velocity < 10"`` falling
        :param pre_trigger: what is kept of before the trigger, in s
        :param take: TPDOs that are used although they are in use: ``["tpdo1"]``
        :param sdo: read by SDO what cannot come by TPDO
        :param journal: where the way back is kept meanwhile on a real bus; after a kill ``network.params(node).rollback()`` takes it
        :raises MasterError: it cannot be had, with what is possible; it was cut off, with what came as ``report``

        >>> capture = drive.capture("velocity", "current", duration=0.1, period=0.002)
        >>> len(capture["time_s"]) == len(capture["values"]["velocity_rpm"])
        True
        >>> round(capture["period_s"]["velocity_rpm"] or 0.0, 4)
        0.002
        """
        order = {"duration": duration, "period": period, "trigger": trigger, "pre_trigger": pre_trigger, "sdo": sdo}
        with _reported_as(captured):
            return captured(self.network._finish(self._capture(quantities, take, journal, **order)))

    def test_motion(
        self,
        shape: str,
        *quantities: str,
        by: float = 90.0,
        speed_rpm: float = 20.0,
        frequency: float = 1.0,
        to_frequency: float = 10.0,
        periods: int = 3,
        time: float = 0.5,
        path: Sequence[tuple[float, float]] = (),
        count: int = 1,
        velocity_rpm: float = 60.0,
        acceleration_rpm_s: Optional[float] = None,
        travel_turns: Optional[float] = None,
        following_error: float = 72.0,
        period: float = 0.005,
        capture_period: Optional[float] = None,
        sdo: bool = False,
        journal: Optional[Union[str, "os.PathLike[str]"]] = None,
    ) -> list[TestMotionRun]:
        """Moves it by a test motion, ``count`` times, each captured, with figures. Afterwards the drive is without power, and its PDOs
        are as they were. What ``ferrodrive test-motion`` does.

        :param shape: ``back-and-forth``, ``ramp``, ``sine``, ``chirp``, ``prbs``, ``path``, point by point within the limits; or ``steps`` of
            velocity by the drive's own ramps
        :param quantities: what is captured; without any velocity, its target and current
        :param by: distance or amplitude in degrees
        :param speed_rpm: of steps, ramp and prbs
        :param frequency: of sine, the first one of chirp, in Hz
        :param to_frequency: the last one of chirp, in Hz
        :param periods: of sine
        :param time: that steps and ramp keep their speed, of a bit of prbs, of all of chirp, in s
        :param path: times in s and degrees
        :param velocity_rpm: limit of the speed
        :param acceleration_rpm_s: limit of the acceleration in (r/min)/s; without it 600, and of steps the drive's own ramps
        :param travel_turns: farther points are refused, and steps are stopped there
        :param following_error: degrees from its set-point beyond which it is stopped
        :param period: of SYNC, in which points are sent, in s
        :param capture_period: time between two readings in s
        :param sdo: read by SDO what cannot come by TPDO
        :param journal: as of :meth:`capture`
        :raises MasterError: it was stopped, or cannot be captured, with the runs that were made as ``report``

        >>> runs = drive.test_motion("sine", "velocity", by=10, periods=1, count=2)
        >>> [run["run"] for run in runs]
        [1, 2]
        >>> (runs[0]["followed"] or {})["most_deg"] < 10
        True
        """
        motion = self._test_motion(
            shape, quantities, journal, by_deg=by, speed_rpm=speed_rpm, frequency_hz=frequency, to_frequency_hz=to_frequency,
            periods=periods, time=time, path=list(path), count=count, velocity_rpm=velocity_rpm, acceleration_rpm_s=acceleration_rpm_s,
            travel_turns=travel_turns, following_error_deg=following_error, period=period, capture_period=capture_period, sdo=sdo,
        )
        with _reported_as(_runs):
            return _runs(self.network._finish(motion))

    def tune(
        self,
        *,
        bandwidth: Optional[float] = None,
        phase_margin: float = 40.0,
        position: bool = False,
        speed_rpm: Optional[float] = None,
        current_a: Optional[float] = None,
        travel_turns: float = 40.0,
        period: Optional[float] = None,
        torque_constant: Optional[float] = None,
        apply: bool = False,
        journal: Optional[Union[str, "os.PathLike[str]"]] = None,
    ) -> Tuning:
        """Finds gains for its loops: it is measured, a twin of it is made, gains are proposed and tried on the twin, and then on the drive. The
        shaft turns to and fro. What ``ferrodrive tune`` does; of a stepper: :meth:`tune_ramps`.

        :param bandwidth: where the gain of the speed loop is to fall to one, in Hz; instead of a phase margin
        :param phase_margin: phase margin to keep, in degrees; as stiff as that allows
        :param position: the loop of position too
        :param speed_rpm: highest speed of the measurement, of the motor's shaft: 120 without it, of a joint 600, of a servo what ``loops`` of its machine file says
        :param current_a: the most that the speed loop may ask for: 15 without it, of a servo what ``loops`` says
        :param travel_turns: farthest that the shaft may turn from where it stands
        :param period: time between two samples in s: without it the shortest of 0.001, 0.002, 0.005 and 0.01 that drive, bus and program keep up with
        :param torque_constant: N m per A of another motor than the model's own
        :param apply: write the values to the drive and try them, with a step and a slow speed, with a position loop a move too; it has its former ones back where they are not better
        :param journal: as of :meth:`capture`
        :raises MasterError: it was stopped, what is not possible with this drive, or that not everything could be put back

        >>> try:
        ...     drive.tune()
        ... except ferrodrive.MasterError as error:
        ...     error.kind
        'no_gains'
        """
        tuning = self._tune(
            journal, bandwidth_hz=bandwidth, phase_margin_deg=phase_margin, position=position, speed_rpm=speed_rpm, current_a=current_a,
            travel_turns=travel_turns, period=period, torque_constant_nm_a=torque_constant, apply=apply,
        )
        report: Tuning = self.network._finish(tuning)
        return report

    def tune_ramps(
        self,
        *,
        speed_rpm: float = 600.0,
        inertia_kg_m2: float = 0.0,
        friction_nm: float = 0.0,
        load_nm: float = 0.0,
        margin: float = 1.5,
        ramp: Optional[float] = None,
        apply: bool = False,
        journal: Optional[Union[str, "os.PathLike[str]"]] = None,
    ) -> RampTuning:
        """Current, microsteps and ramps with which a stepper without an encoder loses no step with a load: computed, and tried on its twin. It
        is not turned. What ``ferrodrive tune`` does with a stepper.

        :param speed_rpm: speed that is to be reached
        :param inertia_kg_m2: inertia of what it turns, without its rotor
        :param friction_nm: dry friction of that
        :param load_nm: what pushes its shaft in one direction, such as a weight
        :param margin: how many times the torque that is needed there is to be
        :param ramp: time in s in which the speed is to be reached: the shortest that keeps the margin without it
        :param apply: write the values to the drive as a transaction; they are not stored
        :param journal: as of :meth:`capture`
        :raises MasterError: no ramp keeps the margin, with the speed that would; or it is not such a stepper

        >>> try:
        ...     drive.tune_ramps(inertia_kg_m2=3e-5)
        ... except ferrodrive.MasterError as error:
        ...     "its model is not a stepper" in str(error)
        True
        """
        tuning = self._tune_ramps(
            journal, speed_rpm=speed_rpm, inertia_kg_m2=inertia_kg_m2, friction_nm=friction_nm, load_nm=load_nm, margin=margin,
            ramp=ramp, apply=apply,
        )
        report: RampTuning = self.network._finish(tuning)
        return report


class AsyncDrive(_Orders):
    """:class:`Drive` with coroutines, for several drives at the same time. From :meth:`Network.async_drive`. On a virtual bus the loop runs
    inside ``with ferrodrive.virtual_time(world)``.

    >>> async def main() -> None:
    ...     servo = network.async_drive(5, "cia402")
    ...     await servo.velocity(60)
    ...     await servo.stop()
    >>> with ferrodrive.virtual_time(world):
    ...     asyncio.run(main())
    """

    async def enable(self) -> None:
        """As :meth:`Drive.enable`."""
        await self.network._finish_soon(self._begin("enable"))

    async def disable(self) -> None:
        """As :meth:`Drive.disable`."""
        await self.network._finish_soon(self._begin("disable"))

    async def stop(self) -> None:
        """As :meth:`Drive.stop`."""
        await self.network._finish_soon(self._begin("stop"))

    async def quick_stop(self) -> None:
        """As :meth:`Drive.quick_stop`."""
        await self.network._finish_soon(self._begin("quick_stop"))

    async def reset_fault(self) -> None:
        """As :meth:`Drive.reset_fault`."""
        await self.network._finish_soon(self._begin("reset_fault"))

    async def save(self) -> None:
        """As :meth:`Drive.save`."""
        await self.network._finish_soon(self._begin("save"))

    async def restore(self) -> None:
        """As :meth:`Drive.restore`."""
        await self.network._finish_soon(self._begin("restore"))

    async def check_identity(self) -> None:
        """As :meth:`Drive.check_identity`."""
        await self.network._finish_soon(self._begin("check_identity"))

    async def guard(self) -> str:
        """As :meth:`Drive.guard`."""
        loss: str = await self.network._finish_soon(self._begin("guard"))
        return loss

    async def release_guard(self) -> None:
        """As :meth:`Drive.release_guard`."""
        await self.network._finish_soon(self._begin("release_guard"))

    async def state(self) -> DriveState:
        """As :meth:`Drive.state`."""
        state: DriveState = await self.network._finish_soon(self._begin("state"))
        return state

    async def velocity(
        self,
        rpm: float,
        *,
        acceleration_rpm_s: Optional[float] = None,
        deceleration_rpm_s: Optional[float] = None,
        wait: bool = True,
    ) -> MotionReport:
        """As :meth:`Drive.velocity`."""
        options = {"acceleration_rpm_s": acceleration_rpm_s, "deceleration_rpm_s": deceleration_rpm_s, "wait": wait}
        report: MotionReport = await self.network._finish_soon(self._begin("velocity", value=rpm, **options))
        return report

    async def move(
        self,
        degrees: Optional[float] = None,
        *,
        counts: Optional[int] = None,
        relative: bool = False,
        speed_rpm: Optional[float] = None,
        acceleration_rpm_s: Optional[float] = None,
        deceleration_rpm_s: Optional[float] = None,
        wait: bool = True,
    ) -> MotionReport:
        """As :meth:`Drive.move`."""
        ramps = {"acceleration_rpm_s": acceleration_rpm_s, "deceleration_rpm_s": deceleration_rpm_s}
        order = {**_angle(degrees, counts), **ramps, "relative": relative, "speed_rpm": speed_rpm, "wait": wait}
        report: MotionReport = await self.network._finish_soon(self._begin("move", **order))
        return report

    async def torque(self, current_a: float) -> MotionReport:
        """As :meth:`Drive.torque`."""
        report: MotionReport = await self.network._finish_soon(self._begin("torque", value=current_a))
        return report

    async def home(
        self,
        method: int,
        *,
        speed_rpm: Optional[float] = None,
        within: Optional[float] = None,
        wait: bool = True,
    ) -> MotionReport:
        """As :meth:`Drive.home`."""
        order = {"counts": method, "speed_rpm": speed_rpm, "limit_s": within, "wait": wait}
        report: MotionReport = await self.network._finish_soon(self._begin("home", **order))
        return report

    async def capture(
        self,
        *quantities: str,
        duration: float = 1.0,
        period: float = 0.001,
        trigger: Optional[str] = None,
        pre_trigger: float = 0.0,
        take: Sequence[str] = (),
        sdo: bool = False,
        journal: Optional[Union[str, "os.PathLike[str]"]] = None,
    ) -> Capture:
        """As :meth:`Drive.capture`."""
        order = {"duration": duration, "period": period, "trigger": trigger, "pre_trigger": pre_trigger, "sdo": sdo}
        with _reported_as(captured):
            return captured(await self.network._finish_soon(self._capture(quantities, take, journal, **order)))

    async def test_motion(
        self,
        shape: str,
        *quantities: str,
        by: float = 90.0,
        speed_rpm: float = 20.0,
        frequency: float = 1.0,
        to_frequency: float = 10.0,
        periods: int = 3,
        time: float = 0.5,
        path: Sequence[tuple[float, float]] = (),
        count: int = 1,
        velocity_rpm: float = 60.0,
        acceleration_rpm_s: Optional[float] = None,
        travel_turns: Optional[float] = None,
        following_error: float = 72.0,
        period: float = 0.005,
        capture_period: Optional[float] = None,
        sdo: bool = False,
        journal: Optional[Union[str, "os.PathLike[str]"]] = None,
    ) -> list[TestMotionRun]:
        """As :meth:`Drive.test_motion`."""
        motion = self._test_motion(
            shape, quantities, journal, by_deg=by, speed_rpm=speed_rpm, frequency_hz=frequency, to_frequency_hz=to_frequency,
            periods=periods, time=time, path=list(path), count=count, velocity_rpm=velocity_rpm, acceleration_rpm_s=acceleration_rpm_s,
            travel_turns=travel_turns, following_error_deg=following_error, period=period, capture_period=capture_period, sdo=sdo,
        )
        with _reported_as(_runs):
            return _runs(await self.network._finish_soon(motion))

    async def tune(
        self,
        *,
        bandwidth: Optional[float] = None,
        phase_margin: float = 40.0,
        position: bool = False,
        speed_rpm: Optional[float] = None,
        current_a: Optional[float] = None,
        travel_turns: float = 40.0,
        period: Optional[float] = None,
        torque_constant: Optional[float] = None,
        apply: bool = False,
        journal: Optional[Union[str, "os.PathLike[str]"]] = None,
    ) -> Tuning:
        """As :meth:`Drive.tune`."""
        tuning = self._tune(
            journal, bandwidth_hz=bandwidth, phase_margin_deg=phase_margin, position=position, speed_rpm=speed_rpm, current_a=current_a,
            travel_turns=travel_turns, period=period, torque_constant_nm_a=torque_constant, apply=apply,
        )
        report: Tuning = await self.network._finish_soon(tuning)
        return report

    async def tune_ramps(
        self,
        *,
        speed_rpm: float = 600.0,
        inertia_kg_m2: float = 0.0,
        friction_nm: float = 0.0,
        load_nm: float = 0.0,
        margin: float = 1.5,
        ramp: Optional[float] = None,
        apply: bool = False,
        journal: Optional[Union[str, "os.PathLike[str]"]] = None,
    ) -> RampTuning:
        """As :meth:`Drive.tune_ramps`."""
        tuning = self._tune_ramps(
            journal, speed_rpm=speed_rpm, inertia_kg_m2=inertia_kg_m2, friction_nm=friction_nm, load_nm=load_nm, margin=margin,
            ramp=ramp, apply=apply,
        )
        report: RampTuning = await self.network._finish_soon(tuning)
        return report
