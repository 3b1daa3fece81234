use super::super::wire::{LENGTH, MAX_SEGMENT};
use super::wire::{Acknowledgement, End, Segment};
use super::{Invalid, SEGMENT_TIME_NS, checksum, is_block_size};

/// The end of a block transfer that has the data: it counts segments, and sends those again that were lost.
#[derive(Clone, Copy, Debug)]
pub(in crate::sdo) struct Sender {
    /// Bytes of all.
    length: usize,
    /// Both sides form the checksum.
    checked: bool,
    /// Segments that are confirmed.
    confirmed: usize,
    /// Segments of the present block that were handed out.
    sent: u8,
    /// Segments that it has.
    block: u8,
    /// Confirmations in a row of which none went on.
    stalled: u8,
    /// The last confirmation: the wire may repeat it.
    before: Option<Acknowledgement>,
    /// Over the first `summed` bytes.
    sum: u16,
    summed: usize,
}

/// What a confirmation means to the sender.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::sdo) enum Sent {
    /// Another block follows.
    Part,
    /// All is confirmed.
    All,
}

/// So many confirmations in a row without a new segment end a transfer: it would go on for ever. A guess: the chance of losing the
/// first segment as often is small on any bus on which something else works.
const MOST_STALLED: u8 = 16;

impl Sender {
    /// For `length` bytes; `None` if a block cannot have as many segments.
    pub(in crate::sdo) fn new(length: usize, checked: bool, block_size: u8) -> Option<Self> {
        let mut sender =
            Self { length, checked, confirmed: 0, sent: 0, block: 0, stalled: 0, before: None, sum: 0, summed: 0 };
        sender.begin_block(block_size).then_some(sender)
    }

    /// Bytes that are confirmed.
    pub(in crate::sdo) fn confirmed_bytes(&self) -> usize {
        (self.confirmed * MAX_SEGMENT).min(self.length)
    }

    /// A segment of the present block is still to be handed out.
    pub(in crate::sdo) const fn has_segment(&self) -> bool {
        self.sent < self.block
    }

    /// How long the present block may take on the wire.
    pub(in crate::sdo) fn wire_time_ns(&self) -> u64 {
        u64::from(self.block) * SEGMENT_TIME_NS
    }

    /// The next segment of the present block, of `data`, which is the same at each call.
    pub(in crate::sdo) fn segment(&mut self, data: &[u8]) -> Option<[u8; LENGTH]> {
        if !self.has_segment() {
            return None;
        }
        let begin = (self.confirmed + usize::from(self.sent)) * MAX_SEGMENT;
        let end = (begin + MAX_SEGMENT).min(self.length);
        let mut bytes = [0; MAX_SEGMENT];
        // All but the last are full: of a length that is known, neither sum nor copy needs a loop.
        if let Some(full) = data.get(begin..end).and_then(|part| <&[u8; MAX_SEGMENT]>::try_from(part).ok()) {
            bytes = *full;
            self.add_to_sum(&bytes, end);
        } else {
            let part = data.get(begin..end).unwrap_or_default();
            bytes[..part.len()].copy_from_slice(part);
            self.add_to_sum(part, end);
        }
        self.sent += 1;
        Some(Segment { last: end == self.length, sequence: self.sent, bytes }.emit())
    }

    /// Over each segment once, however often it is sent.
    #[inline(always)]
    fn add_to_sum(&mut self, part: &[u8], end: usize) {
        if self.checked && end > self.summed {
            self.sum = checksum(self.sum, part);
            self.summed = end;
        }
    }

    /// A confirmation has come, also of a block of which not everything was handed out yet: its receiver did not wait longer.
    ///
    /// # Errors
    /// A number that was not sent, a block size that there is not, and confirmations with which nothing goes on.
    pub(in crate::sdo) fn confirm(&mut self, confirmation: Acknowledgement) -> Result<Sent, Invalid> {
        let Acknowledgement { sequence, block_size } = confirmation;
        let repeated = self.before.replace(confirmation) == Some(confirmation);
        match (sequence > self.sent, repeated) {
            (true, true) => return Ok(Sent::Part),
            (true, false) => return Err(Invalid::Sequence(sequence)),
            (false, _) => {}
        }
        self.stalled = if sequence == 0 { self.stalled + 1 } else { 0 };
        if self.stalled == MOST_STALLED {
            return Err(Invalid::Stalled);
        }
        self.confirmed += usize::from(sequence);
        if self.confirmed == self.segments() {
            (self.block, self.sent) = (0, 0);
            return Ok(Sent::All);
        }
        if self.begin_block(block_size) { Ok(Sent::Part) } else { Err(Invalid::BlockSize(block_size)) }
    }

    /// What ends the transfer.
    pub(in crate::sdo) fn end(&self) -> End {
        let unused = self.segments() * MAX_SEGMENT - self.length;
        End { unused: unused as u8, checksum: self.sum }
    }

    /// A value without a byte has a segment, too: the last one.
    fn segments(&self) -> usize {
        self.length.div_ceil(MAX_SEGMENT).max(1)
    }

    fn begin_block(&mut self, block_size: u8) -> bool {
        let left = self.segments() - self.confirmed;
        (self.sent, self.block) = (0, left.min(block_size.into()) as u8);
        is_block_size(block_size)
    }
}
