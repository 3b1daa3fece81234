//! What a supervisor reports, in words.

use core::fmt;

use canopen::NodeId;

use super::emcy_log::EmcyRecord;
use super::foreign::Foreign;
use crate::boot::NodeReport;
use crate::core::{Event, NodeSet};

/// Something that happened on a network that is watched.
#[derive(Clone, Debug)]
pub enum SupervisorEvent {
    /// As the network reports it.
    Event(Event),
    /// The heartbeat of a node says that it is in alarm: 04h, of a model with which that does not mean stopped.
    Alarm(NodeId),
    /// An emergency message.
    Emcy(EmcyRecord),
    /// A drive that this master's heartbeat keeps content is out of reach: the heartbeat is held back, so that nothing
    /// starts again unasked when the drive hears it. These drives stop for want of it.
    Held(NodeSet),
    /// All that was lost is back and stands: the heartbeat is sent again.
    Released,
    /// A node came back, with the result of its boot-up. It stands, and is not started until
    /// [`Supervisor::resume`](super::Supervisor::resume).
    Recovered(NodeReport),
    /// A node came back, and could not be stopped: why.
    NotStopped(NodeId, String),
    /// Another master is on the bus.
    Foreign(Foreign),
}

impl SupervisorEvent {
    /// What kind it is, in a word that programs may rely on.
    pub const fn kind(&self) -> &'static str {
        match self {
            Self::Event(Event::BootUp(_)) => "boot_up",
            Self::Event(Event::NmtState(..)) | Self::Alarm(_) => "nmt_state",
            Self::Event(Event::HeartbeatLost(..)) => "heartbeat_lost",
            Self::Event(Event::HeartbeatBack(_)) => "heartbeat_back",
            Self::Event(Event::TwoDevices(..)) => "node_twice",
            Self::Event(_) => "event",
            Self::Emcy(_) => "emcy",
            Self::Held(_) => "heartbeat_held",
            Self::Released => "heartbeat_released",
            Self::Recovered(_) => "recovered",
            Self::NotStopped(..) => "not_stopped",
            Self::Foreign(_) => "another_master",
        }
    }

    /// The node that it is about, if it is about one.
    pub const fn node(&self) -> Option<NodeId> {
        match self {
            Self::Event(
                Event::BootUp(node)
                | Event::NmtState(node, _)
                | Event::HeartbeatLost(node, _)
                | Event::HeartbeatBack(node)
                | Event::TwoDevices(node, _)
                | Event::Emcy(node, _)
                | Event::CyclicStopped(node, _)
                | Event::Unguarded(node, _),
            )
            | Self::Alarm(node)
            | Self::NotStopped(node, _)
            | Self::Foreign(Foreign::SdoRequest(node)) => Some(*node),
            Self::Emcy(record) => Some(record.node),
            Self::Recovered(report) => Some(report.node),
            _ => None,
        }
    }
}

/// A sentence, or several lines for a boot-up.
impl fmt::Display for SupervisorEvent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Event(event @ Event::HeartbeatLost(..)) => {
                write!(f, "{event}: check its supply and its cable; it is booted again when it comes back")
            }
            Self::Event(event) => event.fmt(f),
            Self::Alarm(node) => write!(f, "node {node} is in alarm (heartbeat 04h; it does not mean stopped)"),
            Self::Emcy(record) => record.fmt(f),
            Self::Held(nodes) => {
                f.write_str(
                    "this master withholds its heartbeat until all nodes are back and at rest; without it stops",
                )?;
                let mut before = ": node ";
                for node in nodes.iter() {
                    write!(f, "{before}{node}")?;
                    before = ", ";
                }
                Ok(())
            }
            Self::Released => f.write_str("all nodes are back and at rest: this master sends its heartbeat again"),
            Self::Recovered(report) if report.has_failed() => report.fmt(f),
            Self::Recovered(report) => {
                write!(f, "{report}\n  it is at rest; `resume {}` lets it take part again", report.node)
            }
            Self::NotStopped(node, why) => write!(
                f,
                "node {node} is back, but could not be stopped: {why}. Switch off its supply before going near it; `resume {node}` \
                 tries again"
            ),
            Self::Foreign(foreign) => foreign.fmt(f),
        }
    }
}
