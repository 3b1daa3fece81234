//! How many frames of which service and of which node there were.

use std::collections::BTreeMap;
use std::fmt;

use can::Instant;
use master::decode::{Decoded, ServiceKind};

/// Counts of all frames of a bus, shown or not.
#[derive(Clone, Debug, Default)]
pub(crate) struct Counts {
    frames: u64,
    shown: u64,
    services: BTreeMap<ServiceKind, u64>,
    nodes: BTreeMap<u8, u64>,
    first: Option<Instant>,
    last: Option<Instant>,
}

impl Counts {
    /// Counts a frame.
    pub(crate) fn note(&mut self, at: Instant, decoded: &Decoded, shown: bool) {
        self.frames += 1;
        self.shown += u64::from(shown);
        *self.services.entry(decoded.service()).or_default() += 1;
        if let Some(node) = decoded.node() {
            *self.nodes.entry(node.raw()).or_default() += 1;
        }
        self.first.get_or_insert(at);
        self.last = Some(at);
    }

    /// All frames, shown or not.
    pub(crate) fn frames(&self) -> u64 {
        self.frames
    }
}

/// `12 frames in 1.5 s: 8 sdo, 4 pdo; of node 1: 4, 4: 8`.
impl fmt::Display for Counts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (Some(first), Some(last)) = (self.first, self.last) else { return f.write_str("no frame") };
        let unit = if self.frames == 1 { "frame" } else { "frames" };
        // The stamps of a log need not be in order.
        let seconds = last.max(first) - first.min(last);
        write!(f, "{} {unit} in {:.3} s", self.frames, seconds.as_secs_f64())?;
        if self.shown != self.frames {
            write!(f, ", {} of them shown", self.shown)?;
        }
        for (place, (service, count)) in self.services.iter().enumerate() {
            write!(f, "{}{count} {service}", if place == 0 { ": " } else { ", " })?;
        }
        for (place, (node, count)) in self.nodes.iter().enumerate() {
            write!(f, "{}{node}: {count}", if place == 0 { "; of node " } else { ", " })?;
        }
        Ok(())
    }
}
