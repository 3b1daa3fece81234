//! The eight bytes of the frames of a block transfer (CiA 301, 7.2.4.3.9 to 7.2.4.3.15).
//!
//! [`Request`] goes from client to server, [`Reply`] back, and [`Segment`]s from the one that has the data. A segment is not
//! distinguished from the others by its bytes: the state of the transfer says which of them is expected.

use super::super::wire::{LENGTH, MAX_SEGMENT};
use crate::Mux;

const DOWNLOAD_REQUEST: u8 = 6 << 5;
const UPLOAD_REQUEST: u8 = 5 << 5;
const DOWNLOAD_REPLY: u8 = 5 << 5;
const UPLOAD_REPLY: u8 = 6 << 5;
const SPECIFIER: u8 = 0b1110_0000;

const INITIATE: u8 = 0;
const END: u8 = 1;
const ACKNOWLEDGE: u8 = 2;
const START: u8 = 3;
const SUBCOMMAND: u8 = 0b11;

const CHECKSUM: u8 = 1 << 2;
const SIZE_INDICATED: u8 = 1 << 1;
const UNUSED_SHIFT: u8 = 2;

/// No more segments follow.
const LAST: u8 = 0x80;

/// The first byte of an abort, which may come at any time: no segment has the number 0.
pub const ABORT: u8 = 4 << 5;

/// Up to seven bytes of a block. How many of the last one are unused, the end of the transfer says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Segment {
    /// It is the last one of all.
    pub last: bool,
    /// Counted from 1 in each block, up to 127.
    pub sequence: u8,
    /// The bytes.
    pub bytes: [u8; MAX_SEGMENT],
}

impl Segment {
    /// Reads the eight bytes.
    pub fn parse(raw: &[u8; LENGTH]) -> Self {
        let [head, bytes @ ..] = *raw;
        Self { last: head & LAST != 0, sequence: head & !LAST, bytes }
    }

    /// The eight bytes.
    pub fn emit(self) -> [u8; LENGTH] {
        let [a, b, c, d, e, f, g] = self.bytes;
        [if self.last { LAST } else { 0 } | self.sequence & !LAST, a, b, c, d, e, f, g]
    }
}

/// What a client sends beside segments.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Request {
    /// Write an entry.
    InitiateDownload {
        /// The entry.
        mux: Mux,
        /// The client can form the checksum.
        checksum: bool,
        /// Bytes to come, if the client said so.
        size: Option<u32>,
    },
    /// All segments of a download are confirmed.
    EndDownload(End),
    /// Read an entry.
    InitiateUpload {
        /// The entry.
        mux: Mux,
        /// The client can form the checksum.
        checksum: bool,
        /// Segments of a block.
        block_size: u8,
        /// Up to how many bytes the server may answer as if the other upload had been asked for; 0 for never.
        switch_threshold: u8,
    },
    /// Segments of an upload may come.
    StartUpload,
    /// A block of an upload is taken.
    Acknowledge(Acknowledgement),
    /// An upload is taken.
    EndUpload,
}

/// How much of a block has come, and how long the next one may be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Acknowledgement {
    /// The number of the last segment up to which none is missing; 0 for none.
    pub sequence: u8,
    /// Segments of the next block.
    pub block_size: u8,
}

/// The end of the data.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct End {
    /// How many bytes of the last segment carry no data, 0 to 7.
    pub unused: u8,
    /// Over all bytes; 0 where one of the two cannot form it.
    pub checksum: u16,
}

