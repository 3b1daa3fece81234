//! The observer: listens without taking part.

use std::collections::VecDeque;

use can::Frame;
use canopen::connection_set::Service;
use canopen::pdo::PdoId;

use crate::wire::WireEvent;

/// What happened on the wire, oldest first: frames, errors, changes of error state.
///
/// Holds the last [`FrameLog::DEFAULT_LIMIT`] entries unless set otherwise. Of what it lost, it keeps the transfers that set up
/// PDOs: they say what is in the PDOs that it holds.
#[derive(Clone, Debug)]
pub struct FrameLog {
    entries: VecDeque<WireEvent>,
    limit: usize,
    dropped: u64,
    pdo_setup: Vec<Frame>,
}

impl FrameLog {
    /// Entries held by default.
    pub const DEFAULT_LIMIT: usize = 4096;

    /// Holds the last `limit` entries; `usize::MAX` keeps everything until it is pulled.
    pub fn set_limit(&mut self, limit: usize) {
        self.limit = limit;
        self.trim();
    }

    /// Takes out the oldest entry.
    pub fn pull(&mut self) -> Option<WireEvent> {
        self.entries.pop_front()
    }

    /// All entries held, oldest first.
    pub fn iter(&self) -> impl DoubleEndedIterator<Item = &WireEvent> {
        self.entries.iter()
    }

    /// Entries lost because they were not pulled in time.
    pub fn dropped(&self) -> u64 {
        self.dropped
    }

    /// The SDO frames about parameters of PDOs (1400h to 1BFFh) among the lost entries, oldest first; `None` if there were
    /// more than [`FrameLog::DEFAULT_LIMIT`].
    pub fn lost_pdo_setup(&self) -> Option<&[Frame]> {
        (self.pdo_setup.len() <= Self::DEFAULT_LIMIT).then_some(&self.pdo_setup)
    }

    pub(super) fn push(&mut self, event: WireEvent) {
        self.entries.push_back(event);
        self.trim();
    }

    fn trim(&mut self) {
        while self.entries.len() > self.limit {
            if let Some(WireEvent::Frame { frame, .. }) = self.entries.pop_front()
                && self.pdo_setup.len() <= Self::DEFAULT_LIMIT
                && is_pdo_setup(&frame)
            {
                self.pdo_setup.push(frame);
            }
            self.dropped += 1;
        }
    }
}

/// True for the first frame of a transfer of such a parameter, and of its answer. (Later frames name no object; the parameters
/// have at most 4 bytes, for which the first ones do.)
fn is_pdo_setup(frame: &Frame) -> bool {
    let is_sdo = matches!(Service::of(frame.id()), Some(Service::SdoRequest(_) | Service::SdoReply(_)));
    let [_, low, high, ..] = *frame.padded();
    is_sdo && PdoId::of_object(u16::from_le_bytes([low, high])).is_some()
}

impl Default for FrameLog {
    fn default() -> Self {
        Self { entries: VecDeque::new(), limit: Self::DEFAULT_LIMIT, dropped: 0, pdo_setup: Vec::new() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use can::{CanId, Instant};

    /// A log that holds two entries, after these frames.
    fn log_of(frames: &[(u16, [u8; 8])]) -> FrameLog {
        let mut log = FrameLog::default();
        log.set_limit(2);
        for (at, (id, data)) in frames.iter().enumerate() {
            let (start, end) = (Instant::from_millis(at as u64), Instant::from_millis(at as u64 + 1));
            log.push(WireEvent::Frame { start, end, source: 0, frame: Frame::new(CanId::standard(*id), data) });
        }
        log
    }

    #[test]
    fn transfers_that_set_up_pdos_are_kept_when_they_leave() {
        let other = (0x604, [0x2B, 0x40, 0x60, 0, 6, 0, 0, 0]);
        let write = (0x604, [0x2F, 0x00, 0x1A, 0, 1, 0, 0, 0]);
        let answer = (0x584, [0x60, 0x00, 0x1A, 0, 0, 0, 0, 0]);
        let like_it = (0x184, write.1);
        let log = log_of(&[other, write, answer, like_it, other, other]);
        assert_eq!(log.dropped(), 4);
        let kept: Vec<u32> = log.lost_pdo_setup().unwrap().iter().map(|frame| frame.id().raw()).collect();
        assert_eq!(kept, [0x604, 0x584], "the write and its answer");
        assert_eq!(log_of(&[other, write]).lost_pdo_setup(), Some(&[][..]), "nothing has left");
    }

    #[test]
    fn more_than_is_kept_is_not_passed_off_as_all() {
        let write = (0x604, [0x2F, 0x00, 0x1A, 0, 1, 0, 0, 0]);
        assert!(log_of(&vec![write; FrameLog::DEFAULT_LIMIT + 2]).lost_pdo_setup().is_some());
        assert!(log_of(&vec![write; FrameLog::DEFAULT_LIMIT + 3]).lost_pdo_setup().is_none());
    }
}
