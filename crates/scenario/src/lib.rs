//! Scenarios: a machine, what the outer world does to it, what a host does with it, and what is expected, in one file.
//!
//! A [`Scenario`] is read from a text, a [`Runner`] goes through it in virtual time, and an [`Outcome`] has a row for each
//! thing that was asked. The same text and the same seed give the same outcome, to the last frame. Who moves a world by other rules
//! (a served bus) has a [`Execution`] go along with it.
//!
//! ```
//! use std::path::Path;
//! use scenario::{Runner, Scenario};
//!
//! let text = "
//!     [machine]
//!     drive = [{ model = 'zlac8030l', node = 4 }]
//!     [[host]]
//!     do = ['4 velocity 60rpm', '4 stop']
//!     [[expect]]
//!     that = '4 velocity = 60 +- 3'
//! ";
//! let outcome = Runner::new(&Scenario::parse(text, Path::new(""))?, None)?.run();
//! assert!(outcome.passed());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Values (signals, states, faults) are looked at every `sample` of virtual time, 1 ms by default, and at each time
//! that an expectation names; what is about frames is decided at the last bit of the frame, and what is about events when the world
//! reports them.

pub mod command;
pub mod condition;
pub mod entries;
mod execution;
pub mod file;
mod host;
mod junit;
pub mod occurrence;
mod outcome;
mod plan;
mod runner;
mod script;
pub mod sweep;

pub use execution::Execution;
pub use file::Scenario;
pub use junit::junit;
pub use outcome::{Outcome, OutcomeReport, Row, RowKind, Verdict};
pub use runner::{Kept, Runner};
