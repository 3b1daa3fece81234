//! The dictionary's parameters in physical units, as the engine wants them. Written anew when one changes.

use canopen::od::Object;
use cia402::StopRamp;
use motion::commutation::CommutationModel;
use motion::filter::LowPassGains;
use motion::observer::ObserverGains;

use super::Values;
use super::assumptions::*;
use super::gains::{gains, supervision_period_s};
use super::objects::*;
use super::variations::{EMERGENCY_COAST, EMERGENCY_RAMP, OVERLOAD_FROM_FACTOR, STOPPED_ENABLED};
use crate::Fidelity;
use crate::engine::actuator::bleeder::BleederLimits;
use crate::engine::actuator::overload::{OverloadLimits, between};
use crate::engine::actuator::servo::{ServoGains, ServoLimits, ServoModel};
use crate::engine::cia402::{ExternalStop, Parameters as AxisParameters, Tolerances};
use crate::zltech::{Holding, ProfileObjects};
use devices::variant::Variant;

const PROFILE_OBJECTS: ProfileObjects = ProfileObjects::of(&TABLE);

/// Hall states forward, from the electrical angle 2011h.
const HALL_SEQUENCE: [u8; 6] = [5, 1, 3, 2, 6, 4];

/// Counts in one encoder line: both edges of both channels.
const COUNTS_PER_LINE: u32 = 4;

const RAD_S_PER_RPM: f32 = cia402::RAD_S_PER_RPM as f32;

/// Everything that the control task reads of the dictionary besides its targets.
#[derive(Clone, Copy, Debug)]
pub(super) struct Parameters {
    /// Counts/s in one r/min.
    pub(super) counts_s_per_rpm: f64,
    /// Speed limit 200Ah, r/min.
    pub(super) max_rpm: f64,
    pub(super) axis: AxisParameters,
    pub(super) model: ServoModel,
    pub(super) gains: ServoGains,
    pub(super) limits: ServoLimits,
    pub(super) overload: OverloadLimits,
    pub(super) bleeder: BleederLimits,
    /// 2017h, counts.
    pub(super) out_of_tolerance: u32,
    /// 2013h, degC.
    pub(super) motor_limit_c: f32,
    pub(super) driver_limit_c: f32,
    /// 202F:01.
    pub(super) alarm_pwm: bool,
    /// What is done with a shaft that is not enabled.
    pub(super) holding: Holding,
    /// What 606Ch and 6077h show.
    pub(super) shown: LowPassGains,
    /// Supervision periods that one stands for.
    pub(super) supervisions: u16,
}

impl Parameters {
    pub(super) fn of(values: &Values, variant: &Variant, fidelity: Fidelity) -> Self {
        let counts_per_turn = u32::from(values.get(ENCODER_LINES)) * COUNTS_PER_LINE;
        let counts_s_per_rpm = f64::from(counts_per_turn) / 60.0;
        let max_rpm = f64::from(values.get(MAX_MOTOR_SPEED));
        let limits = servo_limits(values);
        Self {
            counts_s_per_rpm,
            max_rpm,
            axis: axis(values, variant, counts_s_per_rpm),
            model: servo_model(values, counts_per_turn, fidelity),
            gains: gains(values, limits.velocity_rad_s, fidelity),
            limits,
            overload: overload(values, variant),
            bleeder: bleeder(values),
            out_of_tolerance: u32::from(values.get(OUT_OF_TOLERANCE_THRESHOLD)) * 10,
            motor_limit_c: tenths(values, MOTOR_TEMPERATURE_THRESHOLD),
            driver_limit_c: tenths(values, DRIVER_TEMPERATURE_THRESHOLD),
            alarm_pwm: values.get(ALARM_PWM) == 1,
            holding: Holding { when_disabled: values.get(SHAFT_LOCK_WHEN_DISABLED) == 1, when_switched_on: false },
            shown: LowPassGains::from_time_constant(DISPLAY_FILTER_S, supervision_period_s(fidelity)),
            supervisions: fidelity.tick(1, MECHANICAL_SUPERVISIONS),
        }
    }

    /// From one supervision to the next, s.
    pub(super) const fn supervision_period_s(&self) -> f32 {
        self.model.supervision_period_s
    }

    /// The motor's sense of rotation that 2001h asks for.
    pub(super) fn wanted_direction(values: &Values) -> i8 {
        if values.get(MOTOR_DIRECTION) == 0 { 1 } else { -1 }
    }
}

