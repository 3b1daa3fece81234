use core::fmt;
use std::time::Duration;

use canopen::{AbortCode, NmtState, NodeId};

/// Direction of an SDO request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// Upload.
    Read,
    /// Download.
    Write,
}

impl fmt::Display for Access {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Read => "read",
            Self::Write => "write",
        })
    }
}

/// What the master knows when a node is silent. Prints as the likeliest cause and what to do.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Hints {
    /// The request never left the master.
    pub unsent: bool,
    /// The state that the node must be in by its last heartbeat or the NMT command sent since.
    pub nmt_state: Option<NmtState>,
    /// Time since any frame of the node.
    pub silent_for: Option<Duration>,
    /// The other nodes that have been heard.
    pub others: HeardNodes,
}

/// How many of the nodes that are heard a message names.
const MOST_NAMED: usize = 5;

/// Nodes that have been heard: how many, and the lowest node-IDs. As small as that, since every error may have it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct HeardNodes {
    lowest: [u8; MOST_NAMED],
    count: u8,
}

impl FromIterator<NodeId> for HeardNodes {
    /// Of node-IDs in ascending order.
    fn from_iter<I: IntoIterator<Item = NodeId>>(nodes: I) -> Self {
        let mut others = Self::default();
        for node in nodes {
            if let Some(place) = others.lowest.get_mut(usize::from(others.count)) {
                *place = node.raw();
            }
            others.count = others.count.saturating_add(1);
        }
        others
    }
}

/// `Node 4`, `Nodes 1, 2, 3, 4, 5 and 2 more`.
impl fmt::Display for HeardNodes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.count == 1 { "Node" } else { "Nodes" })?;
        for (position, node) in self.lowest.iter().take(self.count.into()).enumerate() {
            write!(f, "{} {node}", if position == 0 { "" } else { "," })?;
        }
        match usize::from(self.count).saturating_sub(MOST_NAMED) {
            0 => Ok(()),
            more => write!(f, " and {more} more"),
        }
    }
}

impl Hints {
    /// What to check where a node does not answer, in a clause: interface, cable, node-ID, NMT state.
    pub const fn check(&self) -> &'static str {
        match (self.unsent, self.nmt_state, self.silent_for) {
            (true, ..) => {
                "check that the CAN interface is up and that another node acknowledges frames (cable, bit rate, termination)"
            }
            (_, Some(NmtState::Stopped), _) => {
                "send NMT pre-operational or start. Some drives' heartbeats show this state in an alarm: then check supply and cable"
            }
            (_, _, Some(_)) => "check whether it has lost its supply or its cable, or is too busy to answer in time",
            (_, _, None) if self.others.count > 0 => {
                "check its node-ID and its supply (a scan shows who is there); if it is in the NMT state stopped, it answers \
                 after NMT start"
            }
            (_, _, None) => {
                "check supply, cable, termination and bit rate; if the node is in the NMT state stopped, it answers after NMT \
                 start"
            }
        }
    }
}

impl fmt::Display for Hints {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.unsent, self.nmt_state, self.silent_for) {
            (true, ..) => f.write_str("The request never left this computer")?,
            (_, Some(NmtState::Stopped), _) => f.write_str(
                "By its last heartbeat, or the last NMT command to it, it is stopped, where SDO does not exist",
            )?,
            (_, _, Some(age)) => write!(f, "It was last heard {} ms ago", age.as_millis())?,
            (_, _, None) if self.others.count > 0 => {
                write!(f, "{} can be heard on the bus, but this one has never been", self.others)?;
            }
            (_, _, None) => f.write_str("Nothing at all has been heard on the bus")?,
        }
        write!(f, ": {}", self.check())
    }
}

/// What to do about an abort code.
pub(super) fn advice(code: AbortCode, access: Access) -> &'static str {
    match code {
        AbortCode::NO_SUCH_OBJECT | AbortCode::NO_SUCH_SUB_INDEX => {
            "This model has no such object: check index and \
             sub-index against its object dictionary"
        }
        AbortCode::READ_ONLY => "The object can only be read: `ferrodrive objects NODE` shows which can be written",
        AbortCode::WRITE_ONLY => "The object can only be written: `ferrodrive objects NODE` shows which can be read",
        AbortCode::INVALID_VALUE | AbortCode::VALUE_TOO_HIGH | AbortCode::VALUE_TOO_LOW => {
            "Give a value within the limits of its object dictionary"
        }
        AbortCode::LENGTH_MISMATCH | AbortCode::TOO_LONG | AbortCode::TOO_SHORT => {
            "The value was sent with another length than the object has: check its data type"
        }
        AbortCode::NOT_MAPPABLE | AbortCode::PDO_TOO_LONG => "Map other objects, or fewer of them, into this PDO",
        AbortCode::DEVICE_STATE | AbortCode::LOCAL_CONTROL | AbortCode::CANNOT_TRANSFER => {
            "The drive does not accept this in its present state: look at its statusword, and try it disabled"
        }
        AbortCode::UNSUPPORTED_ACCESS => match access {
            Access::Read => "The object cannot be read now",
            Access::Write => "The object cannot be changed now: a PDO mapping may have to be disabled first",
        },
        AbortCode::HARDWARE_ERROR => "The drive's parameter memory may be faulty",
        _ => "Look the code up in the drive's manual",
    }
}
