//! One axis: its objects, who may move it, its loops, and what it reports.
//!
//! [`sense`](Shaft::sense) and [`actuate`](Shaft::actuate) run every control period, [`supervise`](Shaft::supervise) every
//! supervision period.

mod commands;
mod cyclic;
mod publish;
mod targets;

use canopen::od::{Dictionary, Storage, Table};
use cia402::{Dwell, ModeOfOperation, PowerState, StopRamp, SupportedModes};
use devices::AxisDescription;
use devices::servo::faults::row;

pub(super) use commands::Written;
use cyclic::CyclicSetPoints;

use super::faults::{Faults, no_faults};
use super::hardware::{AxisActuation, AxisSensors, PowerStage};
use super::motor::{CONTROL_PERIOD_NS, Motor, SUPERVISION_DIVIDER, SUPERVISION_PERIOD_S};
use super::named_gains::NamedGains;
use super::parameters::Parameters;
use super::read;
use super::slots::AxisSlots;
use super::touch_probes::TouchProbes;
use crate::Fidelity;
use crate::engine::actuator::overload::{Overload, OverloadLimits};
use crate::engine::actuator::servo::{CurrentGains, Servo, ServoGains, ServoLimits, ServoModel};
use crate::engine::axis::{Demand, Feedback, StopState, Switches};
use crate::engine::cia402::{self as power, PowerDrive, Targets};
use crate::engine::faults::{FaultSet, exceeds, exceeds_with_hysteresis};

/// How long a motor may carry how much more than its rated current. Assumed: the usual class of servo drives.
const OVERLOAD_FROM: f32 = 1.15;
const OVERLOAD_CURVE: [(f32, f32); 3] = [(1.15, 60.0), (2.0, 10.0), (3.0, 3.0)];
/// Currents beyond this multiple of the power stage's own limit are not an overload but a short circuit.
const OVER_CURRENT: f32 = 1.5;
/// Assumed: a winding of thermal class B with some reserve.
const MOTOR_LIMIT_C: f32 = 120.0;
const TEMPERATURE_HYSTERESIS_C: f32 = 10.0;
/// Encoder and commutation tracks may disagree by this many electrical turns.
const DISAGREEMENT_TURNS: f32 = 0.2;
/// A shaft slower than this share of its highest speed stands, for the engine's stops.
const STANDING_SHARE: f32 = 0.001;
const SUPERVISION_MS: f64 = (CONTROL_PERIOD_NS * SUPERVISION_DIVIDER as u64) as f64 / 1e6;

/// Shares of the rated bus voltage up to which a stop on the voltage limit brakes fully, and from which on it does not: between the
/// braking resistor's 1.30 and the over-voltage of 1.40 (`protection.rs`).
const BRAKING_VOLTAGE: [f32; 2] = [1.31, 1.37];

/// What a target position of profile position was held back by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum TargetHold {
    None,
    /// A software limit: the motion ends there, which counts as the target.
    Limit,
    /// The counter cannot show it: the motion ends short of it, and the target is not reached.
    Counter,
}

/// The share of its current with which a stop on the voltage limit brakes, at this share of the rated bus voltage: less and less
/// beyond what the braking resistor holds, so that what is fed back does not become an over-voltage.
fn braking_share(voltage: f32) -> f32 {
    let [full, none] = BRAKING_VOLTAGE;
    ((none - voltage) / (none - full)).clamp(0.0, 1.0)
}

/// The loops as these values have them, or as they are for the motor.
fn gains_of(
    named: Option<&NamedGains>,
    values: &Dictionary<impl Storage>,
    motor: &Motor,
    fidelity: Fidelity,
) -> ServoGains {
    named.map_or_else(|| motor.gains(fidelity), |named| named.gains(values, motor, fidelity))
}

