//! A machine of CANopen drives as files: which drives there are, their surroundings and parameters, and what is wrong with a file.
//!
//! Text goes in and values come out, or a sentence that says what is wrong, where, and what is expected. The command line and
//! programs use it alike.
//!
//! ```
//! use machine::file::Machine;
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

pub mod base_drive;
pub mod check;
pub mod dbc;
pub mod file;
pub mod group_move;
pub mod parameters;
