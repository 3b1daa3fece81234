//! Planners and control loops. One program: a file each.

mod closed_loop;
mod control;
mod jerk;
mod planners;
mod rig;
