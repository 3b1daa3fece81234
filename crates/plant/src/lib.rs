//! Physics of motors, loads, supplies and sensors, in SI units and double precision.
//!
//! What goes in is what a drive's power stage does ([`hub_motor::Actuation`]), what comes out is what its sensors
//! read ([`hub_motor::Sensors`]). A part is a *model* (constants that never change while it runs) and *data* (its
//! small, cloneable state); `model.step(&mut data, ..)` moves it by one time step.
//!
//! The same input gives the same bits on every machine: only IEEE 754 basic operations and `libm` are used, and
//! nothing here reads a clock or a random source. The crate knows nothing of drives, controllers or CAN.
//!
//! Another kind of motor (a hybrid stepper) is a file beside [`pmsm`]; a gear stands between [`mechanics`] and the
//! load; each joins its own composition beside [`hub_motor`].
#![no_std]

pub mod angle;
pub mod brake;
pub mod encoder;
pub mod hall;
pub mod hub_motor;
pub mod mechanics;
pub mod pmsm;
pub mod supply;
pub mod thermal;

mod hub_motors;

pub use angle::Angle;
pub use hub_motor::{Actuation, HubMotor, HubMotorModel, Inverter, Sensors};
