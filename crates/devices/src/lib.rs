//! What devices are, as const data: object tables, faults, units, rules, and where they depart from the standard.
//!
//! A [`Description`] is what masters, tools and the firmware itself read about a model. The makers' folders hold the manuals'
//! rows. There is no behaviour here: firmware is in crate `drives`.
#![no_std]

#[cfg(test)]
extern crate std;

mod description;
pub mod faults;
pub mod mjoint;
pub mod row;
pub mod servo;
pub mod variant;
pub mod zltech;

pub use description::*;
