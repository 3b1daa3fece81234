//! A CANopen master: a sans-IO core, an async face, and intents for drives in physical units.
//!
//! [`core::Core`] is a passive state machine (CiA 301): SDO clients, NMT, heartbeat and EMCY watch, SYNC and PDOs
//! for 127 nodes. [`Network`] shares one between a runner and any number of tasks. Nothing here reads a clock,
//! opens a socket or starts a thread: a runner (a simulated world, a transport loop) brings frames and time.
//!
//! ```no_run
//! # async fn example() -> Result<(), Box<dyn std::error::Error>> {
//! use canopen::NodeId;
//! use master::drive::SwitchedOff;
//! use master::units::{Degrees, Rpm};
//! use master::{Drive, MotionOptions, Network};
//!
//! let network = Network::new(); // a clone of it goes to the runner
//! let model = devices::model("zlac8030l").ok_or("no such model")?;
//! let node = network.node(NodeId::new(4).ok_or("no such node")?);
//! let drive = Drive::new(node, model);
//! let loss = drive.guard(SwitchedOff::Leave).await?;
//! if loss.stops_after().is_none() {
//!     eprintln!("when this program dies, {loss}");
//! }
//! let slowly = MotionOptions { speed: Some(Rpm(30.0)), ..MotionOptions::default() };
//! drive.move_relative(Degrees(90.0), slowly).await?;
//! drive.release_guard().await?;
//! # Ok(())
//! # }
//! ```
//!
//! A program that dies stops nothing by itself: [`Drive::guard`] arms what a drive has against that (a watch for silence, a
//! heartbeat that this master then produces), and tells what it has not. While its runner runs, a guarded drive is kept
//! content, whatever the tasks wait for.

pub mod core;
pub mod cyclic;
pub mod decode;
pub mod drive;
mod error;
mod host_loss;
pub mod identify;
mod limits;
mod models;
mod network;
pub mod pdo;
pub mod units;

pub use drive::{Drive, MotionOptions};
pub use error::{Access, Error, Hints};
pub use models::Models;
pub use network::{
    DEFAULT_TIMEOUT, Elapsed, Exchange, Network, NextSync, NoCycle, Node, NodeView, Sleep, Wait, join_all,
};
