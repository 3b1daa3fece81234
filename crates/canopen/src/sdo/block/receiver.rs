use super::super::wire::{LENGTH, MAX_SEGMENT};
use super::wire::{Acknowledgement, End, Segment};
use super::{Invalid, checksum};

/// The end of a block transfer that takes the data: it puts segments together, and asks for those that are missing.
///
/// The wire may lose frames and repeat one directly after itself, as CAN does; it keeps their order.
#[derive(Clone, Copy, Debug)]
pub(in crate::sdo) struct Receiver {
    /// Both sides form the checksum.
    checked: bool,
    /// Segments of the present block up to which none is missing.
    received: u8,
    /// Bytes taken before the last segment.
    written: usize,
    /// Over these.
    sum: u16,
    /// The last segment of all, how much of which is data is not known yet.
    last: Option<[u8; MAX_SEGMENT]>,
    /// The number of the segment that came last.
    seen: u8,
    /// Segments of the blocks that it asks for.
    block_size: u8,
    /// The frame that ended the block before, as long as no other has come: the wire may repeat it.
    before: Option<[u8; LENGTH]>,
    /// A part of the time that the sender has is over without a segment.
    waited: bool,
}

impl Receiver {
    /// One that asks for blocks of as many segments.
    pub(in crate::sdo) const fn new(checked: bool, block_size: u8) -> Self {
        Self { checked, received: 0, written: 0, sum: 0, last: None, seen: 0, block_size, before: None, waited: false }
    }

    /// Bytes that have come for certain: all but the last segment's.
    pub(in crate::sdo) const fn written(&self) -> usize {
        self.written
    }

    /// The last segment has come: the end of the data is expected, and no segment any more.
    pub(in crate::sdo) const fn is_complete(&self) -> bool {
        self.last.is_some()
    }

    /// The number of the segment that came last.
    pub(in crate::sdo) const fn seen(&self) -> u8 {
        self.seen
    }

    /// True if this is the frame that ended the block before, once more. Blocks of one segment may be alike.
    pub(in crate::sdo) fn repeats(&self, raw: &[u8; LENGTH]) -> bool {
        self.before.as_ref() == Some(raw) && (self.block_size > 1 || self.is_complete())
    }

    /// A segment has come. `room` is for the whole value. Returns what is to be confirmed where the block is over.
    pub(in crate::sdo) fn take(
        &mut self,
        raw: &[u8; LENGTH],
        room: &mut [u8],
    ) -> Result<Option<Acknowledgement>, Invalid> {
        let segment = Segment::parse(raw);
        if segment.sequence == 0 || segment.sequence > self.block_size {
            return Err(Invalid::Sequence(segment.sequence));
        }
        (self.seen, self.waited) = (segment.sequence, false);
        if self.repeats(raw) {
            return Ok(None);
        }
        self.before = None;
        // What comes behind a gap comes again in the next block.
        if segment.sequence == self.received + 1 {
            self.append(segment, room)?;
        }
        if !segment.last && segment.sequence < self.block_size {
            return Ok(None);
        }
        // That nothing has come may be confirmed as often as one likes.
        self.before = (self.received > 0).then_some(*raw);
        Ok(Some(self.end_block()))
    }

    fn append(&mut self, segment: Segment, room: &mut [u8]) -> Result<(), Invalid> {
        if segment.last {
            self.last = Some(segment.bytes);
        } else {
            let end = self.written + MAX_SEGMENT;
            room.get_mut(self.written..end).ok_or(Invalid::TooLong(end))?.copy_from_slice(&segment.bytes);
            if self.checked {
                self.sum = checksum(self.sum, &segment.bytes);
            }
            self.written = end;
        }
        self.received += 1;
        Ok(())
    }

    fn end_block(&mut self) -> Acknowledgement {
        Acknowledgement { sequence: core::mem::replace(&mut self.received, 0), block_size: self.block_size }
    }

    /// A part of the time that the sender has is over: true the first time since the last segment.
    pub(in crate::sdo) const fn waits_on(&mut self) -> bool {
        !core::mem::replace(&mut self.waited, true)
    }

    /// What to confirm of a block whose end does not come: the frame that ends it may be lost. Nothing where no segment of it has
    /// come: then the last confirmation may be lost, and another one would be taken for it.
    pub(in crate::sdo) fn confirm_early(&mut self) -> Option<Acknowledgement> {
        (self.received > 0 && !self.is_complete()).then(|| self.end_block())
    }

    /// The data ends. Returns how many bytes there are.
    pub(in crate::sdo) fn finish(&self, end: End, room: &mut [u8]) -> Result<usize, Invalid> {
        let last = self.last.as_ref().ok_or(Invalid::Sequence(0))?;
        let data = &last[..MAX_SEGMENT.saturating_sub(end.unused.into())];
        let length = self.written + data.len();
        room.get_mut(self.written..length).ok_or(Invalid::TooLong(length))?.copy_from_slice(data);
        if self.checked && checksum(self.sum, data) != end.checksum {
            return Err(Invalid::Checksum);
        }
        Ok(length)
    }
}
