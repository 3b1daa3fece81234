//! What people type, read into what is meant: nodes, objects, values, drives.
//!
//! Every error says what was wrong, what is expected, and shows an example; clap prints it with exit status 2.

pub mod drive;
pub mod mode;
pub mod node;
pub mod object;
pub mod selection;
pub mod suggest;
pub mod unit;
pub mod value;
