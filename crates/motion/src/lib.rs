//! Profile planners and motor control loops, for a microcontroller.
//!
//! Planners run once per move and are in double precision, so that a move over 2^31 counts still ends exactly:
//! `plan(..) -> Profile`, then the pure `profile.at(t)`. Control loops run every period and are in single precision:
//! small `Copy` structs of gains beside small `Copy` structs of state, time step as an argument.
//!
//! Units are SI, or a planner's caller chooses a position unit and keeps to it. Nothing here knows CAN, objects or
//! raw user units; nothing allocates or reads a clock. Only IEEE 754 basic operations and `libm` are used: the same
//! input gives the same bits on every machine.
//!
//! ```
//! use motion::pid::{Pi, PiGains};
//! use motion::trapezoid::PositionMove;
//!
//! // 100 units at 10 units/s, with ramps of 2 s each: 12 s in all, half way after 6 s.
//! let way = PositionMove { distance: 100.0, max_speed: 10.0, acceleration: 5.0, deceleration: 5.0, ..Default::default() };
//! let profile = way.plan();
//! assert_eq!(profile.duration(), 12.0);
//! assert_eq!((profile.at(6.0).position, profile.at(6.0).velocity), (50.0, 10.0));
//!
//! // A current controller for a winding of 1 ohm and 2 mH, 24 V at most, 50 µs: the current follows within 1 ms.
//! let gains = PiGains::for_winding(5000.0, 1.0, 2e-3);
//! let (mut controller, mut current_a) = (Pi::default(), 0.0);
//! for _ in 0..20 {
//!     let voltage_v = controller.update(&gains, 2.0 - current_a, 0.0, 24.0, 50e-6);
//!     current_a += 50e-6 / 2e-3 * (voltage_v - 1.0 * current_a);
//! }
//! assert!((current_a - 2.0).abs() < 0.05);
//! ```
#![no_std]

pub mod angle;
pub mod cascade;
pub mod commutation;
pub mod field_weakening;
pub mod filter;
pub mod foc;
pub mod frames;
pub mod interpolate;
pub mod jerk;
pub mod limits;
pub mod observer;
pub mod pid;
pub mod profile;
pub mod scurve;
pub mod set_points;
pub mod slew;
pub mod trapezoid;
pub mod travel;

pub use profile::{Point, Profile};
