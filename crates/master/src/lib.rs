//! A CANopen master: a sans-IO core, an async face, and intents for drives in physical units.
//!
//! [`core::Core`] is a passive state machine (CiA 301): SDO clients, NMT, heartbeat and EMCY watch, SYNC and PDOs
//! for 127 nodes. [`Network`] shares one between a runner and any number of tasks. Nothing here reads a clock,
//! opens a socket or starts a thread: a runner (a simulated world, a transport loop) brings frames and time.
//!
//! What a person wants is one call:
//!
//! ```
//! use std::time::Duration;
//!
//! use can::Bitrate;
//! use canopen::NodeId;
//! use master::drive::SwitchedOff;
//! use master::units::{Degrees, Rpm};
//! use master::{Drive, MotionOptions, Network};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! // A virtual bus with a drive on it. On a real one, `transport` runs the network.
//! let network = Network::new();
//! let mut world = sim::World::new(Bitrate::K500, 1);
//! world.add_station(network.clone());
//! world.add_drive(4, Box::new(sim::machine::zlac8030l(4, 1)))?;
//! world.run_for(Duration::from_secs(1));
//!
//! let model = devices::model("zlac8030l").ok_or("no such model")?;
//! let drive = Drive::new(network.node(NodeId::new(4).ok_or("no such node")?), model);
//! let position = sim::block_on(&mut world, async {
//!     let loss = drive.guard(SwitchedOff::Leave).await?;
//!     if loss.stops_after().is_none() {
//!         eprintln!("when this program dies, {loss}");
//!     }
//!     let slowly = MotionOptions { speed: Some(Rpm(30.0)), ..MotionOptions::default() };
//!     drive.move_relative(Degrees(90.0), slowly).await?;
//!     drive.release_guard().await?;
//!     Ok::<_, master::Error>(drive.state().await?.position)
//! })??;
//! // 4096 counts are a turn.
//! assert!(position.is_some_and(|position| (position.0 - 1024).abs() < 20));
//! # Ok(())
//! # }
//! ```
//!
//! Machines run on cycles instead: [`Network::next_sync`] waits for SYNC, [`Network::exchange`] reads and writes process data
//! in one go, and a [`cyclic::CyclicDrive`] is stepped once in each cycle:
//!
//! ```
//! # use std::time::Duration;
//! # use can::Bitrate;
//! # use canopen::NodeId;
//! use cia402::ModeOfOperation;
//! use master::cyclic::{CyclicError, CyclicOptions, Demand};
//! # use master::units::Rpm;
//! # use master::{Drive, Network};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let network = Network::new();
//! # let mut world = sim::World::new(Bitrate::K500, 1);
//! # world.add_station(network.clone());
//! # world.add_drive(4, Box::new(sim::machine::zlac8030l(4, 1)))?;
//! # world.run_for(Duration::from_secs(1));
//! # let model = devices::model("zlac8030l").ok_or("no such model")?;
//! # let drive = Drive::new(network.node(NodeId::new(4).ok_or("no such node")?), model);
//! let mode = ModeOfOperation::PROFILE_VELOCITY;
//! let prepare = async {
//!     drive.configure_cyclic(mode).await?;
//!     drive.cyclic(mode, CyclicOptions::default()).await
//! };
//! let mut wheel = sim::block_on(&mut world, prepare)??;
//! network.sync(Some(Duration::from_millis(5)));
//! let state = sim::block_on(&mut world, async {
//!     loop {
//!         let cycle = network.next_sync().await?;
//!         let state = network.exchange(|io| wheel.step(io, Demand::Velocity(Rpm(60.0))));
//!         if cycle.number == 400 || state.refused.is_some() && state.follows {
//!             return Ok::<_, master::NoCycle>(state);
//!         }
//!     }
//! })??;
//! assert!(state.velocity.is_some_and(|Rpm(speed)| (speed - 60.0).abs() < 3.0), "{state}");
//! # Ok(())
//! # }
//! ```
//!
//! A program that dies stops nothing by itself: [`Drive::guard`], which cyclic drives ask for of themselves, arms what a drive has against that (a watch for silence, a
//! heartbeat that this master then produces), and reports what it lacks. While its runner runs, a guarded drive is kept
//! content, whatever the tasks wait for.

mod analysis;
pub mod base;
pub mod boot;
pub mod core;
pub mod cyclic;
pub mod drive;
mod error;
pub mod gateway;
mod gear;
pub mod group;
mod host_loss;
pub mod identify;
mod limits;
mod models;
mod network;
pub mod parameters;
pub mod pdo;
pub mod supervise;
pub mod units;

pub use analysis::{decode, explain, latency, plan};
pub use drive::{Drive, MotionOptions};
pub use error::{Access, Error, HeardNodes, Hints};
pub use gear::{Gear, GearError};
pub use models::Models;
pub use network::{
    DEFAULT_TIMEOUT, Elapsed, Exchange, FrameLog, Network, NextSync, NoCycle, Node, NodeView, Sleep, Wait, join_all,
};