/// One axis of the drive.
#[derive(Clone)]
pub(super) struct Shaft {
    slots: AxisSlots,
    /// What 6060h accepts.
    modes: SupportedModes,
    motor: Motor,
    model: ServoModel,
    gains: ServoGains,
    /// Where the gains are, where that is known.
    named: Option<NamedGains>,
    parameters: Parameters,
    parameters_changed: bool,
    power: PowerDrive,
    servo: Servo,
    /// The sensors have been looked at since the restart.
    awake: bool,
    demand: Demand,
    targets: Targets,
    /// What is added to the counts since power-on to give the position.
    position_offset: i32,
    /// The position with the rounds of its counter: the lowest 32 bits are the position.
    whole_position: i64,
    /// Where the index pulse came since the last supervision.
    index: Option<i32>,
    set_points: CyclicSetPoints,
    /// Its own faults; those of the drive are the drive's.
    faults: Faults,
    /// How the connection to the host is lost, of what 6007h makes a fault.
    lost: FaultSet,
    overload: Overload,
    reached: Dwell,
    standing: Dwell,
    outside: Dwell,
    /// The following error has been outside its window for its time.
    following_error: bool,
    /// A limit holds a target back.
    limited: bool,
    /// A software limit holds a velocity back: it goes before the jerk.
    travel_holds: bool,
    target_hold: TargetHold,
    probes: TouchProbes,
    /// Where the motor is commutated in cstca, electrical turns.
    commutation_angle: Option<f32>,
}

impl Shaft {
    /// Motor free, position 0, and these values in effect.
    pub(super) fn new(
        description: &AxisDescription,
        table: &'static Table,
        motor: Motor,
        fidelity: Fidelity,
        values: &Dictionary<impl Storage>,
    ) -> Self {
        let slots = AxisSlots::of(table, description.placement);
        let parameters = Parameters::of(values, &slots, &motor, ModeOfOperation::NONE);
        let model = motor.model(fidelity);
        let named = description.loops.as_ref().and_then(|loops| NamedGains::of(loops, table));
        let declared = SupportedModes(read(values, slots.supported_modes, 0) as u32);
        let described = description.modes.iter().fold(SupportedModes::default(), |modes, mode| modes.with(*mode));
        Self {
            slots,
            modes: if slots.supported_modes.is_some() { declared } else { described },
            motor,
            model,
            gains: gains_of(named.as_ref(), values, &motor, fidelity),
            named,
            parameters,
            parameters_changed: false,
            power: PowerDrive::new(&[]),
            servo: Servo::new(&model, 0, 0),
            awake: false,
            demand: Demand::Off,
            targets: Targets::default(),
            position_offset: 0,
            whole_position: 0,
            index: None,
            set_points: CyclicSetPoints::none(),
            faults: no_faults(),
            lost: FaultSet::NONE,
            overload: Overload::default(),
            reached: Dwell::default(),
            standing: Dwell::default(),
            outside: Dwell::default(),
            following_error: false,
            limited: false,
            travel_holds: false,
            target_hold: TargetHold::None,
            probes: TouchProbes::default(),
            commutation_angle: None,
        }
    }

    pub(super) const fn slots(&self) -> &AxisSlots {
        &self.slots
    }

    pub(super) const fn power(&self) -> &PowerDrive {
        &self.power
    }

    pub(super) const fn parameters(&self) -> &Parameters {
        &self.parameters
    }

    pub(super) const fn faults(&self) -> &Faults {
        &self.faults
    }

    pub(super) const fn faults_mut(&mut self) -> &mut Faults {
        &mut self.faults
    }

    pub(super) fn current_gains(&self) -> CurrentGains {
        CurrentGains::of(&self.gains.foc, &self.model)
    }

    pub(super) const fn demand(&self) -> &Demand {
        &self.demand
    }

    /// Position in increments.
    pub(super) fn position(&self) -> i32 {
        self.position_offset.wrapping_add(self.servo.position(&self.model))
    }

    /// A position near the present one (increments) in user units, as 6064h shows it.
    pub(super) fn shown(&self, increments: i32) -> i64 {
        let Parameters { scales, range, .. } = &self.parameters;
        match range {
            Some(range) => range.shown(scales.whole_position(self.whole(increments))),
            None => scales.position(increments),
        }
    }

    /// A position near the present one with the rounds of its counter.
    fn whole(&self, increments: i32) -> i64 {
        self.whole_position + i64::from(increments.wrapping_sub(self.whole_position as i32))
    }

