//! The virtual ZLAC8030L, firmware and physics together, judged from the bus in virtual time.
//!
//! The expected values are in the "ZLAC8030L quick start guide V1.00" (as `docs/drives/zlac8030l.md` reads it and
//! `tests/data/zlac8030l` lists it), in CiA 301 and CiA 402-2, or follows from the motor's published constants by a closed
//! form. One file for each subject; [`bench`] is the table they all work at.

use ferrodrive_tests::bench::zlac8030l as bench;

mod datagrams;
mod determinism;
mod driven_from_outside;
mod drivers;
mod eds_defaults;
mod emergency;
mod energy;
mod fast_motor;
mod firmware;
mod holding;
mod motor_parameters;
mod network;
mod position;
mod power_state;
mod robustness;
mod stopping;
mod supply;
mod terminals;
mod torque;
mod traps;
mod velocity;
mod wheel;
mod wires;
