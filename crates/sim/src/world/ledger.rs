//! What is known of the stores of one drive, and the answers that wait for them.

use std::collections::VecDeque;

use can::Frame;

use super::member::Member;
use crate::VirtualDrive;
use crate::nmt_reset::is_sdo_answer;

/// Answers of one drive that may wait here. With as many waiting, what else it sends waits in the drive, by its own rules.
const MAX_HELD: usize = 8;

/// What is known of the stores of one drive.
#[derive(Clone, Debug, Default)]
pub(super) struct Ledger {
    pub(super) handed_out: u64,
    pub(super) confirmed: u64,
    pub(super) held: VecDeque<HeldAnswer>,
}

/// An answer that waits for a store.
#[derive(Clone, Debug)]
pub(super) struct HeldAnswer {
    pub(super) frame: Frame,
    pub(super) needs: u64,
}

impl Ledger {
    /// The store that an answer given now stands for: the last one, or the one that is due.
    pub(super) fn needed(drive: &dyn VirtualDrive) -> u64 {
        drive.nvm_generation() + u64::from(drive.is_storing())
    }

    /// The next frame that may go to the wire. `limit` is the last store that the drive has made or is about to make: an
    /// answer cannot wait for one that will not come.
    pub(super) fn next_frame(&mut self, drive: &mut dyn VirtualDrive) -> Option<Frame> {
        let limit = Self::needed(drive);
        if self.held.front().is_some_and(|held| held.needs.min(limit) <= self.confirmed) {
            return self.held.pop_front().map(|held| held.frame);
        }
        while self.held.len() < MAX_HELD {
            let frame = drive.poll_transmit()?;
            let needs = Self::needed(drive);
            if !is_sdo_answer(&frame) || needs <= self.confirmed {
                return Some(frame);
            }
            self.held.push_back(HeldAnswer { frame, needs });
        }
        None
    }

    pub(super) fn of_member(member: &Member) -> Option<Self> {
        match member {
            Member::Drive { drive, .. } => {
                let generation = drive.nvm_generation();
                Some(Self { handed_out: generation, confirmed: generation, held: VecDeque::new() })
            }
            _ => None,
        }
    }
}
