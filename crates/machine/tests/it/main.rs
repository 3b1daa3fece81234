//! Machine files and what `check` finds in them. One program: a file each.

mod check;
mod check_motion;
