//! The virtual ZLIM42-C, firmware and physics together, judged from the bus in virtual time.
//!
//! The expected values are in the "ZLIM42-C user manual V1.03" (as `docs/drives/zlim42c.md` reads it and
//! `tests/data/zlim42c` lists it), in CiA 301 and CiA 402-2, or follows from the motor's published constants by a closed
//! form. One file for each subject; [`bench`] is the table they all work at.

use ferrodrive_tests::bench::zlim42c as bench;

mod address;
mod choices;
mod current;
mod datagrams;
mod driven;
mod faults;
mod homing;
mod limits;
mod motion;
mod objects;
mod power_state;
mod pull_out;
mod robustness;
mod step_loss;
mod stops;
mod supply;
mod terminals;
