//! What one count of a loop coefficient is worth. The manual gives the coefficients 2018h to 2021h and 202Ah to 202Dh
//! without units; these are chosen so that its factory values make a well damped drive.
//!
//! The motors are the published hub motors that the drive is sold with (two windings of the ZLLG65ASM250, see crate
//! `plant`): R = 0.26 and 0.07 ohm, L = 0.70 and 0.145 mH, Kt = 0.76 and 0.30 N m/A, J = 0.014 kg m² with the wheel.
//!
//! | object | factory | one count | gives | because |
//! |---|---|---|---|---|
//! | 2019h | 600 | 1 mV/A | 0.6 V/A | bandwidth kp/L of 860 and 4100 rad/s: far above the velocity loop, far below the 20 kHz |
//! | 201Ah | 300 | 1 V/(A s) | 300 V/(A s) | the winding's pole R/L is cancelled within 30 % for both: ki/kp = 500 1/s against 380 and 530 |
//! | 201Dh | 500 | 0.5 mA/(r/min) | 2.4 A/(rad/s) | velocity bandwidth kp Kt/J of 130 and 50 rad/s: an eighth of the current loop's or less |
//! | 201Eh | 100 | 20 mA/(r/min s) | 2 A/(r/min s) | integral time of 0.125 s, six to sixteen times the loop's own: damping above 1, still 0.5 with ten times the inertia |
//! | 201Fh | 1000 | 20 uA/(rad/s²) | 0.02 A/(rad/s²) | J/Kt of the slow winding is 0.0184 |
//! | 2020h | 50 | 0.2 1/s | 10 1/s | a fifth of the slower velocity loop |
//! | 2021h | 200 | 1/200 | 1 | no lag behind a planned velocity |
//! | 2018h | 1000 | 1 us | 1 ms | below the velocity loop's 8 ms, above the encoder's noise |
//! | 201Bh, 201Ch | 100 | 1 us | 0.1 ms | a fifth of a supervision period |
//! | 202Ah to 202Dh | 0 | corrections and share of [`Tracking`](crate::engine::actuator::observer::Tracking) | off | the sibling's 1000, 750, 350, 1000 place three poles near 300 rad/s |

use canopen::od::Object;
use motion::cascade::CascadeGains;
use motion::filter::LowPassGains;
use motion::foc::FocGains;
use motion::pid::PiGains;

use super::Values;
use super::assumptions::{CONTROL_PERIOD_S, MECHANICAL_SUPERVISIONS, SUPERVISION_PERIOD_S};
use super::objects::{
    CURRENT_KI, CURRENT_KP, FEEDFORWARD_SMOOTHING, POSITION_KF, POSITION_KP, TORQUE_SMOOTHING, VELOCITY_KF,
    VELOCITY_KI, VELOCITY_KP, VELOCITY_OBSERVER_1, VELOCITY_OBSERVER_2, VELOCITY_OBSERVER_3, VELOCITY_OBSERVER_4,
    VELOCITY_SMOOTHING,
};
use crate::Fidelity;
use crate::engine::actuator::observer::TrackingGains;
use crate::engine::actuator::servo::ServoGains;

const RAD_S_PER_RPM: f32 = cia402::RAD_S_PER_RPM as f32;

const CURRENT_KP_V_PER_A: f32 = 1e-3;
const CURRENT_KI_V_PER_A_S: f32 = 1.0;
const VELOCITY_KP_A_PER_RAD_S: f32 = 0.5e-3 / RAD_S_PER_RPM;
const VELOCITY_KI_A_PER_RAD: f32 = 20e-3 / RAD_S_PER_RPM;
const ACCELERATION_KF_A_PER_RAD_S2: f32 = 20e-6;
const POSITION_KP_PER_S: f32 = 0.2;
const POSITION_KF_SHARE: f32 = 1.0 / 200.0;
const SMOOTHING_S: f32 = 1e-6;

/// 202Ah to 202Dh: corrections of position, velocity and acceleration, and the share of the tracking observer.
/// 1000, 750 and 350 counts are (1000 1/s, 0.3e6 1/s², 28e6 1/s³), near three poles at 300 rad/s (900, 0.27e6, 27e6);
/// 1000 counts are the whole share.
const TRACKING: TrackingGains =
    TrackingGains { position_per_s: 1.0, velocity_per_s2: 400.0, acceleration_per_s3: 80e3 };
const TRACKING_SHARE: f32 = 1e-3;

/// Share of the bus voltage that the power stage can give; the rest is dead time.
const MODULATION_LIMIT: f32 = 0.98;

/// From one supervision to the next, s.
pub(super) fn supervision_period_s(fidelity: Fidelity) -> f32 {
    SUPERVISION_PERIOD_S * fidelity.tick(1.0, f32::from(MECHANICAL_SUPERVISIONS))
}

/// The gains that the objects hold; `velocity_limit_rad_s` is what the position loop may ask for.
pub(super) fn gains(values: &Values, velocity_limit_rad_s: f32, fidelity: Fidelity) -> ServoGains {
    let dt_s = supervision_period_s(fidelity);
    let count = |object: Object<u16>| f32::from(values.get(object));
    let current = PiGains {
        proportional: count(CURRENT_KP) * CURRENT_KP_V_PER_A,
        integral_per_s: count(CURRENT_KI) * CURRENT_KI_V_PER_A_S,
    };
    let tracking = TrackingGains {
        position_per_s: count(VELOCITY_OBSERVER_1) * TRACKING.position_per_s,
        velocity_per_s2: count(VELOCITY_OBSERVER_2) * TRACKING.velocity_per_s2,
        acceleration_per_s3: count(VELOCITY_OBSERVER_3) * TRACKING.acceleration_per_s3,
    };
    // One that follows nothing would leave the velocity loop with what is not there.
    let share = if tracking.follow(dt_s) { count(VELOCITY_OBSERVER_4) * TRACKING_SHARE } else { 0.0 };
    let smoothing = |object, dt_s| LowPassGains::from_time_constant(count(object) * SMOOTHING_S, dt_s);
    ServoGains {
        foc: FocGains {
            d: current,
            q: current,
            // The drive has no objects for the motor's inductance and flux.
            feed_forward: None,
            modulation_limit: MODULATION_LIMIT,
            // To the middle of the period that follows the next tick: see the contract of `Firmware::tick`.
            voltage_delay_s: 1.5 * CONTROL_PERIOD_S,
        },
        cascade: CascadeGains {
            position_per_s: count(POSITION_KP) * POSITION_KP_PER_S,
            velocity_feed_forward: count(POSITION_KF) * POSITION_KF_SHARE,
            velocity: PiGains {
                proportional: count(VELOCITY_KP) * VELOCITY_KP_A_PER_RAD_S,
                integral_per_s: count(VELOCITY_KI) * VELOCITY_KI_A_PER_RAD,
            },
            acceleration_feed_forward: count(VELOCITY_KF) * ACCELERATION_KF_A_PER_RAD_S2,
            friction_feed_forward: 0.0,
            velocity_limit_rad_s,
        },
        velocity_filter: smoothing(VELOCITY_SMOOTHING, dt_s),
        feed_forward_filter: smoothing(FEEDFORWARD_SMOOTHING, dt_s),
        torque_filter: smoothing(TORQUE_SMOOTHING, fidelity.tick(CONTROL_PERIOD_S, dt_s)),
        tracking,
        tracking_share: share.min(1.0),
    }
}
