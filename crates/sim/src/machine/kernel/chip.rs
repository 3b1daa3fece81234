//! A memory chip that takes its time: what a firmware has stored is in it some milliseconds later, and what was in it
//! before until then.

use std::collections::VecDeque;

use can::{Frame, Instant};

use crate::nmt_reset::is_sdo_answer;

/// Answers that may wait for the chip. With as many waiting, what else the firmware has to send waits in it.
const MAX_HELD: usize = 8;

/// See the [module](self).
#[derive(Clone, Debug)]
pub(crate) struct Chip {
    contents: Vec<u8>,
    /// Which store the contents are.
    generation: u64,
    /// What is being written, and until when.
    writing: Option<(Store, Instant)>,
    /// What comes after it.
    next: Option<(Store, u64)>,
    /// SDO answers, each with the store that it stands for.
    held: VecDeque<(Frame, u64)>,
}

#[derive(Clone, Debug)]
struct Store {
    image: Vec<u8>,
    generation: u64,
}

impl Chip {
    pub(crate) fn new(image: &[u8], generation: u64) -> Self {
        Self { contents: image.to_vec(), generation, writing: None, next: None, held: VecDeque::new() }
    }

    /// What is in it, whatever happens next.
    pub(crate) fn contents(&self) -> &[u8] {
        &self.contents
    }

    /// Which store that is.
    pub(crate) const fn generation(&self) -> u64 {
        self.generation
    }

    pub(crate) const fn is_writing(&self) -> bool {
        self.writing.is_some()
    }

    /// No store of this number is in it, nor on its way.
    pub(crate) fn is_new(&self, generation: u64) -> bool {
        let last = self.next.as_ref().map(|(store, _)| store).or(self.writing.as_ref().map(|(store, _)| store));
        generation != last.map_or(self.generation, |store| store.generation)
    }

    /// A store that takes `takes_ns`, once the chip is free. What waits for that already is overwritten: its values are in
    /// the newer one too.
    pub(crate) fn write(&mut self, image: &[u8], generation: u64, takes_ns: u64, now: Instant) {
        let store = Store { image: image.to_vec(), generation };
        if self.writing.is_some() {
            self.next = Some((store, takes_ns));
        } else {
            self.writing = Some((store, now.plus_nanos(takes_ns)));
        }
    }

    /// When the present store is in.
    pub(crate) fn next_due(&self) -> Option<Instant> {
        self.writing.as_ref().map(|(_, due)| *due)
    }

    /// Time has reached `now`.
    pub(crate) fn advance(&mut self, now: Instant) {
        while let Some((store, due)) = self.writing.take_if(|(_, due)| *due <= now) {
            self.contents = store.image;
            self.generation = store.generation;
            self.writing = self.next.take().map(|(store, takes_ns)| (store, due.plus_nanos(takes_ns)));
        }
    }

    /// The supply is gone: a store that was under way has not been. `image` is what the firmware has written with the last
    /// of its voltage, if it has.
    pub(crate) fn power_off(&mut self, image: Option<&[u8]>, generation: u64) {
        if let Some(image) = image {
            self.contents = image.to_vec();
        }
        *self = Self::new(&std::mem::take(&mut self.contents), generation);
    }

    /// The firmware resets its communication: what it had answered before is never sent.
    pub(crate) fn forget_answers(&mut self) {
        self.held.clear();
    }

    /// Other contents, put in without power.
    pub(crate) fn replace(&mut self, image: &[u8]) {
        self.contents = image.to_vec();
    }

    /// The next frame that may go out. An SDO answer waits until the store is in that it stands for: `needed` is the one that
    /// an answer given now does, and the last that there will be.
    pub(crate) fn next_frame(&mut self, needed: u64, mut poll: impl FnMut() -> Option<Frame>) -> Option<Frame> {
        if self.held.front().is_some_and(|(_, needs)| (*needs).min(needed) <= self.generation) {
            return self.held.pop_front().map(|(frame, _)| frame);
        }
        while self.held.len() < MAX_HELD {
            let frame = poll()?;
            if !is_sdo_answer(&frame) || (needed <= self.generation && self.held.is_empty()) {
                return Some(frame);
            }
            self.held.push_back((frame, needed));
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(ms: u64) -> Instant {
        Instant::from_millis(ms)
    }

    #[test]
    fn what_was_in_it_is_in_it_until_the_store_is_done() {
        let mut chip = Chip::new(b"old", 7);
        chip.write(b"new", 8, 10_000_000, at(5));
        assert!(chip.is_writing() && !chip.is_new(8) && chip.is_new(9));
        chip.advance(at(14));
        assert_eq!((chip.contents(), chip.generation(), chip.next_due()), (&b"old"[..], 7, Some(at(15))));
        chip.advance(at(15));
        assert_eq!((chip.contents(), chip.generation(), chip.next_due()), (&b"new"[..], 8, None));
    }

    #[test]
    fn a_supply_that_fails_in_a_store_leaves_what_was_there_before() {
        let mut chip = Chip::new(b"old", 7);
        chip.write(b"new", 8, 10_000_000, at(0));
        let mut saved = chip.clone();
        chip.power_off(None, 8);
        assert_eq!((chip.contents(), chip.is_writing(), chip.is_new(8)), (&b"old"[..], false, false));
        saved.power_off(Some(b"end"), 9);
        assert_eq!((saved.contents(), saved.generation()), (&b"end"[..], 9));
    }

    #[test]
    fn stores_that_come_faster_than_the_chip_are_done_one_after_the_other_the_last_among_them() {
        let mut chip = Chip::new(b"0", 0);
        for generation in 1..=9 {
            chip.write(generation.to_string().as_bytes(), generation, 10_000_000, at(generation));
        }
        chip.advance(at(11));
        assert_eq!((chip.contents(), chip.next_due()), (&b"1"[..], Some(at(21))));
        chip.advance(at(21));
        assert_eq!((chip.contents(), chip.generation(), chip.next_due()), (&b"9"[..], 9, None));
    }

    #[test]
    fn an_answer_waits_for_its_store_and_nothing_else_does() {
        let mut chip = Chip::new(b"old", 0);
        let mut frames: VecDeque<Frame> =
            ["584#6010100000000000", "704#7F", "584#4341600000000000"].map(|text| text.parse().unwrap()).into();
        let mut poll = || frames.pop_front();
        chip.write(b"new", 1, 10_000_000, at(0));
        assert_eq!(chip.next_frame(1, &mut poll).unwrap().to_string(), "704#7F");
        assert_eq!(chip.next_frame(1, &mut poll), None);
        chip.advance(at(10));
        assert_eq!(chip.next_frame(1, &mut poll).unwrap().to_string(), "584#6010100000000000");
        assert_eq!(chip.next_frame(1, &mut poll).unwrap().to_string(), "584#4341600000000000");
        assert_eq!(chip.next_frame(1, &mut poll), None);
    }
}
