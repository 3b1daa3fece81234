//! SDO block transfers as a listener sees them (CiA 301, 7.2.4.3.9 to 7.2.4.3.16): segments put together, confirmations,
//! checksum. It follows what both sides say and holds neither to the protocol.

use canopen::Mux;
use canopen::sdo::block::checksum;
use canopen::sdo::wire::{LENGTH, MAX_SEGMENT};

use super::step::{MAX_OBJECT, SdoStep, Side};

/// Client command specifiers of block transfers, in the top three bits.
const DOWNLOAD: u8 = 6;
const UPLOAD: u8 = 5;
/// The same of the server, which has them the other way round.
const DOWNLOAD_REPLY: u8 = 5;
const UPLOAD_REPLY: u8 = 6;

/// An abort: no segment has the number 0 (clause 7.2.4.3.17).
const ABORT: u8 = 0x80;
/// The last segment of all.
const LAST: u8 = 0x80;
const HAS_CHECKSUM: u8 = 1 << 2;
const HAS_SIZE: u8 = 1 << 1;

/// A block transfer under way.
#[derive(Clone, Debug)]
pub(super) struct Block {
    mux: Mux,
    /// The client sends.
    writes: bool,
    size: Option<u32>,
    /// Both sides count the checksum, as far as they have said.
    checked: bool,
    /// Bytes of confirmed blocks.
    confirmed: Vec<u8>,
    /// Bytes of the block that is being sent, whole segments.
    block: Vec<u8>,
    phase: BlockPhase,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum BlockPhase {
    /// The other side has not answered yet.
    Asked,
    /// Segments come; the last one has been seen if so.
    Segments { last: bool },
    /// The sender has announced how the data ends.
    Ending,
}

/// What a frame does to a block transfer.
pub(super) enum BlockStep {
    /// It goes on.
    Goes(SdoStep),
    /// It has ended.
    Over(SdoStep),
    /// The frame is not a part of it: the transfer was abandoned without an abort.
    NotPart,
}

use BlockStep::{Goes, NotPart, Over};

impl Block {
    /// The transfer that a client's frame begins.
    pub(super) fn begin(from: Side, raw: &[u8; LENGTH]) -> Option<Self> {
        let (writes, size) = match (from, raw[0] >> 5, raw[0] & 0b11) {
            (Side::Client, DOWNLOAD, low) if low & 1 == 0 => (true, size_of(raw)),
            (Side::Client, UPLOAD, 0) => (false, None),
            _ => return None,
        };
        Some(Self {
            mux: Mux::new(u16::from_le_bytes([raw[1], raw[2]]), raw[3]),
            writes,
            size,
            checked: raw[0] & HAS_CHECKSUM != 0,
            confirmed: Vec::new(),
            block: Vec::new(),
            phase: BlockPhase::Asked,
        })
    }

    /// The object.
    pub(super) const fn mux(&self) -> Mux {
        self.mux
    }

    /// How many bytes it has by its sender's word.
    pub(super) const fn size(&self) -> Option<u32> {
        self.size
    }

    /// The next frame of either side.
    pub(super) fn step(&mut self, from: Side, raw: &[u8; LENGTH]) -> BlockStep {
        let sends = (from == Side::Client) == self.writes;
        if sends && self.phase == (BlockPhase::Segments { last: false }) && raw[0] != ABORT {
            return self.segment(raw);
        }
        let specifier = raw[0] >> 5;
        match (from, self.writes, specifier, raw[0] & 0b11) {
            (Side::Server, true, DOWNLOAD_REPLY, 0) | (Side::Server, false, UPLOAD_REPLY, 0 | HAS_SIZE) => {
                self.answer(raw)
            }
            (Side::Client, false, UPLOAD, 0b11) => {
                self.phase = BlockPhase::Segments { last: false };
                Goes(SdoStep::BlockAgreed(self.mux))
            }
            (Side::Server, true, DOWNLOAD_REPLY, 0b10) | (Side::Client, false, UPLOAD, 0b10) => self.confirm(raw[1]),
            (Side::Client, true, DOWNLOAD, low) | (Side::Server, false, UPLOAD_REPLY, low) if low & 1 == 1 => {
                self.end(raw)
            }
            (Side::Server, true, DOWNLOAD_REPLY, 0b01) => Over(SdoStep::WriteDone(self.mux, self.confirmed.clone())),
            (Side::Client, false, UPLOAD, 0b01) => Over(SdoStep::BlockAgreed(self.mux)),
            _ => NotPart,
        }
    }

    /// The server agrees: a download's segments may come, an upload waits for the client's start.
    fn answer(&mut self, raw: &[u8; LENGTH]) -> BlockStep {
        self.checked &= raw[0] & HAS_CHECKSUM != 0;
        if self.writes {
            self.phase = BlockPhase::Segments { last: false };
            return Goes(SdoStep::BlockAgreed(self.mux));
        }
        self.size = size_of(raw);
        Goes(SdoStep::BlockBegin(self.mux, self.size))
    }

    fn segment(&mut self, raw: &[u8; LENGTH]) -> BlockStep {
        let number = raw[0] & !LAST;
        // A sender counts from 1 in each block, whatever the receiver makes of it: any other number is another request.
        if usize::from(number) != self.block.len() / MAX_SEGMENT + 1 {
            return NotPart;
        }
        self.block.extend_from_slice(&raw[1..]);
        if raw[0] & LAST != 0 {
            self.phase = BlockPhase::Segments { last: true };
        }
        Goes(SdoStep::BlockSegment(self.mux, number, self.confirmed.len() + self.block.len()))
    }

    fn confirm(&mut self, number: u8) -> BlockStep {
        let kept = (usize::from(number) * MAX_SEGMENT).min(self.block.len());
        let all = kept == self.block.len();
        if self.confirmed.len() < MAX_OBJECT {
            self.confirmed.extend_from_slice(&self.block[..kept]);
        }
        self.block.clear();
        // What was not confirmed comes again, the last segment too.
        let last = all && self.phase == (BlockPhase::Segments { last: true });
        self.phase = BlockPhase::Segments { last };
        Goes(SdoStep::BlockConfirmed(self.mux, number))
    }

    /// The sender says how many bytes of the last segment were none, and the checksum.
    fn end(&mut self, raw: &[u8; LENGTH]) -> BlockStep {
        let unused = usize::from(raw[0] >> 2 & 0b111);
        let whole = self.confirmed.len() < MAX_OBJECT;
        if whole {
            self.confirmed.truncate(self.confirmed.len().saturating_sub(unused));
        }
        self.phase = BlockPhase::Ending;
        let (said, found) = (u16::from_le_bytes([raw[1], raw[2]]), checksum(0, &self.confirmed));
        if self.checked && whole && said != found {
            return Goes(SdoStep::BadChecksum { mux: self.mux, said, found });
        }
        let bytes = self.confirmed.clone();
        Goes(if self.writes { SdoStep::Write(self.mux, bytes) } else { SdoStep::ReadDone(self.mux, bytes) })
    }
}

fn size_of(raw: &[u8; LENGTH]) -> Option<u32> {
    (raw[0] & HAS_SIZE != 0).then(|| u32::from_le_bytes([raw[4], raw[5], raw[6], raw[7]]))
}
