//! A virtual CAN bus and virtual machines in deterministic time.
//!
//! [`World`] holds drives joined to their physics ([`VirtualDrive`], built in [`machine`]), other stations and the bus
//! ([`wire`]), and moves time from event to event. The same seed and the same calls give the same
//! frames at the same nanoseconds on every run; a clone of a world resumes with identical results.
//! [`block_on`] runs a future against a world, [`command`] is the text protocol of `ferrodrive sim`,
//! [`pace`] ties virtual time to a wall clock that the caller reads.
//!
//! ```
//! use can::{Bitrate, Frame};
//! use canopen::NodeId;
//! use core::time::Duration;
//! use sim::World;
//! use sim::machine::{Order, order};
//!
//! // A drive as it is delivered, and an adapter to send and hear frames with.
//! let model = devices::model("zlac8030l").ok_or("no such model")?;
//! let node = NodeId::new(4).ok_or("no such node")?;
//! let mut world = World::new(Bitrate::K500, 1);
//! world.add_drive(4, order(model, &Order::new(model, node, Bitrate::K500))?)?;
//! let adapter = world.add_probe();
//! world.run_for(Duration::from_secs(1));
//! assert_eq!(world.poll_received(adapter).map(|(_, frame)| frame), Some("704#00".parse()?)); // boot-up
//!
//! // Read the statusword, and what a person beside the machine could measure.
//! world.send(adapter, "604#4041600000000000".parse()?)?;
//! world.run_for(Duration::from_millis(10));
//! let (at, answer) = world.poll_received(adapter).ok_or("no answer")?;
//! assert_eq!(answer.data()[..4], [0x4B, 0x41, 0x60, 0x00]);
//! assert!(at.as_secs_f64() < 1.01 && world.report(4)?.velocity_rpm == 0.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Deliberately absent: clocks, threads, sockets and files.

mod block_on;
pub mod command;
pub mod coupling;
mod drive;
pub mod events;
pub mod fault;
pub mod json;
pub mod machine;
mod mechanics;
mod nmt_reset;
pub mod pace;
mod prng;
pub mod recorder;
mod refused;
pub mod seeds;
pub mod stimulus;
pub mod task;
pub mod wire;
mod world;

pub use block_on::{BlockOnError, block_on, block_on_for, pass_beside, run_beside};
pub use coupling::{BodyKind, BodyState, CoupledShaft, Coupling, CouplingError};
pub use devices::AxisId;
pub use drive::{
    Brake, Levels, MotorData, OutputShaft, PowerPhase, Report, StepperData, VirtualDrive, VirtualDriveClone,
};
pub use drives::{Fidelity, RegisterError};
pub use mechanics::Mechanics;
pub use plant::attachment::OUTPUT_WHEEL_SHARE;
pub use plant::coupled::{ExternalModel, Rule};
pub use plant::gear::GearModel;
pub use plant::mechanics::RotorModel;
pub use plant::physics::Physics;
pub use prng::Prng;
pub use refused::Refused;
pub use stimulus::{
    BodyStimulus, Component, LoadPart, Place, PulseTrain, Source, Stimulus, SwitchRange, TemperatureSensor,
};
pub use world::{
    AnyStation, Digest, ExchangeError, ExternalShaft, FrameLog, Given, LoneShaft, StationId, StoredImage, World,
    WorldError,
};
