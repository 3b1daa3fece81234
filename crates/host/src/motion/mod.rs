//! What a session moves: groups, homing, limits of speed, what has no guard, frames sent as they are, and how it is stopped.

pub(crate) mod group;
pub(crate) mod group_run;
pub(crate) mod guarding;
pub(crate) mod homing;
mod raw;
pub(crate) mod speed_limit;
pub(crate) mod stopping;
