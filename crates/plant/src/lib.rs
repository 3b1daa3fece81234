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
//!
//! ```
//! use plant::{Actuation, Angle, HubMotor, HubMotorModel, Inverter};
//!
//! // A wheel motor at rest on 48 V at 20 °C. Wire U stands 2 % of the bus above V and W: the field points along U, where the
//! // magnets are, so nothing turns, and the resistances of winding and switches limit the current (space vector: two thirds of
//! // the difference).
//! let model = HubMotorModel::ZLLG65ASM250_L;
//! let mut motor = HubMotor::new(model, Angle::default(), 48.0, 20.0);
//! let along_u = Actuation { inverter: Inverter::Driven([0.52, 0.5, 0.5]), ..Actuation::default() };
//! for _ in 0..2_000 {
//!     motor.step(50e-6, &along_u);
//! }
//! let [u, v, w] = motor.sense().phase_current_a;
//! let expected_a = 2.0 / 3.0 * 0.02 * 48.0 / (model.pmsm.resistance_ohm + model.rig.switch_resistance_ohm);
//! assert!((u - expected_a).abs() < 0.005 * expected_a, "{u} {expected_a}");
//! assert!((u + v + w).abs() < 1e-9);
//! ```
#![no_std]

pub mod absolute_encoder;
pub mod angle;
pub mod attachment;
pub mod brake;
pub mod clamp;
pub mod cogging;
pub mod coupled;
pub mod current_loop;
pub mod encoder;
pub mod field_loop;
pub mod free_run;
pub mod gear;
pub mod hall;
pub mod hub_motor;
pub mod joint_motor;
pub mod mechanics;
pub mod motor;
pub mod physics;
pub mod pmsm;
pub mod rest;
pub mod rig;
pub mod shaft;
pub mod stepper;
pub mod stepper_motor;
pub mod supply;
pub mod thermal;

mod dq;
mod flows;
mod hub_motors;
mod joining;
mod joint_motors;
mod regulated;
mod servo_motors;
mod stepper_long;
mod stepper_motors;

pub use angle::Angle;
pub use free_run::FreeRun;
pub use hub_motor::{Actuation, HubMotor, HubMotorModel, Inverter, Sensors};
pub use joint_motor::{JointMotor, JointMotorModel};
pub use motor::Motor;
pub use rig::Rig;
pub use stepper::Bridges;
pub use stepper_motor::{StepperMotor, StepperMotorModel};
