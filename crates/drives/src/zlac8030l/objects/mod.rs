//! The object table of the description, and in [`effects`] what a write sets in motion.

pub mod effects;

pub use devices::zltech::zlac8030l::objects::*;
