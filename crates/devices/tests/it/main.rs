//! Descriptions from outside the crate. One program: a file each.

mod two_axes;
