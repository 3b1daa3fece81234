//! The control connection, a machine file made by looking at a bus, parameters that are proved; clients that share a network. One
//! program: a file each.

mod capture;
mod capture_motion;
mod clients;
mod control;
mod follow;
mod init;
mod params;
mod stopping;
mod tune;
mod tune_capture;
mod tune_joint;
mod tune_named;
mod tune_ramps;
mod tune_random;
mod tune_rate;
mod tune_trial;
