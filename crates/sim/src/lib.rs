//! A virtual CAN bus and virtual machines in deterministic time.
//!
//! [`World`] holds drives joined to their physics ([`VirtualDrive`], built in [`machine`]), other stations and the bus
//! ([`wire`]), and moves time from event to event. The same seed and the same calls give the same
//! frames at the same nanoseconds on every run; a clone of a world resumes with identical results.
//! [`block_on`] runs a future against a world, [`command`] is the text protocol of `ferrodrive sim`,
//! [`pace`] ties virtual time to a wall clock that somebody else reads.
//!
//! Deliberately absent: clocks, threads, sockets and files.

mod block_on;
pub mod command;
mod drive;
pub mod fault;
pub mod json;
pub mod machine;
pub mod pace;
mod prng;
pub mod recorder;
pub mod wire;
mod world;

pub use block_on::{BlockOnError, block_on, block_on_for};
pub use drive::{
    Brake, Component, Levels, OutputShaft, PulseTrain, Refused, Report, Source, SwitchRange, TemperatureSensor,
    VirtualDrive, VirtualDriveClone,
};
pub use drives::RegisterError;
pub use prng::Prng;
pub use world::{AnyStation, Digest, FrameLog, StationId, StoredImage, World, WorldError};
