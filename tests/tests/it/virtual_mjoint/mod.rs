//! The virtual M joint, firmware and physics together, judged from the bus in virtual time.
//!
//! The expected values are in the "M Robot Joint Motor CanOpen Manual" (as `docs/drives/mjoint.md` reads it and
//! `tests/data/mjoint` lists it), in CiA 301, or follows from the motor's published constants by a closed form. One file
//! for each subject; [`bench`] is the table they all work at.

use ferrodrive_tests::bench::mjoint as bench;

mod alarms;
mod communication;
mod components;
mod datagrams;
mod firmware;
mod homing;
mod hosts_of_real_joints;
mod interpolation;
mod motion;
mod objects;
mod power_on;
mod pulses;
mod ratings;
mod reducer;
mod robustness;
