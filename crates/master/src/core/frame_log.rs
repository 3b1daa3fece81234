//! Frames of some identifiers, kept one by one with their times, for a program that measures: the process image has the newest alone.

use std::collections::VecDeque;

use can::{Frame, Instant};

/// A frame as it came.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LoggedFrame {
    /// When it came: by the time stamp of its interface, where that has one, and else when the program took it.
    pub at: Instant,
    /// Its identifier, 11 bits.
    pub id: u16,
    /// Its data, the first byte lowest, zero behind its end.
    pub data: u64,
    /// Bytes of it.
    pub length: u8,
}

/// All logs that are being kept.
#[derive(Clone, Debug, Default)]
pub struct FrameLogs {
    logs: Vec<FilteredLog>,
    next: u64,
}

#[derive(Clone, Debug)]
struct FilteredLog {
    token: u64,
    ids: Vec<u16>,
    frames: VecDeque<LoggedFrame>,
    capacity: usize,
    /// Frames that were overwritten since the last look.
    lost: u64,
}

impl FrameLogs {
    /// Begins to keep frames with these identifiers, so many at most: a further one overwrites the oldest.
    pub fn open(&mut self, ids: &[u16], capacity: usize) -> u64 {
        self.next += 1;
        let (token, ids, frames) = (self.next, ids.to_vec(), VecDeque::with_capacity(capacity));
        self.logs.push(FilteredLog { token, ids, frames, capacity, lost: 0 });
        self.next
    }

    /// Ends a log.
    pub fn close(&mut self, token: u64) {
        self.logs.retain(|log| log.token != token);
    }

    /// Moves what a log has kept to the end of `into`, oldest first, and says how many frames it has lost before that.
    pub fn take(&mut self, token: u64, into: &mut Vec<LoggedFrame>) -> u64 {
        let Some(log) = self.logs.iter_mut().find(|log| log.token == token) else { return 0 };
        into.extend(log.frames.drain(..));
        std::mem::take(&mut log.lost)
    }

    /// A frame came.
    #[inline]
    pub(super) fn note(&mut self, id: u16, frame: &Frame, at: Instant) {
        for log in self.logs.iter_mut().filter(|log| log.ids.contains(&id)) {
            if log.frames.len() >= log.capacity {
                log.frames.pop_front();
                log.lost += 1;
            }
            let (data, length) = (u64::from_le_bytes(*frame.padded()), frame.data().len() as u8);
            log.frames.push_back(LoggedFrame { at, id, data, length });
        }
    }
}

#[cfg(test)]
mod tests {
    use can::{CanId, Station};

    use super::super::Core;
    use super::*;

    #[test]
    fn each_log_has_its_frames_in_order_and_says_what_it_lost() {
        let mut logs = FrameLogs::default();
        let (all, one) = (logs.open(&[0x181, 0x281], 10), logs.open(&[0x281], 2));
        for ms in 0..5_u8 {
            for id in [0x181, 0x281, 0x381] {
                let frame = Frame::new(CanId::standard(id), &[ms, 0xFF]);
                logs.note(id, &frame, Instant::from_millis(ms.into()));
            }
        }
        let mut taken = Vec::new();
        assert_eq!(logs.take(all, &mut taken), 0);
        assert_eq!(taken.len(), 10);
        let expected = LoggedFrame { at: Instant::from_millis(1), id: 0x181, data: 0xFF01, length: 2 };
        assert_eq!(taken[2], expected);
        taken.clear();
        assert_eq!(logs.take(one, &mut taken), 3);
        assert_eq!(taken.iter().map(|frame| frame.data & 0xFF).collect::<Vec<_>>(), [3, 4]);
        assert_eq!(logs.take(one, &mut taken), 0);
        logs.close(one);
        assert_eq!(logs.logs.len(), 1);
    }

    /// The interface has stamped them; the program was held up for 20 ms, and its deadlines count from when it took them.
    #[test]
    fn frames_that_are_taken_late_have_the_time_at_which_they_came() {
        let mut core = Core::new();
        let log = core.frame_logs_mut().open(&[0x181], 10);
        let [first, second, now] = [100, 101, 120].map(Instant::from_millis);
        let frame = Frame::new(CanId::standard(0x181), &[1]);
        core.handle_stamped(&frame, first, now);
        assert_eq!((core.now(), core.heard_until()), (now, first));
        core.handle_stamped(&frame, second, now);
        let mut taken = Vec::new();
        core.frame_logs_mut().take(log, &mut taken);
        assert_eq!(taken.iter().map(|frame| frame.at).collect::<Vec<_>>(), [first, second]);
        core.handle_frame(&frame, now);
        assert_eq!(core.heard_until(), now);
    }
}
