//! Descriptions from outside the crate. One program: a file each.

mod pages;
mod two_axes;
