"""A drive of a world, as a person beside the machine has it: what can be measured, and what can be done to it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Optional, TypedDict, Union, cast

from .words import Number, number, word

if TYPE_CHECKING:
    from .world import World


class _Measured(TypedDict):
    """What a drive reports, as far as it has a property."""

    node_id: int
    powered: bool
    statusword: Optional[int]
    error_code: int
    position: int
    rotor_position: Optional[int]
    position_demand: Optional[int]
    velocity_rpm: float
    velocity_demand_rpm: Optional[float]
    current_a: float
    current_demand_a: Optional[float]
    supply_v: float
    motor_c: Optional[float]
    driver_c: Optional[float]
    outputs: dict[str, bool]
    analogue: dict[str, int]
    brake: Optional[str]
    output_shaft: Optional[dict[str, float]]
    damage: Optional[str]
    shaft_angle_rad: float
    bus: str


class VirtualDrive:
    """One drive of a :class:`~ferrodrive.World`, or one axis of it.

    Its properties are the truth about the machine at this moment, whatever its firmware says over the bus. Its methods are what
    the outer world does to it, each one of the world commands of ``ferrodrive sim``. A method that the drive does not take raises
    :class:`~ferrodrive.Refused` and changes nothing.

    >>> servo = world[5]
    >>> servo.set_load_torque(0.5)
    >>> abs(servo.velocity_rpm) < 1
    True
    """

    def __init__(self, world: World, node: int, axis: int = 1) -> None:
        self._world = world
        self._node = node
        self._axis = axis
        self._place = str(node) if axis == 1 else f"{node}.{axis}"

    def __repr__(self) -> str:
        return f"<{self.model} at {self._place}>"

    @property
    def world(self) -> World:
        """The world it is in."""
        return self._world

    @property
    def node(self) -> int:
        """The number under which it was added, 1 to 127, whatever its node-ID became."""
        return self._node

    @property
    def model(self) -> str:
        """Its model, as in ``zlac8030l``."""
        return self._world.model_of(self._node)

    @property
    def inputs(self) -> list[str]:
        """Names of its digital inputs."""
        return self._world.inputs_of(self._node)

    @property
    def axes(self) -> int:
        """How many motors its one node moves."""
        return self._world.axes_of(self._node)

    def axis(self, number: int) -> VirtualDrive:
        """Another axis of the same drive, counted from 1.

        :raises ValueError: the drive has no such axis

        >>> world[5].axis(1)
        <cia402 at 5>
        """
        if not 1 <= number <= self.axes:
            raise ValueError(f"a {self.model} has no axis {number}; it has {self.axes}")
        return VirtualDrive(self._world, self._node, number)

    # What can be measured.

    def report(self) -> dict[str, Any]:
        """Everything below at once, by the names of the properties.

        >>> world[5].report()["bus"]
        'error-active'
        """
        return self._world.report(self._place)

    def _measured(self) -> _Measured:
        return cast(_Measured, self.report())

    @property
    def node_id(self) -> int:
        """The node-ID that it uses at present."""
        return self._measured()["node_id"]

    @property
    def powered(self) -> bool:
        """True while its supply is switched on."""
        return self._measured()["powered"]

    @property
    def statusword(self) -> Optional[int]:
        """Statusword (6041h); None without power."""
        return self._measured()["statusword"]

    @property
    def error_code(self) -> int:
        """Code of the present fault in the drive's own numbering; 0 for none."""
        return self._measured()["error_code"]

    @property
    def position(self) -> int:
        """Actual position in the drive's own counts."""
        return self._measured()["position"]

    @property
    def rotor_position(self) -> Optional[int]:
        """Where the rotor truly is in the drive's counts, of a drive that does not measure it."""
        return self._measured()["rotor_position"]

    @property
    def position_demand(self) -> Optional[int]:
        """Position demand in the drive's counts, where a mode has one."""
        return self._measured()["position_demand"]

    @property
    def velocity_rpm(self) -> float:
        """True speed of the motor shaft in r/min."""
        return self._measured()["velocity_rpm"]

    @property
    def velocity_demand_rpm(self) -> Optional[float]:
        """Velocity demand at the motor shaft in r/min, where a mode has one."""
        return self._measured()["velocity_demand_rpm"]

    @property
    def current_a(self) -> float:
        """Signed motor current in A."""
        return self._measured()["current_a"]

    @property
    def current_demand_a(self) -> Optional[float]:
        """Current demand in A, where a mode has one."""
        return self._measured()["current_demand_a"]

    @property
    def supply_v(self) -> float:
        """Voltage at the supply terminals in V."""
        return self._measured()["supply_v"]

    @property
    def motor_c(self) -> Optional[float]:
        """Temperature of the motor in °C, where it has a sensor."""
        return self._measured()["motor_c"]

    @property
    def driver_c(self) -> Optional[float]:
        """Temperature of the power stage in °C, where it has a sensor."""
        return self._measured()["driver_c"]

    @property
    def outputs(self) -> dict[str, bool]:
        """Levels of the digital outputs by name."""
        return self._measured()["outputs"]

    @property
    def analogue(self) -> dict[str, int]:
        """Values of the analogue channels of a device by CiA 401, by their objects: ``{"6401:01": 12000, "6411:01": 0}``."""
        return self._measured()["analogue"]

    @property
    def brake(self) -> Optional[str]:
        """``released`` or ``engaged``; None where there is no holding brake."""
        return self._measured()["brake"]

    @property
    def output_shaft(self) -> Optional[dict[str, float]]:
        """The shaft behind a reducer, where there is one: ``angle_rad``, ``torque_nm``, ``most_nm`` (the most there has been),
        ``overloads`` and ``jumps`` (how often), ``slip_rad``."""
        return self._measured()["output_shaft"]

    @property
    def damage(self) -> Optional[str]:
        """What has been destroyed and what to do about it; None if nothing."""
        return self._measured()["damage"]

    @property
    def shaft_angle_rad(self) -> float:
        """True angle of the motor shaft in rad, many turns. Where it begins is the machine's own: compare with an earlier one."""
        return self._measured()["shaft_angle_rad"]

    @property
    def bus(self) -> str:
        """``error-active``, ``error-passive``, ``bus-off``, ``cut`` or ``off`` (no power)."""
        return self._measured()["bus"]

    # What the outer world can do.

    def apply(self, words: str) -> None:
        """Does what a world command says, without the node: ``apply("load torque 2.5")``.

        :raises Refused: the command is not one, or the drive does not take it; nothing has changed

        >>> world[5].apply("load torque 2.5")
        """
        self._world.apply(f"{self._place} {words}")

    def _do(self, name: str, *values: Any) -> None:
        self._world.stimulate(self._place, name, *values)

    def power_on(self) -> None:
        """Switches the supply on (``power on``): the firmware boots.

        >>> world[5].power_on()
        """
        self._do("power", "on")

    def power_off(self) -> None:
        """Switches the supply off (``power off``): the drive lives on until its bus has drained.

        >>> world[5].power_off()
        >>> world.run_for(5)
        >>> world[5].statusword is None
        True
        """
        self._do("power", "off")

    def power_cycle(self) -> None:
        """Switches off, and on again when the drive has died of it (``power cycle``).

        >>> world[5].power_cycle()
        """
        self._do("power", "cycle")

    def power_cut(self) -> None:
        """The drive is dead at once, in the middle of whatever it does (``power cut``). A motor that turns coasts.

        >>> world[5].power_cut()
        >>> world[5].statusword is None
        True
        """
        self._do("power", "cut")

    def set_input(self, name: str, level: bool) -> None:
        """Level of a digital input (``input X0 1``). Removes a switch that is bound to it.

        >>> wheel.set_input(wheel.inputs[0], True)
        """
        self._do("input", word(name), bool(level))

    def set_switch(self, name: str, low: Optional[int] = None, high: Optional[int] = None) -> None:
        """Ties an input to the position (``switch X0 -5000 max``): active from ``low`` to ``high``, in the drive's counts; None
        reaches for ever. The range is fixed in the machine from then on.

        >>> wheel.set_switch(wheel.inputs[0], low=-5000)
        """
        self._do("switch", word(name), whole(low), whole(high))

    def set_load_torque(self, torque_nm: Number) -> None:
        """Torque at the output shaft in N·m (``load torque 2.5``); positive opposes positive motion, also at standstill.

        >>> world[5].set_load_torque(2.5)
        """
        self._do("load_torque", number("torque_nm", torque_nm))

    def set_load_inertia(self, inertia_kg_m2: Number) -> None:
        """Inertia added at the output shaft in kg·m² (``load inertia 0.02``).

        >>> world[5].set_load_inertia(0.02)
        """
        self._do("load_inertia", number("inertia_kg_m2", inertia_kg_m2))

    def set_load_friction(
        self,
        coulomb_nm: Optional[Number],
        viscous_nm_s: Number = 0,
        static_nm: Optional[Number] = None,
        stribeck_rad_s: Optional[Number] = None,
    ) -> None:
        """Friction beside the motor's own, at the output shaft (``load friction 0.2 viscous 0.01 static 0.3 stribeck 0.5``): dry in
        N·m, growing with the speed in N·m·s/rad, breaking loose in N·m, and the speed in rad/s from which on it is as in motion.
        None takes it away (``load friction off``).

        >>> world[5].set_load_friction(0.2, viscous_nm_s=0.01)
        >>> world[5].set_load_friction(None)
        """
        if coulomb_nm is None:
            self._do("load_off", "friction")
        else:
            sliding = number("coulomb_nm", coulomb_nm), number("viscous_nm_s", viscous_nm_s)
            self._do("load_friction", *sliding, real("static_nm", static_nm), real("stribeck_rad_s", stribeck_rad_s))

    def set_load_pulley(self, mass_kg: Optional[Number], radius_m: Number = 0.05) -> None:
        """A weight in kg on a drum of this radius in m, lifted by positive motion, lowered with a negative radius
        (``load pulley 2 0.05``); None takes it away (``load pulley off``).

        >>> world[5].set_load_pulley(2, radius_m=0.05)
        """
        if mass_kg is None:
            self._do("load_off", "pulley")
        else:
            self._do("load_pulley", number("mass_kg", mass_kg), number("radius_m", radius_m))

    def set_load_spring(self, stiffness_nm_rad: Optional[Number], rest_deg: Number = 0) -> None:
        """A spring in N·m/rad, at rest so many degrees from where the shaft is now (``load spring 5 90``); None takes it away
        (``load spring off``).

        >>> world[5].set_load_spring(5, rest_deg=90)
        """
        if stiffness_nm_rad is None:
            self._do("load_off", "spring")
        else:
            self._do("load_spring", number("stiffness_nm_rad", stiffness_nm_rad), number("rest_deg", rest_deg))

    def set_load_stop(self, low: Optional[int], high: Optional[int]) -> None:
        """End stops at these actual positions in the drive's counts (``load stop -5000 max``); None leaves that side open, and
        two of them take both away (``load stop off``).

        >>> position = world[5].position
        >>> world[5].set_load_stop(position - 5000, None)
        """
        if low is None and high is None:
            self._do("load_off", "stop")
        else:
            self._do("load_stop", whole(low), whole(high))

    def set_load_fan(self, torque_nm: Optional[Number], speed_rpm: Number = 1000) -> None:
        """A fan that takes this torque in N·m at this speed in r/min (``load fan 2 300``); None takes it away (``load fan off``).

        >>> world[5].set_load_fan(2, speed_rpm=300)
        """
        if torque_nm is None:
            self._do("load_off", "fan")
        else:
            self._do("load_fan", number("torque_nm", torque_nm), number("speed_rpm", speed_rpm))

    def set_load_gear(self, ratio: Optional[Number], backlash_deg: Number = 0) -> None:
        """All of these hang behind a gear of this ratio with so many degrees of backlash (``load gear 10 0.5``); None takes it away
        (``load gear off``).

        >>> world[5].set_load_gear(10, backlash_deg=0.5)
        """
        if ratio is None:
            self._do("load_off", "gear")
        else:
            self._do("load_gear", number("ratio", ratio), number("backlash_deg", backlash_deg))

    def clear_loads(self) -> None:
        """Takes all loads away (``load none``).

        >>> world[5].clear_loads()
        """
        self._do("load_none")

    def lock_rotor(self) -> None:
        """Holds the rotor (``rotor lock``).

        >>> world[5].lock_rotor()
        """
        self._do("rotor_lock", True)

    def free_rotor(self) -> None:
        """Lets the rotor go (``rotor free``).

        >>> world[5].free_rotor()
        """
        self._do("rotor_lock", False)

    def set_supply(
        self,
        voltage_v: Optional[Number] = None,
        limit_a: Optional[Number] = None,
        resistance_ohm: Optional[Number] = None,
    ) -> None:
        """The supply (``supply 48 limit 10 resistance 0.2``): open-circuit voltage in V, the most that it gives in A, resistance
        of source and wires in ohm. None leaves that as it is. A source that is turned down takes the bus with it at once; with a limit
        of 0 A it is open, and the bus lives on its capacitors: a dip or an interruption of some milliseconds.

        >>> world[5].set_supply(36, limit_a=10)
        """
        self._do("supply", real("voltage_v", voltage_v), real("limit_a", limit_a), real("resistance_ohm", resistance_ohm))

    def hold_temperature(self, sensor: str, celsius: Optional[Number]) -> None:
        """Holds a temperature in °C (``temperature motor 95``), or gives it back to the model with None. The sensor is ``motor``
        or ``driver``.

        >>> world[5].hold_temperature("motor", 95)
        """
        self._do("temperature", word(sensor), real("celsius", celsius))

    def set_fault(self, component: str, broken: bool = True) -> None:
        """Breaks or mends a component (``fault hall on``): ``hall``, ``encoder``, ``eeprom``, ``reference``, ``phase``, ``short``,
        ``bridge`` or ``bleeder``.

        >>> wheel.set_fault("hall")
        """
        self._do("fault", word(component), bool(broken))

    def set_battery(self, connected: bool) -> None:
        """The multi-turn battery of a joint (``battery off``).

        >>> joint.set_battery(False)
        """
        self._do("battery", bool(connected))

    def send_pulses(self, count: int, hz: Number) -> None:
        """Pulses with a direction at the pulse inputs (``pulses 8192 10000``): how many, negative with the direction input
        conducting, and how many a second.

        >>> joint.send_pulses(8192, hz=10_000)
        """
        self._do("pulses", int(count), number("hz", hz))

    def send_quadrature(self, count: int, hz: Number) -> None:
        """Two channels of an encoder (``quadrature -400 1000``): counts, four a line, negative with the second channel ahead, and
        counts a second.

        >>> joint.send_quadrature(-400, hz=1000)
        """
        self._do("quadrature", int(count), number("hz", hz))

    def send_duty(self, percent: Number) -> None:
        """A square wave of this duty cycle in per cent (``duty 40``), for ever.

        >>> joint.send_duty(40)
        """
        self._do("duty", number("percent", percent))

    def send_clock(self, hz: Number) -> None:
        """A level on the second input that changes so many times a second (``clock 10000``), for ever.

        >>> joint.send_clock(10_000)
        """
        self._do("clock", number("hz", hz))

    def cut_cable(self) -> None:
        """Cuts its bus cable (``cable cut``). It goes on alone.

        >>> world[5].cut_cable()
        >>> world[5].bus
        'cut'
        """
        self._do("cable_cut", True)

    def join_cable(self) -> None:
        """Joins its bus cable (``cable join``).

        >>> world[5].join_cable()
        """
        self._do("cable_cut", False)

    def set_bus_silent(self, silent: bool) -> None:
        """It listens to the bus only (``bus silent on``).

        >>> world[5].set_bus_silent(True)
        """
        self._do("bus_silent", bool(silent))

    def set_bus_late(self, min_ms: Optional[Number], max_ms: Optional[Number] = None) -> None:
        """Its frames reach the bus so many ms late (``bus late 5 20``); None ends it (``bus late off``).

        >>> world[5].set_bus_late(5, 20)
        """
        if min_ms is None:
            self._do("bus_late")
        else:
            self._do("bus_late", number("min_ms", min_ms), number("max_ms", min_ms if max_ms is None else max_ms))

    def set_bus_babble(self, frame: Optional[str], gap_ms: Number = 1) -> None:
        """It sends this frame again so many ms after it went out, for ever (``bus babble 080# 1``); None ends it
        (``bus babble off``).

        >>> world[5].set_bus_babble("080#", gap_ms=1)
        """
        if frame is None:
            self._do("bus_babble")
        else:
            self._do("bus_babble", word(frame), number("gap_ms", gap_ms))

    def set_bus_overrun(self, frames: Optional[int], service_ms: Number = 1) -> None:
        """It holds so many frames and takes so many ms for each; what comes faster is lost (``bus overrun 2 0.5``); None ends it
        (``bus overrun off``).

        >>> world[5].set_bus_overrun(2, service_ms=0.5)
        """
        if frames is None:
            self._do("bus_overrun")
        else:
            self._do("bus_overrun", int(frames), number("service_ms", service_ms))

    def set_bus_corruption(self, probability: Optional[Number]) -> None:
        """Each attempt to send a frame fails with this probability, 0 to 1 (``bus corrupt 0.3``), as with a bad plug at this node;
        None ends it (``bus corrupt off``).

        >>> world[5].set_bus_corruption(0.3)
        """
        self._do("bus_corrupt", 0.0 if probability is None else number("probability", probability))

    def set_object(self, index: int, sub_index: int, value: Union[int, float, str]) -> None:
        """Value of an object of a node whose objects are the outer world's (``set 6000:01 FFh``): what its sensor measured.

        >>> sensor.set_object(0x6000, 1, 0xFF)
        """
        self._do("object", index, sub_index, value if isinstance(value, (float, str)) else int(value))

    def send_mpdo(self, node: Optional[int], index: int, sub_index: int, value: int) -> None:
        """The application of such a node writes to an object of another node, or of all (None), by a multiplexed PDO in destination
        address mode (``mpdo 7 6200:01 FFh``); FFh in sub-index 00h of its TPDO's mapping makes one (CiA 301, 7.2.3).

        >>> sensor.send_mpdo(7, 0x6200, 1, 0xFF)
        """
        self._do("mpdo", 0 if node is None else int(node), index, sub_index, int(value))


def real(name: str, value: Optional[Number]) -> Optional[float]:
    """The number, if there is one."""
    return None if value is None else number(name, value)


def whole(value: Optional[int]) -> Optional[int]:
    """The whole number, if there is one."""
    return None if value is None else int(value)
