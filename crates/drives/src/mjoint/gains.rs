//! What one count of a loop coefficient is worth. The manual gives 60F9h and 60FBh ranges and hardly a unit; these are
//! chosen so that the values as delivered make a well damped drive on the motors of crate `plant`.
//!
//! Motors: R = 0.43 and 0.265 ohm, L = 0.4 and 0.25 mH a phase, Kt = 0.202 N m/A of amplitude, J = 0.69e-4 and 1.74e-4 kg m².
//!
//! | object | delivered | one count | gives | because |
//! |---|---|---|---|---|
//! | 60F9h:01 | 3000 | 1/15 mA/(rad/s) | 0.2 A/(rad/s) | velocity bandwidth kp Kt/J of 590 and 230 rad/s: a fifth of the current loop's or less |
//! | 60F9h:02 | 30 | 1 ms | 30 ms | printed as a time; seven and more of the loop's own. 2000 switches it off ("cancel integration") |
//! | 60FBh:01 | 3000 | 0.02 1/s | 60 1/s | a quarter of the slower velocity loop |
//! | 60FBh:02 | 0 | 1/327 V at 1000 r/min | 0 V | printed; added to the motor's voltage. Its 12 V come near the 14.1 V of the motors' own |

use motion::cascade::CascadeGains;
use motion::filter::LowPassGains;
use motion::foc::{FeedForward, FocGains};
use motion::pid::PiGains;

use super::Values;
use super::assumptions::{CONTROL_PERIOD_S, SUPERVISION_PERIOD_S, VELOCITY_FILTER_S};
use super::model::Model;
use super::objects::{POSITION_PROPORTIONAL, VELOCITY_FEED_FORWARD, VELOCITY_INTEGRAL_TIME, VELOCITY_PROPORTIONAL};
use crate::Fidelity;
use crate::engine::actuator::observer::TrackingGains;
use crate::engine::actuator::servo::ServoGains;

const RAD_S_PER_RPM: f32 = cia402::RAD_S_PER_RPM as f32;

const VELOCITY_KP_A_PER_RAD_S: f32 = 0.2 / 3000.0;
const POSITION_KP_PER_S: f32 = 0.02;

/// Value of 60F9h:02 that switches integration off ("Disk load").
const NO_INTEGRATION_MS: u16 = 2000;

/// V for each rad/s of the shaft in one count of 60FBh:02: 1/327 V at 1000 r/min.
const FEED_FORWARD_V_S: f32 = 1.0 / (327.0 * 1000.0 * RAD_S_PER_RPM);

/// Bandwidth of the current loop: 0.15 of it are one control period.
const CURRENT_BANDWIDTH_RAD_S: f32 = 3000.0;

/// Share of the bus voltage that the power stage can give to a turning motor; the rest is dead time.
pub const MODULATION_LIMIT: f32 = 0.98;

/// The gains that the objects hold.
pub(super) fn gains(values: &Values, model: &Model, fidelity: Fidelity) -> ServoGains {
    let current = PiGains::for_winding(CURRENT_BANDWIDTH_RAD_S, model.resistance_ohm, model.inductance_h);
    let none = LowPassGains::from_time_constant(0.0, SUPERVISION_PERIOD_S);
    let flux_linkage_wb = f32::from(values.get(VELOCITY_FEED_FORWARD)) * FEED_FORWARD_V_S / f32::from(model.pole_pairs);
    ServoGains {
        foc: FocGains {
            d: current,
            q: current,
            // The axes are decoupled: at 2000 r/min the electrical speed is beyond the loop's bandwidth.
            feed_forward: Some(FeedForward {
                inductance_d_h: model.inductance_h,
                inductance_q_h: model.inductance_h,
                flux_linkage_wb,
            }),
            modulation_limit: MODULATION_LIMIT,
            voltage_delay_s: 0.5 * CONTROL_PERIOD_S,
        },
        cascade: CascadeGains {
            position_per_s: f32::from(values.get(POSITION_PROPORTIONAL)) * POSITION_KP_PER_S,
            // "Following zero hysteresis": no lag behind a planned motion.
            velocity_feed_forward: 1.0,
            velocity: velocity_loop(values),
            // No object holds it: the joint knows its own motor.
            acceleration_feed_forward: model.acceleration_a_s2,
            friction_feed_forward: 0.0,
            velocity_limit_rad_s: model.max_rpm as f32 * RAD_S_PER_RPM,
        },
        velocity_filter: LowPassGains::from_time_constant(VELOCITY_FILTER_S, SUPERVISION_PERIOD_S),
        feed_forward_filter: none,
        torque_filter: LowPassGains::from_time_constant(0.0, fidelity.tick(CONTROL_PERIOD_S, SUPERVISION_PERIOD_S)),
        tracking: TrackingGains::default(),
        tracking_share: 0.0,
    }
}

fn velocity_loop(values: &Values) -> PiGains {
    let proportional = f32::from(values.get(VELOCITY_PROPORTIONAL)) * VELOCITY_KP_A_PER_RAD_S;
    match values.get(VELOCITY_INTEGRAL_TIME) {
        NO_INTEGRATION_MS => PiGains { proportional, integral_per_s: 0.0 },
        time_ms => PiGains::from_integral_time(proportional, f32::from(time_ms.max(1)) * 1e-3),
    }
}
