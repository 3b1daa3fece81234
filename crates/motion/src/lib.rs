//! Profile planners and motor control loops, for a microcontroller.
//!
//! Planners run once per move and are in double precision, so that a move over 2^31 counts still ends exactly:
//! `plan(..) -> Profile`, then the pure `profile.at(t)`. Control loops run every period and are in single precision:
//! small `Copy` structs of gains beside small `Copy` structs of state, time step as an argument.
//!
//! Units are SI, or a planner's caller chooses a position unit and keeps to it. Nothing here knows CAN, objects or
//! raw user units; nothing allocates or reads a clock. Only IEEE 754 basic operations and `libm` are used: the same
//! input gives the same bits on every machine.
#![no_std]

pub mod angle;
pub mod cascade;
pub mod commutation;
pub mod field_weakening;
pub mod filter;
pub mod foc;
pub mod frames;
pub mod interpolate;
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
