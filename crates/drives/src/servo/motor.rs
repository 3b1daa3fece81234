//! What a drive is configured with of the motor that is wired to it, and the loops that follow from it.

use motion::cascade::CascadeGains;
use motion::commutation::CommutationModel;
use motion::filter::LowPassGains;
use motion::foc::{FeedForward, FocGains};
use motion::observer::ObserverGains;
use motion::pid::PiGains;

use crate::Fidelity;
use crate::engine::actuator::observer::TrackingGains;
use crate::engine::actuator::servo::{ServoGains, ServoModel};

/// Control period: currents and duty cycles.
pub const CONTROL_PERIOD_NS: u64 = 50_000;
/// Supervision periods are this many control periods.
pub(super) const SUPERVISION_DIVIDER: u8 = 10;
pub(super) const CONTROL_PERIOD_S: f32 = 50e-6;
pub(super) const SUPERVISION_PERIOD_S: f32 = 0.5e-3;

/// Bandwidth of the current loop, rad/s: a quarter of what the delay of one and a half control periods leaves.
const CURRENT_BANDWIDTH_RAD_S: f32 = 3000.0;
/// Of the velocity loop with the motor's own inertia: a tenth of it, and far below the supervision period's 2000 1/s.
const VELOCITY_BANDWIDTH_RAD_S: f32 = 300.0;
/// Integral time of the velocity loop in times of its own: damping above 1.
const VELOCITY_INTEGRAL_SHARE: f32 = 0.2;
/// Of the position loop: a fifth of the velocity loop.
const POSITION_BANDWIDTH_RAD_S: f32 = 60.0;
/// Share of the bus voltage that the power stage can give; the rest is dead time.
const MODULATION_LIMIT: f32 = 0.98;
/// The longest span that velocity is taken over, and after which silence is standstill, control periods.
const VELOCITY_WINDOW: u32 = 10;
const VELOCITY_STANDSTILL: u32 = 200;

/// A synchronous motor with encoder and commutation tracks. Currents are amplitudes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motor {
    /// Electrical turns in one of the shaft.
    pub pole_pairs: u32,
    /// Encoder increments in one turn of the shaft.
    pub increments_per_turn: u32,
    /// Of one phase, ohm.
    pub resistance_ohm: f32,
    /// Of one phase, H.
    pub inductance_h: f32,
    /// Amplitude of the magnets' flux linkage with one phase, Wb.
    pub flux_linkage_wb: f32,
    /// Of rotor and coupled load, kg m².
    pub inertia_kg_m2: f32,
    /// Rated torque, N m.
    pub rated_torque_nm: f32,
    /// Rated current, A.
    pub rated_current_a: f32,
    /// The most that motor and power stage bear, A.
    pub max_current_a: f32,
    /// Highest velocity, rad/s.
    pub max_velocity_rad_s: f32,
    /// Of the braking resistor, ohm; 0 for none.
    pub braking_ohm: f32,
    /// Rated power of the braking resistor, W.
    pub braking_w: f32,
    /// Rated voltage of the bus, V.
    pub bus_v: f32,
    /// What the velocity loop's gains are worth, where objects have them and that is known.
    pub speed_worth: Option<SpeedWorth>,
}

/// What a count of the gains of a velocity loop is worth. Currents are amplitudes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpeedWorth {
    /// Of the proportional gain, A/(rad/s).
    pub proportional: f32,
    /// Of the integral part: of a gain, A/rad; of a time, s.
    pub integral: f32,
}

impl Motor {
    /// Torque for each ampere of q current.
    pub fn torque_constant_nm_a(&self) -> f32 {
        1.5 * self.pole_pairs as f32 * self.flux_linkage_wb
    }

    pub(super) fn model(&self, fidelity: Fidelity) -> ServoModel {
        ServoModel {
            commutation: CommutationModel {
                counts_per_turn: self.increments_per_turn,
                pole_pairs: self.pole_pairs,
                offset_turns: 0.0,
                sequence: [5, 1, 3, 2, 6, 4],
            },
            direction: 1,
            observer: ObserverGains {
                window: fidelity.tick(VELOCITY_WINDOW, VELOCITY_WINDOW / u32::from(SUPERVISION_DIVIDER)),
                standstill: fidelity.tick(VELOCITY_STANDSTILL, VELOCITY_STANDSTILL / u32::from(SUPERVISION_DIVIDER)),
            },
            control_period_s: fidelity.tick(CONTROL_PERIOD_S, SUPERVISION_PERIOD_S),
            supervision_period_s: SUPERVISION_PERIOD_S,
            switching_period_s: CONTROL_PERIOD_S,
            fidelity,
        }
    }

    /// Loops of fixed bandwidths: `kp = L w`, `ki = R w` for the current, `kp = J w / Kt` for the velocity.
    pub(super) fn gains(&self, fidelity: Fidelity) -> ServoGains {
        let current = PiGains {
            proportional: self.inductance_h * CURRENT_BANDWIDTH_RAD_S,
            integral_per_s: self.resistance_ohm * CURRENT_BANDWIDTH_RAD_S,
        };
        let amperes_per_rad_s2 = self.inertia_kg_m2 / self.torque_constant_nm_a();
        let stiffness = amperes_per_rad_s2 * VELOCITY_BANDWIDTH_RAD_S;
        ServoGains {
            foc: FocGains {
                d: current,
                q: current,
                feed_forward: Some(FeedForward {
                    inductance_d_h: self.inductance_h,
                    inductance_q_h: self.inductance_h,
                    flux_linkage_wb: self.flux_linkage_wb,
                }),
                modulation_limit: MODULATION_LIMIT,
                // To the middle of the period that follows the next tick: see the contract of `Firmware::tick`.
                voltage_delay_s: 1.5 * CONTROL_PERIOD_S,
            },
            cascade: CascadeGains {
                position_per_s: POSITION_BANDWIDTH_RAD_S,
                velocity_feed_forward: 1.0,
                velocity: PiGains {
                    proportional: stiffness,
                    integral_per_s: stiffness * VELOCITY_BANDWIDTH_RAD_S * VELOCITY_INTEGRAL_SHARE,
                },
                acceleration_feed_forward: amperes_per_rad_s2,
                friction_feed_forward: 0.0,
                velocity_limit_rad_s: self.max_velocity_rad_s,
            },
            velocity_filter: LowPassGains::from_time_constant(0.0, SUPERVISION_PERIOD_S),
            feed_forward_filter: LowPassGains::from_time_constant(SUPERVISION_PERIOD_S, SUPERVISION_PERIOD_S),
            torque_filter: LowPassGains::from_time_constant(0.0, fidelity.tick(CONTROL_PERIOD_S, SUPERVISION_PERIOD_S)),
            tracking: TrackingGains::default(),
            tracking_share: 0.0,
        }
    }
}
