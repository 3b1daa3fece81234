//! One frame, or one whole SDO transfer, as it is shown.

use std::collections::BTreeMap;
use std::time::Duration;

use can::{Frame, Instant};
use canopen::NodeId;
use canopen::pdo::Direction;
use master::decode::{Decoded, Sdo, SdoStep, Side};
use serde::Serialize;

use can::BusFrame;

/// A line of the trace.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct TraceLine {
    /// Number of the frame, from 0 in bus order.
    pub(super) number: u64,
    /// Bus time.
    pub(super) at_s: f64,
    /// The sender, as far as known: `studio`, `node 4`, `others`.
    pub(super) from: String,
    /// COB-ID, hexadecimal.
    pub(super) id: String,
    /// Its bytes, hexadecimal.
    pub(super) data: String,
    /// Its service.
    pub(super) kind: &'static str,
    /// The one node concerned.
    pub(super) node: Option<u8>,
    pub(super) text: String,
    /// Duration of a whole transfer, from its first frame to its last, if that was seen.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) took_ms: Option<f64>,
}

impl TraceLine {
    /// A frame.
    pub(super) fn of_frame(number: u64, passed: &BusFrame, decoded: &Decoded) -> Self {
        Self {
            number,
            at_s: (passed.at - Instant::ZERO).as_secs_f64(),
            from: sender(passed.own, decoded),
            id: passed.frame.id().to_string(),
            data: bytes(&passed.frame),
            kind: decoded.service().word(),
            node: decoded.node().map(NodeId::raw),
            text: decoded.to_string(),
            took_ms: None,
        }
    }

    /// A whole transfer, from the frame that ends it; `None` from any other.
    pub(super) fn of_transfer(
        number: u64,
        passed: &BusFrame,
        decoded: &Decoded,
        sdo: &Sdo,
        begun: Option<Begun>,
    ) -> Option<Self> {
        let text = sdo.transfer()?;
        let line = Self::of_frame(number, passed, decoded);
        let from = match begun {
            Some(Begun { own: true, .. }) => OWN.into(),
            Some(_) => OTHERS.into(),
            None => line.from,
        };
        Some(Self { text, from, took_ms: begun.map(|begun| millis(passed.at - begun.at)), ..line })
    }

    /// Whether it contains every word. Words are in lower case.
    pub(super) fn has(&self, words: &[String]) -> bool {
        if words.is_empty() {
            return true;
        }
        let Self { from, id, data, text, .. } = self;
        let all = format!("{id} {data} {from} {text}").to_lowercase();
        words.iter().all(|word| all.contains(word))
    }
}

fn bytes(frame: &Frame) -> String {
    if frame.is_remote() {
        return format!("remote, {} bytes", frame.dlc());
    }
    let bytes: Vec<_> = frame.data().iter().map(|byte| format!("{byte:02X}")).collect();
    bytes.join(" ")
}

/// CAN frames have no sender: for frames that only a device sends it is the device.
fn sender(own: bool, decoded: &Decoded) -> String {
    let of_device = match decoded {
        Decoded::Emcy(..) | Decoded::BootUp(_) | Decoded::Heartbeat(..) | Decoded::AlarmHeartbeat(_) => true,
        Decoded::Sdo(sdo) => sdo.from == Side::Server,
        Decoded::Pdo(pdo) => pdo.pdo.direction == Direction::Tpdo,
        _ => false,
    };
    match decoded.node().filter(|_| of_device) {
        _ if own => OWN.into(),
        Some(node) => format!("node {node}"),
        None => OTHERS.into(),
    }
}

const OWN: &str = "studio";
const OTHERS: &str = "others";

/// The SDO transfers under way: the start of each, and its client.
#[derive(Debug, Default)]
pub(super) struct Transfers(BTreeMap<NodeId, Begun>);

/// The start of a transfer.
#[derive(Clone, Copy, Debug)]
pub(super) struct Begun {
    at: Instant,
    own: bool,
    reads: bool,
    /// Its last request comes some frames after its first.
    has_parts: bool,
}

impl Transfers {
    /// Adds a frame, and returns the start of its transfer, if that was seen.
    pub(super) fn follow(&mut self, passed: &BusFrame, sdo: &Sdo) -> Option<Begun> {
        if sdo.step.is_end() {
            return self.0.remove(&sdo.node);
        }
        let reads = matches!(sdo.step, SdoStep::Read(_));
        let has_parts = matches!(sdo.step, SdoStep::Begin(..) | SdoStep::BlockBegin(..));
        let is_first = match sdo.step {
            SdoStep::Read(_) => true,
            SdoStep::Begin(..) | SdoStep::BlockBegin(..) => sdo.from == Side::Client,
            // The last segment of a download also has the whole value.
            SdoStep::Write(..) => self.0.get(&sdo.node).is_none_or(|begun| !begun.has_parts),
            _ => false,
        };
        if is_first {
            self.0.insert(sdo.node, Begun { at: passed.at, own: passed.own, reads, has_parts });
        }
        self.0.get(&sdo.node).copied()
    }
}

impl Begun {
    /// A read by this program.
    pub(super) const fn is_own_reading(&self) -> bool {
        self.own && self.reads
    }
}

fn millis(time: Duration) -> f64 {
    time.as_secs_f64() * 1e3
}