impl Request {
    /// Reads the eight bytes; `None` for what block transfer does not have.
    pub fn parse(raw: &[u8; LENGTH]) -> Option<Self> {
        let checksum = raw[0] & CHECKSUM != 0;
        Some(match (raw[0] & SPECIFIER, raw[0] & SUBCOMMAND) {
            (DOWNLOAD_REQUEST, subcommand) if subcommand & 1 == INITIATE => {
                Self::InitiateDownload { mux: mux(raw), checksum, size: size(raw) }
            }
            (DOWNLOAD_REQUEST, _) => Self::EndDownload(End::parse(raw)),
            (UPLOAD_REQUEST, INITIATE) => {
                Self::InitiateUpload { mux: mux(raw), checksum, block_size: raw[4], switch_threshold: raw[5] }
            }
            (UPLOAD_REQUEST, START) => Self::StartUpload,
            (UPLOAD_REQUEST, ACKNOWLEDGE) => Self::Acknowledge(Acknowledgement::parse(raw)),
            (UPLOAD_REQUEST, _) => Self::EndUpload,
            _ => return None,
        })
    }

    /// The eight bytes.
    pub fn emit(self) -> [u8; LENGTH] {
        match self {
            Self::InitiateDownload { mux, checksum, size } => with_size(DOWNLOAD_REQUEST, mux, checksum, size),
            Self::EndDownload(end) => end.emit(DOWNLOAD_REQUEST),
            Self::InitiateUpload { mux, checksum, block_size, switch_threshold } => {
                with_mux(UPLOAD_REQUEST | flag(CHECKSUM, checksum), mux, [block_size, switch_threshold, 0, 0])
            }
            Self::StartUpload => [UPLOAD_REQUEST | START, 0, 0, 0, 0, 0, 0, 0],
            Self::Acknowledge(acknowledgement) => acknowledgement.emit(UPLOAD_REQUEST),
            Self::EndUpload => [UPLOAD_REQUEST | END, 0, 0, 0, 0, 0, 0, 0],
        }
    }
}

/// What a server sends beside segments.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reply {
    /// Segments of a download may come.
    InitiateDownload {
        /// The entry.
        mux: Mux,
        /// The server can form the checksum.
        checksum: bool,
        /// Segments of a block.
        block_size: u8,
    },
    /// A block of a download is taken.
    Acknowledge(Acknowledgement),
    /// A download is taken.
    EndDownload,
    /// An upload begins.
    InitiateUpload {
        /// The entry.
        mux: Mux,
        /// The server can form the checksum.
        checksum: bool,
        /// Bytes to come, if the server said so.
        size: Option<u32>,
    },
    /// All segments of an upload are confirmed.
    EndUpload(End),
}

impl Reply {
    /// Reads the eight bytes; `None` for what block transfer does not have.
    pub fn parse(raw: &[u8; LENGTH]) -> Option<Self> {
        let checksum = raw[0] & CHECKSUM != 0;
        Some(match (raw[0] & SPECIFIER, raw[0] & SUBCOMMAND) {
            (DOWNLOAD_REPLY, INITIATE) => Self::InitiateDownload { mux: mux(raw), checksum, block_size: raw[4] },
            (DOWNLOAD_REPLY, ACKNOWLEDGE) => Self::Acknowledge(Acknowledgement::parse(raw)),
            (DOWNLOAD_REPLY, END) => Self::EndDownload,
            (UPLOAD_REPLY, subcommand) if subcommand & 1 == INITIATE => {
                Self::InitiateUpload { mux: mux(raw), checksum, size: size(raw) }
            }
            (UPLOAD_REPLY, _) => Self::EndUpload(End::parse(raw)),
            _ => return None,
        })
    }

    /// The eight bytes.
    pub fn emit(self) -> [u8; LENGTH] {
        match self {
            Self::InitiateDownload { mux, checksum, block_size } => {
                with_mux(DOWNLOAD_REPLY | flag(CHECKSUM, checksum), mux, [block_size, 0, 0, 0])
            }
            Self::Acknowledge(acknowledgement) => acknowledgement.emit(DOWNLOAD_REPLY),
            Self::EndDownload => [DOWNLOAD_REPLY | END, 0, 0, 0, 0, 0, 0, 0],
            Self::InitiateUpload { mux, checksum, size } => with_size(UPLOAD_REPLY, mux, checksum, size),
            Self::EndUpload(end) => end.emit(UPLOAD_REPLY),
        }
    }
}

