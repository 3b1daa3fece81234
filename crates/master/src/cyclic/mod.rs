//! Drives that are moved cycle by cycle, by process data (CiA 402-2, clauses 11 to 15; CiA 301, 7.2.2).
//!
//! In: the mapping that is read from the device, and a [`Demand`] in each cycle of SYNC. Out: controlword and set-point in the
//! device's RPDOs, and what it shows as a [`CyclicState`]. SDO is used for parameters, before: limits, units, the mode; and
//! for the controlword where no RPDO carries it. How a program that stays away is noticed: [`crate::core::CycleLoss`].

mod demand;
mod drive;
mod explain;
mod open;
mod rest;
mod sequence;
mod standstill;
mod target;
mod traffic;

pub use demand::{Bound, CyclicState, Demand, Refusal};
pub use drive::CyclicDrive;
pub use open::{CyclicError, CyclicOptions};
pub use rest::NotAtRest;
pub(crate) use rest::at_rest;
pub(crate) use rest::seen_to_stand;
