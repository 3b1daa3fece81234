//! The test bench around virtual drives: what a machine is ([`machine_file`]), and what people type about it ([`words`],
//! [`models`]).
//!
//! Text goes in and values come out, or a sentence that says what is wrong, where, and what is expected. The command line and
//! programs use it alike.
//!
//! ```
//! use testbench::machine_file::Machine;
//!
//! let machine = Machine::parse("[[drive]]\nmodel = 'zlac8030l'\nnode = 4\nload = { torque_nm = 0.5 }")?;
//! let mut world = machine.build()?;
//! world.run_for(core::time::Duration::from_secs(1));
//! assert!(world.report(4)?.powered);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Deliberately absent: clocks, threads and sockets. Files are read where a name of one is the only thing that a user gives,
//! and only regular ones of bounded size.

pub mod around;
pub mod check;
pub mod control;
pub mod data_sheet;
pub mod dbc;
pub mod decode;
pub mod document;
pub mod events;
pub mod failure;
pub mod machine_file;
pub mod models;
pub mod network;
pub mod parameters;
pub mod recording;
pub mod scenario;
pub mod sweep;
pub mod words;