    pub(super) fn velocity_rpm(&self) -> f32 {
        self.servo.velocity_rpm()
    }

    pub(super) const fn current_a(&self) -> f32 {
        self.servo.current_a()
    }

    /// Every control period: the shaft's sensors. True if a phase carries more than the power stage bears.
    pub(super) fn sense(&mut self, sensors: &AxisSensors) -> bool {
        if !self.awake {
            self.awake = true;
            self.servo = Servo::new(&self.model, sensors.tracks, sensors.encoder_count);
        }
        match &sensors.followed {
            None => self.servo.sense(&self.model, sensors.tracks, sensors.encoder_count),
            Some(followed) => self.servo.sense_followed(&self.model, sensors.tracks, sensors.encoder_count, followed),
        }
        if let Some(electrical_turns) = self.commutation_angle {
            self.servo.commutate_at(electrical_turns);
        }
        if let Some(count) = sensors.index_count {
            let since = sensors.encoder_count.wrapping_sub(count) as i16;
            self.index = Some(self.position().wrapping_sub(i32::from(since)));
        }
        let [u, v] = sensors.phase_current_a;
        let limit_a = OVER_CURRENT * self.motor.max_current_a;
        [u, v, u + v].iter().any(|current_a| exceeds(current_a.abs(), limit_a))
    }

    /// Every control period: the power stage.
    pub(super) fn actuate(
        &mut self,
        values: &Dictionary<impl Storage>,
        sensors: &AxisSensors,
        bus_v: f32,
    ) -> AxisActuation {
        let energised = self.demand != Demand::Off;
        let power_stage = match self.model.fidelity {
            _ if !energised => PowerStage::Off,
            Fidelity::Full => PowerStage::Modulate {
                duty: self.servo.modulate(&self.model, &self.gains, sensors.phase_current_a, bus_v),
            },
            Fidelity::Mechanical => PowerStage::Follow(self.servo.current_demand(&self.model, &self.gains)),
        };
        let outputs = self.outputs(values);
        AxisActuation { power_stage, brake_released: energised && !outputs.set_brake, outputs: outputs.manufacturer }
    }

    /// Every supervision period, first: parameters and what is measured.
    pub(super) fn measure(&mut self, values: &Dictionary<impl Storage>, sensors: &AxisSensors) -> Feedback {
        self.refresh(values);
        self.servo.measure(&self.model, &self.gains, sensors.phase_current_a);
        let velocity_rad_s = self.servo.velocity_rad_s();
        let position = self.position();
        self.whole_position = self.whole(position);
        Feedback {
            position,
            velocity: f64::from(velocity_rad_s / self.model.rad_per_count()),
            current_a: self.servo.current_a(),
            standing: velocity_rad_s.abs() < STANDING_SHARE * self.motor.max_velocity_rad_s,
        }
    }

    /// The parameters as they are written by now.
    fn refresh(&mut self, values: &Dictionary<impl Storage>) {
        let mode = self.power.mode();
        let of_mode = |mode| mode == ModeOfOperation::VELOCITY;
        if self.parameters_changed || of_mode(mode) != of_mode(self.parameters.mode) {
            self.parameters_changed = false;
            self.parameters = Parameters::of(values, &self.slots, &self.motor, mode);
            self.gains = gains_of(self.named.as_ref(), values, &self.motor, self.model.fidelity);
        }
    }

    /// Then: what has newly become a fault of this axis.
    pub(super) fn observe(&mut self, sensors: &AxisSensors) -> FaultSet {
        let causes = self.causes(sensors);
        self.faults.observe(causes)
    }

