//! The programs of `docs/handbook`, which run here, and the pages, which have to show what is in the tree.
#![allow(missing_docs, reason = "programs as a user writes them")]

mod described_drive;
mod own_station;
mod pages;
mod two_axes;
mod virtual_time;
