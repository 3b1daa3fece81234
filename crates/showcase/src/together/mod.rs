//! The drives together: the three models on one bus, moved by the same calls of the master, and three joints that a host
//! leads point by point (M Robot Joint Motor CanOpen Manual, 5.10.3).

pub(super) mod intents;
pub(super) mod interpolation;