    /// The causes of faults that are present.
    fn causes(&mut self, sensors: &AxisSensors) -> FaultSet {
        let latched = self.faults.latched();
        let limits =
            OverloadLimits { rated_a: self.motor.rated_current_a, begins_at: OVERLOAD_FROM, curve: OVERLOAD_CURVE };
        let hot = latched.has(row::MOTOR_TEMPERATURE);
        let misaligned = exceeds(self.servo.disagreement_turns().abs(), DISAGREEMENT_TURNS);
        if misaligned {
            self.servo.realign(&self.model, sensors.tracks, sensors.encoder_count);
        }
        self.lost
            .with(row::OVERLOAD, self.overload.update(&limits, self.servo.current_a(), SUPERVISION_PERIOD_S))
            .with(
                row::MOTOR_TEMPERATURE,
                exceeds_with_hysteresis(sensors.motor_c, MOTOR_LIMIT_C, TEMPERATURE_HYSTERESIS_C, hot),
            )
            .with(row::ENCODER, !sensors.encoder_wired || misaligned || matches!(sensors.tracks & 7, 0 | 7))
            .with(row::FOLLOWING_ERROR, self.following_error)
    }

    /// Last: demand, loops, and what is reported of them.
    pub(super) fn supervise(
        &mut self,
        values: &mut Dictionary<impl Storage>,
        sensors: &AxisSensors,
        feedback: Feedback,
        bus_v: f32,
    ) {
        let index = self.index.take();
        let [below, above] = self.runs_into_limit();
        self.power.set_switches(Switches {
            home: sensors.home,
            positive_limit: sensors.positive_limit || above,
            negative_limit: sensors.negative_limit || below,
            index,
        });
        self.read_targets(values, &feedback);
        let dt_s = f64::from(SUPERVISION_PERIOD_S);
        let demand = if self.travel_holds {
            let velocity = self.parameters.power.velocity.without_jerk();
            let parameters = power::Parameters { velocity, ..self.parameters.power };
            self.power.update(feedback, &self.targets, &parameters, dt_s)
        } else {
            self.power.update(feedback, &self.targets, &self.parameters.power, dt_s)
        };
        self.demand = match demand {
            Some(demand) => demand,
            None => self.power.idle(None, dt_s),
        };
        let commutation_angle = self.wanted_commutation(values);
        if self.commutation_angle.is_some() && commutation_angle.is_none() {
            self.servo.forget_current();
        }
        self.commutation_angle = commutation_angle;
        if let Some(home) = self.power.take_home() {
            // Zero position = home position + home offset.
            self.shift(home.wrapping_add(self.parameters.home_offset));
        }
        let position = self.position();
        let limits = self.limits(bus_v);
        self.servo.set_torque_offset(self.torque_offset_a(values));
        self.servo.control(&self.model, &self.gains, &self.demand, position, &limits);
        let shown = self.shown(position);
        let index = index.map(|at| self.shown(at));
        self.probes.update(values, &self.slots, sensors.probes, shown, index);
        self.judge(&feedback);
        self.publish(values, sensors, bus_v);
    }

    /// A move that has passed its target (6082h) can just be stopped before a software limit: at the negative end, at the positive.
    fn runs_into_limit(&self) -> [bool; 2] {
        let axis = self.power.axis();
        let (Some(travel), true) = (self.parameters.travel, axis.runs_on()) else { return [false; 2] };
        let point = axis.point();
        let rate = self.parameters.power.quick_stop_ramp.rate(point.velocity.abs());
        // It is looked at once a period.
        let next = f64::from(point.position) + 2.0 * point.velocity * f64::from(SUPERVISION_PERIOD_S);
        let is_held = travel.hold_velocity(next, point.velocity, rate) != point.velocity;
        [is_held && point.velocity < 0.0, is_held && point.velocity > 0.0]
    }

    /// The current limit of the direction that the motor pulls in.
    fn limits(&self, bus_v: f32) -> ServoLimits {
        let share = if self.stops_by_voltage() { braking_share(bus_v / self.motor.bus_v) } else { 1.0 };
        let [positive_a, negative_a] = self.parameters.max_current_a.map(|current_a| current_a * share);
        let downwards = self.servo.setpoint_a() * self.parameters.scales.direction() as f32 <= 0.0;
        ServoLimits {
            current_a: if downwards { negative_a } else { positive_a },
            velocity_rad_s: self.parameters.max_speed as f32 * self.model.rad_per_count(),
        }
    }

