//! The dictionary's parameters in physical units, as the engine wants them. Written anew when one changes.

use cia402::StopRamp;
use motion::pid::PiGains;

use super::assumptions::*;
use super::objects::*;
use super::tables::{PEAK_CURRENTS_A, PULSES_PER_TURN, STEP_FREQUENCY_HZ, entry};
use super::variations::{EMERGENCY_BRAKE, EMERGENCY_COAST};
use super::{Values, homing};
use crate::Fidelity;
use crate::engine::actuator::stepper::{StepperCurrents, StepperGains, StepperModel};
use crate::engine::axis::{HomingParameters, Ramp, VelocityRamps};
use crate::engine::cia402::{Parameters as AxisParameters, Tolerances};
use crate::zltech::{Holding, ProfileObjects};
use devices::variant::Variant;

const PROFILE_OBJECTS: ProfileObjects = ProfileObjects::of(&TABLE);

/// Everything that the control task reads of the dictionary besides its targets.
#[derive(Clone, Copy, Debug)]
pub(super) struct Parameters {
    /// Pulses in one turn.
    pub(super) pulses_per_turn: u16,
    /// Pulses/s in one r/min.
    pub(super) pulses_s_per_rpm: f64,
    pub(super) axis: AxisParameters,
    /// What is done with a shaft that is not enabled.
    pub(super) holding: Holding,
    pub(super) model: StepperModel,
    pub(super) gains: StepperGains,
    pub(super) currents: StepperCurrents,
    /// Supervision periods in one of its supervisions.
    pub(super) supervisions: u16,
}

impl Parameters {
    pub(super) fn of(values: &Values, variant: &Variant, fidelity: Fidelity) -> Self {
        Self::with_pulses(values, variant, pulses_per_turn(values), fidelity)
    }

    /// The same with another number of pulses in a turn than 2006h has.
    pub(super) fn with_pulses(values: &Values, variant: &Variant, pulses_per_turn: u16, fidelity: Fidelity) -> Self {
        let supervisions = fidelity.tick(1, MECHANICAL_SUPERVISIONS);
        Self {
            pulses_per_turn,
            pulses_s_per_rpm: f64::from(pulses_per_turn) / 60.0,
            axis: axis(values, variant, pulses_per_turn),
            holding: Holding { when_disabled: values.get(SHAFT_LOCK_WHEN_DISABLED) == 1, when_switched_on: true },
            model: StepperModel {
                pulses_per_electrical_turn: pulses_per_turn / TEETH as u16,
                periods_per_command: SUPERVISION_DIVIDER * supervisions as u8,
                control_period_s: CONTROL_PERIOD_S,
                detent_a: if pulses_per_turn < DETENT_FROM_PULSES { 0.0 } else { DETENT_CURRENT_A },
                detent_lead_periods: DETENT_LEAD_PERIODS,
            },
            gains: StepperGains {
                current: PiGains {
                    proportional: f32::from(values.get(CURRENT_LOOP_KP)) * CURRENT_KP_V_PER_A,
                    integral_per_s: f32::from(values.get(CURRENT_LOOP_KI)) * CURRENT_KI_V_PER_A_S,
                },
                modulation_limit: MODULATION_LIMIT,
                at_limit: AT_LIMIT,
            },
            currents: currents(values, supervisions),
            supervisions,
        }
    }
}

/// 2006h.
fn pulses_per_turn(values: &Values) -> u16 {
    entry(&PULSES_PER_TURN, values.get(MICROSTEP_SETTING))
}

fn axis(values: &Values, variant: &Variant, pulses_per_turn: u16) -> AxisParameters {
    let speed = |rpm: f64| (rpm * f64::from(pulses_per_turn) / 60.0).min(STEP_FREQUENCY_HZ);
    let shared = PROFILE_OBJECTS.axis(values, values.get(START_SPEED), MAX_SPEED_RPM, speed);
    let homing_ramp = Ramp::Time(f64::from(values.get(HOMING_ACCELERATION)) * 1e-3);
    let emergency_stop = emergency_stop(variant);
    AxisParameters {
        emergency_stop,
        limit_stop: match values.get(LIMIT_STOP_MODE) {
            0 => Some(StopRamp::SlowDown),
            1 => Some(emergency_stop),
            _ => None,
        },
        homing: HomingParameters {
            sequence: homing::sequence(values.get(HOMING_METHOD), variant),
            search_speed: speed(f64::from(values.get(HOMING_SPEED))),
            latch_speed: speed(f64::from(values.get(HOMING_SEARCH_SPEED))),
            ramps: VelocityRamps { acceleration: homing_ramp, deceleration: homing_ramp, ..shared.velocity },
            back_off: (HOMING_BACK_OFF_TURNS * f64::from(pulses_per_turn)) as u32,
            ..HomingParameters::default()
        },
        // What is commanded is what there is: every target is reached exactly.
        tolerances: Tolerances { position: 0, velocity: VELOCITY_ROUNDING, current_a: 0.0 },
        ..shared
    }
}

/// 605Ah = 7, 605Dh = 3 and 200Ah = 1 have one word, and so has 6085h, the time of its ramp. A stepper that is stopped
/// without a ramp loses steps.
fn emergency_stop(variant: &Variant) -> StopRamp {
    if variant.is(EMERGENCY_BRAKE) {
        StopRamp::CurrentLimit
    } else if variant.is(EMERGENCY_COAST) {
        StopRamp::Free
    } else {
        StopRamp::QuickStop
    }
}

/// 2005h while turning; 2007h at standstill: half of it, or all.
fn currents(values: &Values, supervisions: u16) -> StepperCurrents {
    let run_a = entry(&PEAK_CURRENTS_A, values.get(CURRENT_SETTING));
    let hold_a = if values.get(LOCK_CURRENT) == 0 { 0.5 * run_a } else { run_a };
    StepperCurrents { run_a, hold_a, hold_after: HOLD_AFTER_PERIODS / supervisions }
}

/// Pulses/s by which a planned velocity may miss its target in the last bits.
const VELOCITY_ROUNDING: f64 = 1e-6;
