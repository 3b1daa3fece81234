//! The emergency messages of a network, with what they mean and when they went away (CiA 301, 7.2.7).

use core::fmt;
use std::collections::VecDeque;

use can::Instant;
use canopen::NodeId;
use canopen::emcy::{Emcy, EmcyErrorCode};
use devices::Description;
use devices::faults::FaultRow;

/// How many messages are kept: a day of one fault each minute.
const KEPT: usize = 1440;

/// An emergency message that was kept.
#[derive(Clone, Copy, Debug)]
pub struct EmcyRecord {
    /// When it came.
    pub at: Instant,
    /// From whom.
    pub node: NodeId,
    /// As it came.
    pub emcy: Emcy,
    /// What it means on the node's model, where that is known.
    pub fault: Option<&'static FaultRow>,
    /// When the node said that it has no error any more (error code 0000h), or booted.
    pub gone: Option<Instant>,
}

/// The newest messages of all nodes; the oldest is dropped first.
#[derive(Clone, Debug, Default)]
pub struct EmcyLog {
    records: VecDeque<EmcyRecord>,
    dropped: u64,
}

impl EmcyLog {
    /// Those kept, oldest first.
    pub fn records(&self) -> impl DoubleEndedIterator<Item = &EmcyRecord> {
        self.records.iter()
    }

    /// How many older ones are no longer kept.
    pub const fn dropped(&self) -> u64 {
        self.dropped
    }

    /// Keeps a message, and returns what was kept. One with error code 0 ends those of its node, and is not
    /// kept itself.
    pub fn push(&mut self, at: Instant, node: NodeId, emcy: Emcy, model: Option<&Description>) -> EmcyRecord {
        let fault = model.and_then(|model| model.fault_reported_by(emcy.code));
        let record = EmcyRecord { at, node, emcy, fault, gone: None };
        if emcy.code == EmcyErrorCode::NO_ERROR {
            self.end(node, at);
            return record;
        }
        if self.records.len() == KEPT {
            self.records.pop_front();
            self.dropped += 1;
        }
        self.records.push_back(record);
        record
    }

    /// The node has no error any more.
    pub fn end(&mut self, node: NodeId, at: Instant) {
        let open = self.records.iter_mut().filter(|record| record.node == node && record.gone.is_none());
        open.for_each(|record| record.gone = Some(at));
    }
}

/// `node 4: emergency 3110h, over-voltage (error register 05h): reduce ...`.
impl fmt::Display for EmcyRecord {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { node, emcy, fault, .. } = self;
        if emcy.code == EmcyErrorCode::NO_ERROR {
            return write!(f, "node {node}: no error any more");
        }
        match fault {
            Some(fault) => write!(f, "node {node}: emergency {:04X}h, {}: {}", emcy.code.0, fault.name, fault.remedy),
            None => write!(f, "node {node}: emergency {}, error register {:02X}h", emcy.code, emcy.error_register),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(code: u16) -> Emcy {
        Emcy { code: EmcyErrorCode(code), error_register: 1, manufacturer: [0; 5] }
    }

    #[test]
    fn an_error_goes_away_with_code_zero_of_its_own_node() {
        let (one, two) = (NodeId::MAX, NodeId::new(4).unwrap());
        let mut log = EmcyLog::default();
        log.push(Instant::from_secs(1), one, message(0x3110), None);
        log.push(Instant::from_secs(2), two, message(0x4210), None);
        log.push(Instant::from_secs(3), one, message(0), None);
        let gone: Vec<_> = log.records().map(|record| record.gone).collect();
        assert_eq!(gone, [Some(Instant::from_secs(3)), None]);
    }

    #[test]
    fn the_oldest_is_dropped_first() {
        let mut log = EmcyLog::default();
        for second in 0..=KEPT as u64 {
            log.push(Instant::from_secs(second), NodeId::MAX, message(0x3110), None);
        }
        assert_eq!((log.records().count(), log.dropped()), (KEPT, 1));
        assert_eq!(log.records().next().map(|record| record.at), Some(Instant::from_secs(1)));
    }
}