impl Reply {
    /// The entry of which it begins a transfer.
    pub const fn mux(&self) -> Option<Mux> {
        match self {
            Self::InitiateUpload { mux, .. } | Self::InitiateDownload { mux, .. } => Some(*mux),
            _ => None,
        }
    }

    /// How many bytes the upload has that it begins, if the server said so.
    pub const fn declared_size(&self) -> Option<u32> {
        match self {
            Self::InitiateUpload { size, .. } => *size,
            _ => None,
        }
    }
}

impl Acknowledgement {
    fn parse(raw: &[u8; LENGTH]) -> Self {
        Self { sequence: raw[1], block_size: raw[2] }
    }

    fn emit(self, specifier: u8) -> [u8; LENGTH] {
        [specifier | ACKNOWLEDGE, self.sequence, self.block_size, 0, 0, 0, 0, 0]
    }
}

impl End {
    fn parse(raw: &[u8; LENGTH]) -> Self {
        Self { unused: raw[0] >> UNUSED_SHIFT & 0b111, checksum: u16::from_le_bytes([raw[1], raw[2]]) }
    }

    fn emit(self, specifier: u8) -> [u8; LENGTH] {
        let [low, high] = self.checksum.to_le_bytes();
        [specifier | (self.unused & 0b111) << UNUSED_SHIFT | END, low, high, 0, 0, 0, 0, 0]
    }
}

fn mux(raw: &[u8; LENGTH]) -> Mux {
    Mux::new(u16::from_le_bytes([raw[1], raw[2]]), raw[3])
}

fn size(raw: &[u8; LENGTH]) -> Option<u32> {
    (raw[0] & SIZE_INDICATED != 0).then(|| u32::from_le_bytes([raw[4], raw[5], raw[6], raw[7]]))
}

fn with_size(specifier: u8, mux: Mux, checksum: bool, size: Option<u32>) -> [u8; LENGTH] {
    let head = specifier | flag(CHECKSUM, checksum) | flag(SIZE_INDICATED, size.is_some());
    with_mux(head, mux, size.unwrap_or(0).to_le_bytes())
}

fn with_mux(head: u8, mux: Mux, [a, b, c, d]: [u8; 4]) -> [u8; LENGTH] {
    let [low, high] = mux.index.to_le_bytes();
    [head, low, high, mux.sub_index, a, b, c, d]
}

