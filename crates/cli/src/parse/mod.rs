//! What people type, read into what is meant: nodes, objects, values, drives.
//!
//! Every error says what was wrong, what is expected, and shows an example; clap prints it with exit status 2.

pub(crate) mod drive_spec;
pub(crate) mod node;
pub(crate) mod object;
pub(crate) mod suggest;
pub(crate) mod unit;
pub(crate) mod value;
