//! The commands, one file each (commands that share everything but a word share a file).

pub(crate) mod completions;
pub(crate) mod dcf;
pub(crate) mod demo;
pub(crate) mod departures;
pub(crate) mod drive;
pub(crate) mod dump;
pub(crate) mod eds;
pub(crate) mod events;
pub(crate) mod home;
pub(crate) mod man_pages;
pub(crate) mod motion;
pub(crate) mod nmt;
pub(crate) mod objects;
pub(crate) mod plot;
pub(crate) mod readings;
pub(crate) mod run;
pub(crate) mod scan;
pub(crate) mod sdo;
pub(crate) mod sim;
pub(crate) mod store;
pub(crate) mod world;
