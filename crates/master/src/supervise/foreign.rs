//! Another master on the bus: frames that only a master sends, and that this one did not.

use core::fmt;
use std::collections::BTreeMap;

use can::Frame;
use canopen::connection_set::Service;
use canopen::{NodeId, connection_set};

/// What another master does. Each is reported once.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Foreign {
    /// It commands NMT states (CiA 301, 7.2.8.3.1).
    Nmt,
    /// It sends SDO requests to a node of this master: an SDO server has one client (CiA 301, 7.2.4.1).
    SdoRequest(NodeId),
    /// It sends a heartbeat under this master's node-ID.
    OwnHeartbeat(NodeId),
}

/// What was seen so far. At most one entry for each node and each kind.
#[derive(Clone, Debug, Default)]
pub(super) struct ForeignMasters {
    seen: BTreeMap<Foreign, Frame>,
}

impl ForeignMasters {
    /// A frame of another station; what it says of another master, if that is new.
    pub(super) fn note(&mut self, frame: &Frame, own: NodeId, is_ours: impl Fn(NodeId) -> bool) -> Option<Foreign> {
        if frame.is_remote() {
            return None;
        }
        let foreign = match Service::of(frame.id())? {
            Service::Nmt => Foreign::Nmt,
            Service::SdoRequest(node) if is_ours(node) => Foreign::SdoRequest(node),
            Service::Heartbeat(node) if node == own => Foreign::OwnHeartbeat(node),
            _ => return None,
        };
        self.seen.insert(foreign, *frame).is_none().then_some(foreign)
    }
}

/// A sentence with what to do.
impl fmt::Display for Foreign {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Nmt => write!(
                f,
                "another master sends NMT commands ({}): nodes may stop or reset at any time; end one of the two masters",
                connection_set::NMT
            ),
            Self::SdoRequest(node) => write!(
                f,
                "another master sends SDO requests to node {node}: the answers to two clients mix, and one overwrites what the \
                 other sets; end one of the two, or have them take turns"
            ),
            Self::OwnHeartbeat(node) => write!(
                f,
                "another station sends heartbeats as node {node}, which is this master: drives that watch this master do not \
                 notice when it dies; give one of the two another node-ID"
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_thing_that_only_a_master_does_is_reported_once() {
        let (own, ours) = (NodeId::MAX, NodeId::new(4).unwrap());
        let mut masters = ForeignMasters::default();
        let mut noted = |frame: &str| {
            let foreign = masters.note(&frame.parse().unwrap(), own, |node| node == ours);
            foreign.map(|foreign| foreign.to_string().split(':').next().unwrap_or_default().to_owned())
        };
        assert_eq!(noted("000#0104").as_deref(), Some("another master sends NMT commands (000)"));
        assert_eq!(noted("000#8000"), None);
        assert_eq!(noted("604#4000100000000000").as_deref(), Some("another master sends SDO requests to node 4"));
        assert_eq!((noted("604#4000100000000000"), noted("605#4000100000000000")), (None, None));
        assert!(noted("77F#05").is_some_and(|text| text.contains("as node 127, which is this master")));
        // What devices send, SYNC too (CiA 301, 7.2.5: any device may produce it), and what asks.
        assert_eq!(
            (noted("704#05"), noted("584#4300100000000000"), noted("080#"), noted("77F#R")),
            (None, None, None, None)
        );
    }
}
