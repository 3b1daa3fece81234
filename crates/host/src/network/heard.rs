//! What others were heard to send during a scan: who is there beside those that answer, and who else is a master.

use std::collections::BTreeMap;

use can::Frame;
use canopen::NodeId;
use canopen::connection_set::Service;
use master::decode::{Decoded, Decoder};
use serde::Serialize;

/// Kinds of frames that are distinguished; further ones are counted as one.
const MOST: usize = 200;

/// Frames of one service and node that others have sent, counted.
#[derive(Clone, Debug, Serialize, PartialEq, Eq)]
pub struct Heard {
    /// Its service, as `dump --service` takes it.
    pub service: &'static str,
    /// Who sends it, or whom it is for.
    pub node: Option<u8>,
    /// Number of its frames.
    pub count: u64,
    /// What it means for a scan.
    pub text: String,
}

/// Counts what is heard.
#[derive(Debug, Default)]
pub struct Counted {
    kinds: BTreeMap<HeardKind, (u64, String)>,
    others: u64,
}

/// In the order in which they are reported: other masters first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum HeardKind {
    /// An NMT command, an SDO request, an RPDO, an LSS request: only a master sends these.
    Nmt,
    SdoRequest(NodeId),
    Rpdo(NodeId),
    LssMaster,
    Sync,
    Time,
    Emcy(NodeId),
    BootUp(NodeId),
    Heartbeat(NodeId),
    Tpdo(NodeId),
    LssSlave,
    /// Outside the predefined connection set: by its identifier.
    Id(u32),
}

impl HeardKind {
    fn of(frame: &Frame, decoded: &Decoded) -> Option<Self> {
        Some(match Service::of(frame.id()) {
            Some(Service::Nmt) => Self::Nmt,
            Some(Service::Sync) => Self::Sync,
            Some(Service::Time) => Self::Time,
            Some(Service::Emcy(node)) => Self::Emcy(node),
            Some(Service::Tpdo(_, node)) => Self::Tpdo(node),
            Some(Service::Rpdo(_, node)) => Self::Rpdo(node),
            Some(Service::SdoRequest(node)) => Self::SdoRequest(node),
            // The answers to the scan itself.
            Some(Service::SdoReply(_)) => return None,
            Some(Service::Heartbeat(node)) if matches!(decoded, Decoded::BootUp(_)) => Self::BootUp(node),
            Some(Service::Heartbeat(node)) => Self::Heartbeat(node),
            Some(Service::LssMaster) => Self::LssMaster,
            Some(Service::LssSlave) => Self::LssSlave,
            None => Self::Id(frame.id().raw()),
        })
    }

    const fn node(self) -> Option<NodeId> {
        match self {
            Self::SdoRequest(node)
            | Self::Rpdo(node)
            | Self::Emcy(node)
            | Self::BootUp(node)
            | Self::Heartbeat(node)
            | Self::Tpdo(node) => Some(node),
            _ => None,
        }
    }

    const fn service(self) -> &'static str {
        match self {
            Self::Nmt => "nmt",
            Self::SdoRequest(_) => "sdo",
            Self::Rpdo(_) | Self::Tpdo(_) => "pdo",
            Self::LssMaster | Self::LssSlave => "lss",
            Self::Sync => "sync",
            Self::Time => "time",
            Self::Emcy(_) => "emcy",
            Self::BootUp(_) | Self::Heartbeat(_) => "heartbeat",
            Self::Id(_) => "other",
        }
    }

    /// In words; `latest` is the latest such frame in words.
    fn text(self, latest: &str) -> String {
        match self {
            Self::Nmt => format!("another master sends NMT commands, the latest: {latest}"),
            Self::SdoRequest(node) => format!("another master asks node {node} by SDO: answers may be mixed up"),
            Self::Rpdo(node) => format!("another master sends PDOs to node {node}"),
            Self::LssMaster => format!("another master sends LSS requests, the latest: {latest}"),
            Self::Sync => "another node produces SYNC".to_owned(),
            Self::Time => "another node produces TIME".to_owned(),
            Self::Emcy(_) => latest.to_owned(),
            Self::BootUp(node) => format!("node {node} has booted during the scan"),
            Self::Heartbeat(node) => format!("heartbeat of node {node}"),
            Self::Tpdo(node) => format!("node {node} sends PDOs"),
            Self::LssSlave => "an LSS slave answers another master".to_owned(),
            Self::Id(id) => {
                format!("frames with the identifier {id:X}h, which has no meaning as delivered (CiA 301, 7.3.3)")
            }
        }
    }
}