fn axis(values: &Values, variant: &Variant, counts_s_per_rpm: f64) -> AxisParameters {
    let max_rpm = f64::from(values.get(MAX_MOTOR_SPEED));
    let speed = |rpm: f64| rpm.min(max_rpm) * counts_s_per_rpm;
    AxisParameters {
        torque_slope_a_s: values.get(TORQUE_SLOPE) as f32 * 1e-3,
        emergency_stop: emergency_stop(variant),
        external_stop: match values.get(IO_STOP_PROCESSING) {
            0 => ExternalStop::Hold,
            _ if variant.is(STOPPED_ENABLED) => ExternalStop::LetGo,
            _ => ExternalStop::Disable,
        },
        tolerances: Tolerances {
            position: u32::from(values.get(IN_POSITION_THRESHOLD)),
            velocity: f64::from(VELOCITY_REACHED_RPM) * counts_s_per_rpm,
            current_a: TORQUE_REACHED_A,
        },
        ..PROFILE_OBJECTS.axis(values, values.get(INITIAL_SPEED), max_rpm, speed)
    }
}

/// What 605Ah = 7 and 605Dh = 3 mean.
fn emergency_stop(variant: &Variant) -> StopRamp {
    if variant.is(EMERGENCY_RAMP) {
        StopRamp::QuickStop
    } else if variant.is(EMERGENCY_COAST) {
        StopRamp::Free
    } else {
        StopRamp::CurrentLimit
    }
}

fn servo_model(values: &Values, counts_per_turn: u32, fidelity: Fidelity) -> ServoModel {
    let supervision_period_s = supervision_period_s(fidelity);
    let control_period_s = fidelity.tick(CONTROL_PERIOD_S, supervision_period_s);
    ServoModel {
        commutation: CommutationModel {
            counts_per_turn,
            pole_pairs: u32::from(values.get(MOTOR_POLE_PAIRS)),
            offset_turns: f32::from(values.get(HALL_OFFSET_ANGLE)) / 360.0,
            sequence: HALL_SEQUENCE,
        },
        direction: Parameters::wanted_direction(values),
        observer: ObserverGains::new(VELOCITY_WINDOW_S, VELOCITY_STANDSTILL_S, control_period_s),
        control_period_s,
        supervision_period_s,
        switching_period_s: CONTROL_PERIOD_S,
        fidelity,
    }
}

/// 2015h, held to 3 A in parking mode, and 200Ah.
fn servo_limits(values: &Values) -> ServoLimits {
    let max_a = tenths(values, MAX_CURRENT);
    ServoLimits {
        current_a: if values.get(PARKING_MODE) == 1 { max_a.min(PARKING_CURRENT_A) } else { max_a },
        velocity_rad_s: f32::from(values.get(MAX_MOTOR_SPEED)) * RAD_S_PER_RPM,
    }
}

/// With overload processing on (202F:02) 2016h is the time at the rated current 2014h, and the note below the object table
/// has the shares of it at higher ones. With it off, as delivered, 2016h is the time from 2012h times the rated current on,
/// and below that the time is longer in the proportion of the note, or there is no overload.
fn overload(values: &Values, variant: &Variant) -> OverloadLimits {
    let time_s = f32::from(values.get(OVERLOAD_TIME)) * 10e-3;
    let factor = f32::from(values.get(OVERLOAD_FACTOR)) / 100.0;
    let begins_at = if variant.is(OVERLOAD_FROM_FACTOR) { factor } else { factor.min(OVERLOAD_FROM) };
    let curve = if values.get(OVERLOAD_PROCESSING) == 1 {
        OVERLOAD_TIME_SHARES.map(|(multiple, share)| (multiple, time_s * share))
    } else {
        let at_factor = between(&OVERLOAD_TIME_SHARES, factor);
        OVERLOAD_TIME_SHARES.map(|(multiple, share)| {
            if multiple < factor { (multiple, time_s * share / at_factor) } else { (factor, time_s) }
        })
    };
    OverloadLimits { rated_a: tenths(values, RATED_CURRENT), begins_at, curve }
}

fn bleeder(values: &Values) -> BleederLimits {
    let resistance_ohm = tenths(values, BLEEDER_RESISTANCE);
    let rated_w = f32::from(values.get(BLEEDER_POWER));
    let on_v = tenths(values, BLEEDER_ON_VOLTAGE);
    BleederLimits {
        enabled: values.get(BLEEDER_ENABLE) == 1,
        on_v,
        // 202Eh:03 may have been lowered below it since.
        off_v: tenths(values, BLEEDER_OFF_VOLTAGE).min(on_v),
        conductance_s: if resistance_ohm > 0.0 { 1.0 / resistance_ohm } else { 0.0 },
        rated_w,
        overload_j: rated_w * BLEEDER_OVERLOAD_S,
    }
}

fn tenths(values: &Values, object: Object<u16>) -> f32 {
    f32::from(values.get(object)) * 0.1
}
