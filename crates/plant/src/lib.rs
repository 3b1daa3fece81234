//! Physics of motors, loads, supplies and sensors, in SI units and double precision.
//!
//! What goes in is what a drive's power stage does ([`hub_motor::Actuation`], [`stepper::Bridges`],
//! [`joint_motor::Actuation`]), what comes out is what its sensors read (`Sensors` of the same modules). A part is
//! a *model* (constants that never change while it runs) and *data* (its small, cloneable state); `model.step(&mut
//! data, ..)` moves it by one time step.
//!
//! The same input gives the same bits on every machine: only IEEE 754 basic operations and `libm` are used, and
//! nothing here reads a clock or a random source. The crate knows nothing of drives, controllers or CAN.
//!
//! Three compositions: [`hub_motor`] is a [`pmsm`] with incremental encoder and Hall
//! sensors, [`stepper_motor`] a two-phase [`stepper`] without any, [`joint_motor`] a [`pmsm`] with a battery-backed
//! [`absolute_encoder`] behind a [`gear`]. Each is on a [`rig`]: load, power stage, supply, heat and the book of energies.
#![no_std]

pub mod absolute_encoder;
pub mod angle;
pub mod brake;
pub mod clamp;
pub mod cogging;
pub mod encoder;
pub mod gear;
pub mod hall;
pub mod hub_motor;
pub mod joint_motor;
pub mod mechanics;
pub mod pmsm;
pub mod rig;
pub mod stepper;
pub mod stepper_motor;
pub mod supply;
pub mod thermal;

mod hub_motors;
mod joint_motors;
mod servo_motors;
mod stepper_motors;

pub use angle::Angle;
pub use hub_motor::{Actuation, HubMotor, HubMotorModel, Inverter, Sensors};
pub use joint_motor::{JointMotor, JointMotorModel};
pub use rig::Rig;
pub use stepper::Bridges;
pub use stepper_motor::{StepperMotor, StepperMotorModel};
