//! The dictionary's parameters in physical units, as the parts of the drive want them. Written anew when one changes.

use motion::commutation::CommutationModel;
use motion::field_weakening::FieldWeakeningGains;
use motion::observer::ObserverGains;

use super::assumptions::*;
use super::gains::gains;
use super::model::Model;
use super::objects::*;
use super::power_on::Function;
use super::pulses::PulseParameters;
use super::{Values, homing};
use crate::Fidelity;
use crate::engine::actuator::servo::{ServoGains, ServoLimits, ServoModel};
use crate::engine::axis::{Control, HomingParameters, MoveLimits, Ramp, VelocityRamps};

const RAD_S_PER_RPM: f32 = cia402::RAD_S_PER_RPM as f32;

/// Everything that the control task reads of the dictionary besides its targets.
#[derive(Clone, Copy, Debug)]
pub(super) struct Parameters {
    /// 2619h as it was at power-on.
    pub(super) function: Function,
    /// Amplitude of a phase's current for each ampere of 261Dh and 6078h.
    pub(super) amplitude: f32,
    /// Highest speed of the motor, counts/s.
    pub(super) max_speed: f64,
    /// Of position moves.
    pub(super) moves: MoveLimits,
    /// Of what pulses ask for.
    pub(super) pulse_moves: MoveLimits,
    /// Of what it does by itself after power-on.
    pub(super) returning: MoveLimits,
    /// Of speeds.
    pub(super) velocity: VelocityRamps,
    /// Of everything that ends at rest.
    pub(super) ramp: Ramp,
    pub(super) homing: HomingParameters,
    pub(super) pulses: PulseParameters,
    pub(super) servo: ServoModel,
    pub(super) gains: ServoGains,
    pub(super) limits: ServoLimits,
    pub(super) weakening: FieldWeakeningGains,
    /// 261Dh: seconds at the current limit until the alarm, 0 for never.
    pub(super) current_time_s: f32,
    /// 2618h: share of the output that a stationary motor may have.
    pub(super) stationary_output: f32,
    /// 2618h: seconds at that limit until the alarm, 0 for never.
    pub(super) stationary_time_s: f32,
    pub(super) time_base: TimeBase,
    /// Ones digit of 60FBh:01 is even: the alarm output is normally open, and conducts while there is an alarm. Odd:
    /// normally closed, and opens then.
    pub(super) alarm_conducts: bool,
}

/// What the 2 ms of mode 7 go by: 261Ch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum TimeBase {
    /// 0: the joint's own clock, apart from those of other nodes.
    Own,
    /// Above 0: the joint's own clock, which SYNC starts over.
    Sync,
    /// 255: the level of DIR, which changes each 0.1 ms; SYNC marks from which change on.
    Dir,
}

impl TimeBase {
    const fn from_raw(raw: u16) -> Self {
        match raw {
            0 => Self::Own,
            DIR_IS_CLOCK => Self::Dir,
            _ => Self::Sync,
        }
    }
}

impl Parameters {
    /// `function` is that of the last power-on: 2619h acts from the next one on. `amplitude` is that of a phase's current
    /// for each ampere of 261Dh and 6078h.
    pub(super) fn from(values: &Values, model: &Model, function: Function, amplitude: f32, fidelity: Fidelity) -> Self {
        let max_speed = model.max_rpm * COUNTS_S_PER_RPM;
        let ramp = Ramp::Rate(acceleration(values));
        let moves = |speed: f64| MoveLimits {
            max_speed: speed.min(max_speed),
            acceleration: ramp,
            deceleration: ramp,
            ..MoveLimits::default()
        };
        let velocity = VelocityRamps { start_speed: 0.0, max_speed, acceleration: ramp, deceleration: ramp };
        let (allowed_a, current_time_s) = with_seconds(values.get(ALLOWABLE_CURRENT));
        let current_a = allowed_a * amplitude;
        let (stationary_output, stationary_time_s) = with_seconds(values.get(STATIONARY_OUTPUT));
        let profile_speed = f64::from(values.get(PROFILE_VELOCITY)) * COUNTS_S_PER_RPM;
        Self {
            function,
            amplitude,
            max_speed,
            moves: moves(profile_speed),
            pulse_moves: moves(max_speed),
            returning: moves(homing_speed(values)),
            velocity,
            ramp,
            homing: homing_parameters(values, velocity),
            pulses: pulses(values, function),
            servo: servo_model(model, fidelity),
            gains: gains(values, model, fidelity),
            limits: ServoLimits { current_a, velocity_rad_s: model.max_rpm as f32 * RAD_S_PER_RPM },
            weakening: weakening(values, current_a),
            current_time_s,
            stationary_output,
            stationary_time_s,
            time_base: TimeBase::from_raw(values.get(SYNCHRONOUS_CONTROL_WORD)),
            alarm_conducts: !is_odd(values.get(POSITION_PROPORTIONAL)),
        }
    }
}

