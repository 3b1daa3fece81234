//! What needs no network: what frames say, how late they may come, and what follows from what was read of a drive.
//!
//! Everything here is a pure function or a value that is given frames. What reads a drive by SDO for it is beside the drive:
//! `drive/observe.rs` for [`explain`], `cyclic/traffic.rs` for [`plan`].

pub mod decode;
pub mod explain;
pub mod latency;
pub mod plan;
