//! The commands, one file each (commands that share everything but a word share a file).

pub(crate) mod completions;
pub(crate) mod dump;
pub(crate) mod nmt;
pub(crate) mod objects;
pub(crate) mod scan;
pub(crate) mod sdo;