const fn flag(bit: u8, set: bool) -> u8 {
    if set { bit } else { 0 }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;

    const MUX: Mux = Mux::new(0x1F50, 0x12);
    const ENDS: [End; 3] =
        [End { unused: 0, checksum: 0 }, End { unused: 7, checksum: 0xFFFF }, End { unused: 3, checksum: 0x1234 }];
    const ACKNOWLEDGEMENTS: [Acknowledgement; 3] = [
        Acknowledgement { sequence: 0, block_size: 127 },
        Acknowledgement { sequence: 127, block_size: 1 },
        Acknowledgement { sequence: 255, block_size: 0 },
    ];
    const SIZES: [Option<u32>; 3] = [None, Some(0), Some(u32::MAX)];

    #[test]
    fn requests_replies_and_segments_are_parsed_back() {
        for checksum in [false, true] {
            for size in SIZES {
                let request = Request::InitiateDownload { mux: MUX, checksum, size };
                assert_eq!(Request::parse(&request.emit()), Some(request));
                let reply = Reply::InitiateUpload { mux: MUX, checksum, size };
                assert_eq!(Reply::parse(&reply.emit()), Some(reply));
            }
            for block_size in [0, 1, 127, 255] {
                let request =
                    Request::InitiateUpload { mux: MUX, checksum, block_size, switch_threshold: 255 - block_size };
                assert_eq!(Request::parse(&request.emit()), Some(request));
                let reply = Reply::InitiateDownload { mux: MUX, checksum, block_size };
                assert_eq!(Reply::parse(&reply.emit()), Some(reply));
            }
        }
        let requests = ENDS.map(Request::EndDownload).into_iter().chain(ACKNOWLEDGEMENTS.map(Request::Acknowledge));
        for request in requests.chain([Request::StartUpload, Request::EndUpload]) {
            assert_eq!(Request::parse(&request.emit()), Some(request));
        }
        let replies = ENDS.map(Reply::EndUpload).into_iter().chain(ACKNOWLEDGEMENTS.map(Reply::Acknowledge));
        for reply in replies.chain([Reply::EndDownload]) {
            assert_eq!(Reply::parse(&reply.emit()), Some(reply));
        }
        for sequence in 0..=127 {
            for last in [false, true] {
                let segment = Segment { last, sequence, bytes: [1, 2, 3, 4, 5, 6, 7] };
                assert_eq!(Segment::parse(&segment.emit()), segment);
            }
        }
    }

    #[test]
    fn emitting_what_was_parsed_settles_for_every_first_byte() {
        for command in 0..=u8::MAX {
            for rest in [[0; 7], [0xFF; 7], [1, 2, 3, 4, 5, 6, 7]] {
                let mut raw = [command; LENGTH];
                raw[1..].copy_from_slice(&rest);
                let is_block = matches!(command >> 5, 5 | 6);
                // ss = 3 of a server that takes a download is not defined.
                let is_reply = is_block && !(command >> 5 == 5 && command & 3 == 3);
                assert_eq!(Request::parse(&raw).is_some(), is_block, "{command:02X}");
                assert_eq!(Reply::parse(&raw).is_some(), is_reply, "{command:02X}");
                if let Some(request) = Request::parse(&raw) {
                    assert_eq!(Request::parse(&request.emit()), Some(request));
                }
                if let Some(reply) = Reply::parse(&raw) {
                    assert_eq!(Reply::parse(&reply.emit()), Some(reply));
                }
                assert_eq!(Segment::parse(&raw).emit(), raw);
            }
        }
    }

    /// Of the figures of CiA 301, 7.2.4.3.9 to 7.2.4.3.15: cs and ss in the low bits, cc and sc in bit 2, s in bit 1, n in bits 2 to 4.
    #[test]
    fn frames_read_as_the_standard_says() {
        let raw = |text: &str| *text.parse::<can::Frame>().unwrap().padded();
        let request = |text: &str| Request::parse(&raw(text)).unwrap();
        let reply = |text: &str| Reply::parse(&raw(text)).unwrap();
        let mux = Mux::new(0x1F50, 1);
        assert_eq!(
            request("604#C6501F0100000100"),
            Request::InitiateDownload { mux, checksum: true, size: Some(65536) }
        );
        assert_eq!(request("604#C0501F0100000000"), Request::InitiateDownload { mux, checksum: false, size: None });
        assert_eq!(reply("584#A4501F017F000000"), Reply::InitiateDownload { mux, checksum: true, block_size: 127 });
        assert_eq!(reply("584#A20A140000000000"), Reply::Acknowledge(Acknowledgement { sequence: 10, block_size: 20 }));
        assert_eq!(request("604#D5C3310000000000"), Request::EndDownload(End { unused: 5, checksum: 0x31C3 }));
        assert_eq!(reply("584#A100000000000000"), Reply::EndDownload);
        assert_eq!(
            request("604#A4501F0115300000"),
            Request::InitiateUpload { mux, checksum: true, block_size: 21, switch_threshold: 48 }
        );
        assert_eq!(reply("584#C2501F0109000000"), Reply::InitiateUpload { mux, checksum: false, size: Some(9) });
        assert_eq!(request("604#A300000000000000"), Request::StartUpload);
        assert_eq!(
            request("604#A27F7F0000000000"),
            Request::Acknowledge(Acknowledgement { sequence: 127, block_size: 127 })
        );
        assert_eq!(reply("584#DD00000000000000"), Reply::EndUpload(End { unused: 7, checksum: 0 }));
        assert_eq!(request("604#A100000000000000"), Request::EndUpload);
        let last = Segment { last: true, sequence: 2, bytes: *b"abcdefg" };
        assert_eq!(Segment::parse(&raw("604#8261626364656667")), last);
    }
}