/// 2604h: how far the vector of the current limit may be turned from the torque's direction against the magnets.
fn weakening(values: &Values, current_a: f32) -> FieldWeakeningGains {
    let advance_rad = f32::from(values.get(WEAK_MAGNETIC)) * (0.1 * core::f32::consts::PI / 180.0);
    FieldWeakeningGains {
        most_a: current_a * libm::sinf(advance_rad),
        voltage_share: WEAKENING_VOLTAGE_SHARE,
        integral_per_s: WEAKENING_PER_S,
    }
}

/// Counts/s², 0 for no ramp. An acceleration of 0 would never move: the smallest is taken.
fn acceleration(values: &Values) -> f64 {
    let raw = values.get(PROFILE_ACCELERATION);
    if raw >= NO_RAMP_FROM { 0.0 } else { f64::from(raw.max(1)) * COUNTS_S_PER_RPM }
}

/// "The ones digit 0~9 means the speed of finding the origin is 100~1000RPM."
fn homing_speed(values: &Values) -> f64 {
    f64::from(values.get(PROFILE_ACCELERATION) % 10 + 1) * 100.0 * COUNTS_S_PER_RPM
}

/// A value whose ones digit is a time in seconds and whose other digits are thousandths.
fn with_seconds(raw: u16) -> (f32, f32) {
    let seconds = raw % 10;
    (f32::from(raw - seconds) * 1e-3, f32::from(seconds))
}

fn is_odd(raw: u16) -> bool {
    raw % 2 == 1
}

/// One speed, and the position is given up on the way: the shaft is held where it comes to rest.
fn homing_parameters(values: &Values, ramps: VelocityRamps) -> HomingParameters {
    let speed = homing_speed(values).min(ramps.max_speed);
    HomingParameters {
        sequence: homing::sequence(values.get(HOMING_METHOD)),
        search_speed: speed,
        latch_speed: speed,
        ramps,
        end: ramps.deceleration,
        back_off: 0,
        single_pass: true,
        control: Control::Velocity,
    }
}

fn pulses(values: &Values, function: Function) -> PulseParameters {
    PulseParameters {
        function,
        numerator: values.get(GEAR_NUMERATOR),
        denominator: values.get(GEAR_DENOMINATOR),
        at_conduction: is_odd(values.get(VELOCITY_PROPORTIONAL)),
        dir_is_clockwise: values.get(DIR_POLARITY) == 1,
    }
}

fn servo_model(model: &Model, fidelity: Fidelity) -> ServoModel {
    let control_period_s = fidelity.tick(CONTROL_PERIOD_S, SUPERVISION_PERIOD_S);
    ServoModel {
        commutation: CommutationModel {
            counts_per_turn: COUNTS_PER_TURN,
            pole_pairs: u32::from(model.pole_pairs),
            offset_turns: 0.0,
            // No Hall sensors: the encoder is absolute.
            sequence: [0; 6],
        },
        direction: 1,
        observer: ObserverGains::new(VELOCITY_WINDOW_S, VELOCITY_STANDSTILL_S, control_period_s),
        control_period_s,
        supervision_period_s: SUPERVISION_PERIOD_S,
        switching_period_s: CONTROL_PERIOD_S,
        fidelity,
    }
}
