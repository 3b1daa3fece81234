//! CANopen motor drives, virtual and real, for programs and tests: the parts of Ferrodrive under one name.
//!
//! A test of your own software against a virtual drive, in virtual time:
//!
//! ```
//! use ferrodrive::can::Bitrate;
//! use ferrodrive::canopen::NodeId;
//! use ferrodrive::devices;
//! use ferrodrive::master::units::{Degrees, Rpm};
//! use ferrodrive::master::{Drive, MotionOptions, Network};
//! use ferrodrive::sim::machine::{Order, order};
//! use ferrodrive::sim::{World, block_on};
//! use std::time::Duration;
//!
//! // A bus with one drive on it, and a master as one more station.
//! let model = devices::model("m4230e17b50").ok_or("no such model")?;
//! let id = NodeId::new(1).ok_or("no such node")?;
//! let mut world = World::new(Bitrate::M1, 1);
//! world.add_drive(1, order(model, &Order::new(model, id, Bitrate::M1))?)?;
//! let network = Network::new();
//! world.add_station(network.clone());
//! world.run_for(Duration::from_secs(1)); // the drive boots
//!
//! // The same code runs on a real bus; see `transport::run_station`.
//! let drive = Drive::new(network.node(id), model);
//! let slowly = MotionOptions { speed: Some(Rpm(60.0)), ..MotionOptions::default() };
//! block_on(&mut world, drive.move_relative(Degrees(90.0), slowly))??;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! | you want to | begin at |
//! |---|---|
//! | test software against virtual drives | [`sim::World`], [`sim::block_on`] |
//! | describe a machine in a file | [`machine::file`] |
//! | move drives, virtual or real | [`master::Drive`], [`master::Network`] |
//! | let several people or programs move drives, each held by what it shows of life | [`host::Host`], [`studio::app`] |
//! | reach a bus: socketcand, slcan, a log | [`transport::BusSpec`], [`transport::run_station`] |
//! | read and write log files | [`canlog::LogReader`], [`canlog::LogWriter`] |
//! | serve a virtual bus to other programs | [`serve::world::ServedWorld`], [`transport::Hub`], [`transport::run_world`] |
//! | show a run live to Foxglove, Lichtblick or PlotJuggler | [`foxglove::Server`] |
//! | know what a device is: objects, units, faults | [`devices::Description`] |
//! | read, check and write EDS and DCF files | [`eds::Eds`] |
//! | test a device for conformance | [`conform::Suite`] |
//! | put a drive or a bus into another simulator | [`fmu::instance`] |
//! | put CANopen or CiA 402 into firmware of your own | [`canopen::node`], [`cia402`], [`motion`]; all `no_std` |
//! | read or write frames | [`can::Frame`] |
//!
//! The binary of this package is the command line: `ferrodrive --help`. The crates stand by themselves too, as
//! `ferrodrive-can`, `ferrodrive-sim` and so on: with this one come the command line's dependencies, with those only what
//! each needs.
//!
//! The project's pages: `docs/handbook` shows how software is tested with it and how it grows by an object or a drive;
//! `ARCHITECTURE.md` shows how the crates fit together.

#[doc(inline)]
pub use {
    can, canlog, canopen, cia402, conform, console, devices, drives, eds, fmu, foxglove, host, machine, master, motion,
    plant, plot, recording, scenario, serve, showcase, sim, slcan, studio, transport, tune, words,
};