impl Counted {
    /// Takes a frame that another station has sent.
    pub fn note(&mut self, decoder: &mut Decoder, frame: &Frame) {
        let decoded = decoder.decode(frame);
        let Some(kind) = HeardKind::of(frame, &decoded) else { return };
        let known = self.kinds.len();
        match self.kinds.get_mut(&kind) {
            Some((count, latest)) => {
                *count += 1;
                // Words are made for what is shown with its words.
                if matches!(kind, HeardKind::Nmt | HeardKind::Emcy(_) | HeardKind::LssMaster) {
                    *latest = decoded.to_string();
                }
            }
            None if known == MOST => self.others += 1,
            None => {
                self.kinds.insert(kind, (1, decoded.to_string()));
            }
        }
    }

    /// What was heard, but for the heartbeats of nodes that are listed anyway.
    pub fn reported(self, is_listed: impl Fn(NodeId) -> bool) -> Vec<Heard> {
        let kinds = self.kinds.into_iter().filter(|(kind, _)| match kind {
            HeardKind::Heartbeat(node) => !is_listed(*node),
            _ => true,
        });
        let mut reported: Vec<Heard> = kinds
            .map(|(kind, (count, latest))| Heard {
                service: kind.service(),
                node: kind.node().map(NodeId::raw),
                count,
                text: kind.text(&latest),
            })
            .collect();
        if self.others > 0 {
            reported.push(Heard {
                service: "other",
                node: None,
                count: self.others,
                text: "frames of further kinds; ferrodrive dump shows them".to_owned(),
            });
        }
        reported
    }
}

impl Heard {
    /// One line for people: `heard: ` with what it means, and how many frames.
    pub fn line(&self) -> String {
        let times = if self.count == 1 { String::new() } else { format!(" ({} frames)", self.count) };
        format!("heard: {}{times}", self.text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn heard(frames: &[&str]) -> Vec<String> {
        let mut decoder = Decoder::new();
        let mut counted = Counted::default();
        frames.iter().for_each(|frame| counted.note(&mut decoder, &frame.parse().unwrap()));
        counted.reported(|node| node.raw() == 4).iter().map(Heard::line).collect()
    }

    #[test]
    fn other_masters_are_reported_first_and_listed_heartbeats_and_answers_are_not() {
        // CiA 301, 7.3.3: 584h is an SDO answer, 704h a heartbeat, 205h RPDO 1, 606h an SDO request, 187h TPDO 1.
        let lines = heard(&[
            "584#4B41600037020000",
            "704#05",
            "080#",
            "080#",
            "187#0011",
            "205#0F00",
            "606#4041600000000000",
            "000#0107",
        ]);
        assert_eq!(lines.len(), 5, "{lines:?}");
        assert!(lines[0].contains("another master sends NMT commands") && lines[0].contains("node 7"), "{lines:?}");
        assert!(lines[1].contains("asks node 6 by SDO"), "{lines:?}");
        assert!(lines[2].contains("PDOs to node 5"), "{lines:?}");
        assert_eq!(lines[3], "heard: another node produces SYNC (2 frames)");
        assert_eq!(lines[4], "heard: node 7 sends PDOs");
    }

    #[test]
    fn a_node_that_boots_or_reports_an_error_is_reported_and_kinds_are_bounded() {
        let lines = heard(&["704#00", "084#1023010000000000"]);
        // CiA 301, table 26: 23xxh is a current on the device's output side.
        assert!(lines[0].contains("node 4") && lines[0].contains("2310h"), "{lines:?}");
        assert_eq!(lines[1], "heard: node 4 has booted during the scan");
        let many: Vec<String> = (0..MOST + 50).map(|id| format!("{:08X}#00", 0x10000 + id)).collect();
        let lines = heard(&many.iter().map(String::as_str).collect::<Vec<_>>());
        assert_eq!(lines.len(), MOST + 1);
        assert_eq!(lines[MOST], "heard: frames of further kinds; ferrodrive dump shows them (50 frames)");
    }
}