    /// The stop under way is one on the voltage limit (605Ah = 4 or 8, 605Dh or 605Eh = 4), and the shaft still turns.
    fn stops_by_voltage(&self) -> bool {
        self.power.stop_ramp() == Some(StopRamp::VoltageLimit)
            && self.power.axis().stop_state() == Some(StopState::Braking)
    }

    /// What was `by` is 0 from now on.
    fn shift(&mut self, by: i32) {
        self.power.shift_position(by);
        self.set_points.shift(by);
        self.position_offset = self.position_offset.wrapping_sub(by);
        self.whole_position -= i64::from(by);
        if let Demand::Position(point) = &mut self.demand {
            point.position = point.position.wrapping_sub(by);
        }
    }

    /// Windows with their times.
    fn judge(&mut self, feedback: &Feedback) {
        let status = self.power.status(&self.targets, &self.parameters.power);
        let _ = self.reached.update(status.target_reached, self.reached_time_ms(), SUPERVISION_MS);
        let (threshold, time_ms) = self.parameters.velocity_threshold;
        let _ = self.standing.update(feedback.velocity.abs() <= threshold, time_ms, SUPERVISION_MS);
        let window = self.parameters.following_error;
        let outside = self.error().is_some_and(|error| !window.holds(error));
        self.following_error = self.outside.update(outside, window.time_ms, SUPERVISION_MS);
    }

    /// How long a target has to be reached to count, in the mode that is in effect.
    const fn reached_time_ms(&self) -> u16 {
        match self.power.mode() {
            ModeOfOperation::PROFILE_POSITION => self.parameters.position_window.time_ms,
            ModeOfOperation::PROFILE_VELOCITY => self.parameters.velocity_window.1,
            _ => 0,
        }
    }

    /// So many supervisions of a shaft that [rests](Self::rests_since) have been left out.
    pub(super) fn leave_out_supervisions(&mut self, supervisions: u64) {
        for dwell in [&mut self.reached, &mut self.standing, &mut self.outside] {
            dwell.last_on(supervisions, SUPERVISION_MS);
        }
    }

    /// Following error in increments, while a position is followed.
    fn error(&self) -> Option<i64> {
        match &self.demand {
            Demand::Position(point) => Some(i64::from(point.position.wrapping_sub(self.position()))),
            _ => None,
        }
    }

    /// Nothing that a period reads or writes differs from `earlier`, which is this axis some periods before.
    pub(super) fn rests_since(&self, earlier: &Self) -> bool {
        // Each by name, so that no new one is forgotten. The first seven follow the values when `parameters_changed`.
        let Self {
            slots: _,
            modes: _,
            motor: _,
            model: _,
            gains: _,
            named: _,
            parameters: _,
            parameters_changed,
            power,
            servo,
            awake,
            demand,
            targets,
            position_offset,
            whole_position,
            index,
            set_points,
            faults,
            lost,
            overload,
            reached,
            standing,
            outside,
            following_error,
            limited,
            travel_holds: _,
            target_hold,
            probes,
            commutation_angle,
        } = self;
        // The windows go on counting, which changes nothing once their times have passed.
        let windows = [
            (reached, &earlier.reached, self.reached_time_ms()),
            (standing, &earlier.standing, self.parameters.velocity_threshold.1),
            (outside, &earlier.outside, self.parameters.following_error.time_ms),
        ];
        !*parameters_changed
            && windows.iter().all(|(dwell, before, time_ms)| dwell.is_as_decided_as(before, *time_ms))
            && (power, servo, awake) == (&earlier.power, &earlier.servo, &earlier.awake)
            && (demand, targets) == (&earlier.demand, &earlier.targets)
            && (position_offset, whole_position, index)
                == (&earlier.position_offset, &earlier.whole_position, &earlier.index)
            && *set_points == earlier.set_points
            && (faults, lost, overload) == (&earlier.faults, &earlier.lost, &earlier.overload)
            && (following_error, limited) == (&earlier.following_error, &earlier.limited)
            && (target_hold, probes, commutation_angle)
                == (&earlier.target_hold, &earlier.probes, &earlier.commutation_angle)
    }

    /// Operation enabled, with no fault on its way.
    fn is_enabled(&self) -> bool {
        self.power.state() == PowerState::OperationEnabled
    }
}
