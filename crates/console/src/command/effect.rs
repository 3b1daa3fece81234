//! What commands do to drives.

use canopen::NodeId;
use host::command::NmtChange;
use master::drive::Command;

/// What a command does to drives, as far as a host has to know it.
#[derive(Clone, Debug, PartialEq)]
pub enum CommandEffect {
    /// It reads.
    None,
    /// It commands a drive.
    OnDrive(NodeId, Command),
    /// It writes an object of a node: object and value, as typed.
    Writes(NodeId, String, String),
    /// It has a node store its parameters.
    Stores(NodeId),
    /// It brings a node to an NMT state.
    Manages(NodeId, NmtChange),
    /// It resets or stops nodes, or commands all of them, by NMT.
    ManagesMore,
    /// It commands every drive, other than to stop.
    OnEveryDrive,
    /// It stops every drive at once.
    StopAll,
    /// It stops every drive by its ramp.
    StopAllByRamp,
}
