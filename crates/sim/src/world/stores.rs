//! Stores that a program outside keeps: what a drive answers after a store waits until the store is kept.
//!
//! A drive's non-volatile memory lives in the world. A caller that brings it to a disk asks for that with
//! [`World::guard_stores`]: from then on each new content is handed out once by [`World::poll_store`], and an SDO answer
//! that a drive gives after a store, or while one is due, stays off the wire until [`World::confirm_store`]. Nothing else
//! waits: process data and heartbeats acknowledge nothing.

use can::Frame;

use super::ledger::Ledger;
use super::member::Member;
use super::{StationId, World};
use crate::nmt_reset;

/// A new content of a drive's non-volatile memory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StoredImage {
    /// The number under which the drive was added.
    pub number: u8,
    /// The drive's model.
    pub model: &'static str,
    /// Which store it is: grows by one with each.
    pub generation: u64,
    /// The content.
    pub bytes: Vec<u8>,
}

impl World {
    /// From now on answers that follow a store wait for [`confirm_store`](Self::confirm_store). What the drives hold now
    /// counts as kept. Drives added later are not guarded.
    pub fn guard_stores(&mut self) {
        self.ledgers = self.members.iter().map(Ledger::of_member).collect();
    }

    /// A content that has not been handed out yet.
    pub fn poll_store(&mut self) -> Option<StoredImage> {
        for (ledger, member) in self.ledgers.iter_mut().zip(&self.members) {
            let (Some(ledger), Member::Drive { number, drive }) = (ledger, member) else { continue };
            let generation = drive.nvm_generation();
            if ledger.handed_out != generation {
                ledger.handed_out = generation;
                let (number, model) = (*number, drive.model());
                return Some(StoredImage { number, model, generation, bytes: drive.nvm_image() });
            }
        }
        None
    }

    /// The content `generation` of a drive is kept, and with it all before: answers that waited for it go to the wire.
    pub fn confirm_store(&mut self, number: u8, generation: u64) {
        let Some(StationId(i)) = self.drive_id(number) else { return };
        if let Some(Some(ledger)) = self.ledgers.get_mut(i) {
            ledger.confirmed = ledger.confirmed.max(generation);
            self.collect(i);
        }
    }

    /// The store that an answer of a drive given now stands for, if it is not confirmed yet.
    pub fn unconfirmed_store(&self, number: u8) -> Option<u64> {
        let StationId(i) = self.drive_id(number)?;
        let (Some(ledger), Member::Drive { drive, .. }) = (self.ledgers.get(i)?, &self.members[i]) else { return None };
        Some(Ledger::needed(&**drive)).filter(|needed| *needed > ledger.confirmed)
    }

    /// That a store of a drive is kept; one that will not come after all counts as kept.
    pub fn is_store_confirmed(&self, number: u8, generation: u64) -> bool {
        self.unconfirmed_store(number).is_none_or(|needed| {
            let confirmed = self.drive_id(number).and_then(|StationId(i)| self.ledgers.get(i)?.as_ref());
            confirmed.is_none_or(|ledger| generation.min(needed) <= ledger.confirmed)
        })
    }

    /// The first answer of each drive that waits: the drive's number, and the store that it waits for.
    pub fn held_answers(&self) -> impl Iterator<Item = (u8, u64)> + '_ {
        self.ledgers.iter().zip(&self.members).filter_map(|(ledger, member)| match (ledger, member) {
            (Some(ledger), Member::Drive { number, .. }) => {
                let needs = ledger.held.front()?.needs;
                (needs > ledger.confirmed).then_some((*number, needs))
            }
            _ => None,
        })
    }

    /// The next frame that station `i` has for the wire.
    pub(super) fn next_frame(&mut self, i: usize) -> Option<Frame> {
        match (self.ledgers.get_mut(i), &mut self.members[i]) {
            (Some(Some(ledger)), Member::Drive { drive, .. }) => ledger.next_frame(&mut **drive),
            (_, member) => member.station().poll_transmit(),
        }
    }

    /// Station `i` is about to take a frame that may command it to reset.
    #[inline]
    pub(super) fn forget_held_on_reset(&mut self, i: usize, frame: &Frame) {
        let (Some(Some(ledger)), Member::Drive { drive, .. }) = (self.ledgers.get_mut(i), &self.members[i]) else {
            return;
        };
        if !ledger.held.is_empty() && nmt_reset::is_asked_of(frame, || drive.report().node) {
            ledger.held.clear();
        }
    }

    /// Station `i` has lost its power: what it had to say is lost too.
    pub(super) fn forget_held(&mut self, i: usize) {
        if let Some(Some(ledger)) = self.ledgers.get_mut(i) {
            ledger.held.clear();
        }
    }
}
