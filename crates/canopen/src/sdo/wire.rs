//! The eight bytes of SDO requests and replies (CiA 301, 7.2.4.3).
//!
//! [`Request`] goes from client to server, [`Reply`] back. Reading never fails on content: what the standard does
//! not define is `Unknown`. Command specifiers are distinguished by their top three bits alone, so 43h asks for an
//! upload as 40h does.

use crate::{AbortCode, Mux};

/// Bytes of every SDO frame.
pub const LENGTH: usize = 8;
/// Most bytes that one frame carries with its multiplexor.
pub const MAX_EXPEDITED: usize = 4;
/// Most bytes of one segment.
pub const MAX_SEGMENT: usize = 7;

const SPECIFIER_SHIFT: u8 = 5;
const TOGGLE: u8 = 1 << 4;
const EXPEDITED: u8 = 1 << 1;
const SIZE_INDICATED: u8 = 1;
const LAST: u8 = 1;

/// Up to seven bytes of a segmented transfer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Segment {
    /// The toggle bit: clear in the first segment.
    pub toggle: bool,
    /// No more segments follow.
    pub last: bool,
    /// How many of the bytes are data, 0 to 7.
    pub length: u8,
    /// The bytes.
    pub bytes: [u8; MAX_SEGMENT],
}

impl Segment {
    /// A segment with `data`; bytes past the seventh are dropped.
    pub fn new(toggle: bool, last: bool, data: &[u8]) -> Self {
        let length = data.len().min(MAX_SEGMENT);
        let mut bytes = [0; MAX_SEGMENT];
        bytes[..length].copy_from_slice(&data[..length]);
        Self { toggle, last, length: length as u8, bytes }
    }

    /// The data of the segment, up to seven bytes.
    pub fn data(&self) -> &[u8] {
        &self.bytes[..usize::from(self.length).min(MAX_SEGMENT)]
    }

    fn parse(raw: &[u8; LENGTH]) -> Self {
        let [command, bytes @ ..] = *raw;
        let unused = command >> 1 & 0b111;
        Self { toggle: command & TOGGLE != 0, last: command & LAST != 0, length: MAX_SEGMENT as u8 - unused, bytes }
    }

    fn emit(self, specifier: u8) -> [u8; LENGTH] {
        let unused = MAX_SEGMENT as u8 - self.data().len() as u8;
        let command = specifier << SPECIFIER_SHIFT | toggle_bit(self.toggle) | unused << 1 | u8::from(self.last);
        let [a, b, c, d, e, f, g] = self.bytes;
        [command, a, b, c, d, e, f, g]
    }
}

/// How an initiating frame carries its data.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Payload {
    /// In this frame. `length` is 1 to 4, or `None` if the sender did not say.
    Expedited {
        /// How many of the bytes are data.
        length: Option<u8>,
        /// The bytes.
        bytes: [u8; MAX_EXPEDITED],
    },
    /// In segments to come; how many bytes altogether, if the sender said so.
    Segmented {
        /// Bytes to come.
        size: Option<u32>,
    },
}

impl Payload {
    /// `data` in one frame; `None` unless it is 1 to 4 bytes.
    pub fn expedited(data: &[u8]) -> Option<Self> {
        if data.is_empty() || data.len() > MAX_EXPEDITED {
            return None;
        }
        let mut bytes = [0; MAX_EXPEDITED];
        bytes[..data.len()].copy_from_slice(data);
        Some(Self::Expedited { length: Some(data.len() as u8), bytes })
    }

    /// Of the eight bytes that initiate a download or answer an upload.
    #[inline(always)]
    pub(super) fn parse(raw: &[u8; LENGTH]) -> Self {
        let [command, _, _, _, bytes @ ..] = *raw;
        let indicated = command & SIZE_INDICATED != 0;
        if command & EXPEDITED != 0 {
            let unused = command >> 2 & 0b11;
            Self::Expedited { length: indicated.then_some(MAX_EXPEDITED as u8 - unused), bytes }
        } else {
            Self::Segmented { size: indicated.then_some(u32::from_le_bytes(bytes)) }
        }
    }

    // The variant is known where it is called.
    #[inline(always)]
    fn emit(self, specifier: u8, mux: Mux) -> [u8; LENGTH] {
        let (flags, bytes) = match self {
            Self::Expedited { length: Some(length), bytes } => {
                let unused = MAX_EXPEDITED as u8 - length.clamp(1, MAX_EXPEDITED as u8);
                (EXPEDITED | SIZE_INDICATED | unused << 2, bytes)
            }
            Self::Expedited { length: None, bytes } => (EXPEDITED, bytes),
            Self::Segmented { size: Some(size) } => (SIZE_INDICATED, size.to_le_bytes()),
            Self::Segmented { size: None } => (0, [0; 4]),
        };
        with_mux(specifier << SPECIFIER_SHIFT | flags, mux, bytes)
    }
}

/// What a client asks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Request {
    /// Write an entry.
    InitiateDownload(Mux, Payload),
    /// Data of a segmented download.
    DownloadSegment(Segment),
    /// Read an entry.
    InitiateUpload(Mux),
    /// The next segment of a segmented upload, with the toggle bit expected in it.
    UploadSegment {
        /// The toggle bit.
        toggle: bool,
    },
    /// The client gives up.
    Abort(Mux, AbortCode),
    /// Anything else: block transfer (specifiers 5 and 6) or the undefined specifier 7.
    Unknown {
        /// The first byte.
        command: u8,
        /// Where block transfer has its multiplexor.
        mux: Mux,
    },
}

impl Request {
    /// Reads the eight bytes; of a shorter frame, padded with zeros.
    // Inlined, each way of a server's `match` begins where the variant is found.
    #[inline(always)]
    pub fn parse(raw: &[u8; LENGTH]) -> Self {
        match raw[0] >> SPECIFIER_SHIFT {
            0 => Self::DownloadSegment(Segment::parse(raw)),
            1 => Self::InitiateDownload(mux(raw), Payload::parse(raw)),
            2 => Self::InitiateUpload(mux(raw)),
            3 => Self::UploadSegment { toggle: raw[0] & TOGGLE != 0 },
            4 => Self::Abort(mux(raw), abort_code(raw)),
            _ => Self::Unknown { command: raw[0], mux: mux(raw) },
        }
    }

    /// The eight bytes.
    pub fn emit(self) -> [u8; LENGTH] {
        match self {
            Self::DownloadSegment(segment) => segment.emit(0),
            Self::InitiateDownload(mux, payload) => payload.emit(1, mux),
            Self::InitiateUpload(mux) => with_mux(2 << SPECIFIER_SHIFT, mux, [0; 4]),
            Self::UploadSegment { toggle } => [3 << SPECIFIER_SHIFT | toggle_bit(toggle), 0, 0, 0, 0, 0, 0, 0],
            Self::Abort(mux, code) => abort(mux, code),
            Self::Unknown { command, mux } => with_mux(command, mux, [0; 4]),
        }
    }

    /// How many bytes of the frame mean something: what the shortest tolerable frame has.
    pub fn used_length(&self) -> u8 {
        match self {
            Self::InitiateDownload(_, Payload::Expedited { length, .. }) => 4 + length.unwrap_or(1).min(4),
            Self::InitiateDownload(_, Payload::Segmented { size }) => 4 + if size.is_some() { 4 } else { 0 },
            Self::DownloadSegment(segment) => 1 + segment.data().len() as u8,
            Self::InitiateUpload(_) => 4,
            Self::UploadSegment { .. } | Self::Unknown { .. } => 1,
            Self::Abort(..) => 8,
        }
    }
}

/// What a server answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reply {
    /// Data of a segmented upload.
    UploadSegment(Segment),
    /// A segment of a download is taken.
    DownloadSegment {
        /// The toggle bit of that segment.
        toggle: bool,
    },
    /// An upload begins, or is done at once.
    InitiateUpload(Mux, Payload),
    /// A download may begin, or is done at once.
    InitiateDownload(Mux),
    /// The server refuses.
    Abort(Mux, AbortCode),
    /// Anything else.
    Unknown {
        /// The first byte.
        command: u8,
        /// Where most replies have their multiplexor.
        mux: Mux,
    },
}

impl Reply {
    /// Reads the eight bytes; of a shorter frame, padded with zeros.
    pub fn parse(raw: &[u8; LENGTH]) -> Self {
        match raw[0] >> SPECIFIER_SHIFT {
            0 => Self::UploadSegment(Segment::parse(raw)),
            1 => Self::DownloadSegment { toggle: raw[0] & TOGGLE != 0 },
            2 => Self::InitiateUpload(mux(raw), Payload::parse(raw)),
            3 => Self::InitiateDownload(mux(raw)),
            4 => Self::Abort(mux(raw), abort_code(raw)),
            _ => Self::Unknown { command: raw[0], mux: mux(raw) },
        }
    }

    /// The eight bytes.
    // The variant is known wherever a server answers: inlined, only its few moves are left.
    #[inline(always)]
    pub fn emit(self) -> [u8; LENGTH] {
        match self {
            Self::UploadSegment(segment) => segment.emit(0),
            Self::DownloadSegment { toggle } => [1 << SPECIFIER_SHIFT | toggle_bit(toggle), 0, 0, 0, 0, 0, 0, 0],
            Self::InitiateUpload(mux, payload) => payload.emit(2, mux),
            Self::InitiateDownload(mux) => with_mux(3 << SPECIFIER_SHIFT, mux, [0; 4]),
            Self::Abort(mux, code) => abort(mux, code),
            Self::Unknown { command, mux } => with_mux(command, mux, [0; 4]),
        }
    }
}

fn mux(raw: &[u8; LENGTH]) -> Mux {
    Mux::new(u16::from_le_bytes([raw[1], raw[2]]), raw[3])
}

fn abort_code(raw: &[u8; LENGTH]) -> AbortCode {
    AbortCode(u32::from_le_bytes([raw[4], raw[5], raw[6], raw[7]]))
}

fn abort(mux: Mux, code: AbortCode) -> [u8; LENGTH] {
    with_mux(4 << SPECIFIER_SHIFT, mux, code.0.to_le_bytes())
}

// One number, not eight bytes: it is stored at once and may be read again at once.
fn with_mux(command: u8, mux: Mux, data: [u8; 4]) -> [u8; LENGTH] {
    let head = u32::from(command) | u32::from(mux.index) << 8 | u32::from(mux.sub_index) << 24;
    (u64::from(head) | u64::from(u32::from_le_bytes(data)) << 32).to_le_bytes()
}

const fn toggle_bit(toggle: bool) -> u8 {
    if toggle { TOGGLE } else { 0 }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;

    const MUX: Mux = Mux::new(0x6041, 0x12);

    fn payloads() -> impl Iterator<Item = Payload> {
        let expedited = (1..=4).map(|length| Payload::expedited(&[1, 2, 3, 4][..length]).unwrap());
        let unsized_bytes = Payload::Expedited { length: None, bytes: [9, 8, 7, 6] };
        let segmented = [None, Some(0), Some(5), Some(u32::MAX)].map(|size| Payload::Segmented { size });
        expedited.chain([unsized_bytes]).chain(segmented)
    }

    fn segments() -> impl Iterator<Item = Segment> {
        (0..=7).flat_map(|length| {
            [(false, false), (false, true), (true, false), (true, true)]
                .map(|(toggle, last)| Segment::new(toggle, last, &[1, 2, 3, 4, 5, 6, 7][..length]))
        })
    }

    #[test]
    fn requests_are_parsed_back() {
        let requests = payloads()
            .map(|payload| Request::InitiateDownload(MUX, payload))
            .chain(segments().map(Request::DownloadSegment))
            .chain([false, true].map(|toggle| Request::UploadSegment { toggle }))
            .chain([Request::InitiateUpload(MUX), Request::Abort(MUX, AbortCode::TOGGLE_BIT)])
            .chain([Request::Unknown { command: 0xE0, mux: MUX }]);
        for request in requests {
            assert_eq!(Request::parse(&request.emit()), request);
        }
    }

    #[test]
    fn replies_are_parsed_back() {
        let replies = payloads()
            .map(|payload| Reply::InitiateUpload(MUX, payload))
            .chain(segments().map(Reply::UploadSegment))
            .chain([false, true].map(|toggle| Reply::DownloadSegment { toggle }))
            .chain([Reply::InitiateDownload(MUX), Reply::Abort(MUX, AbortCode::GENERAL)])
            .chain([Reply::Unknown { command: 0xE0, mux: MUX }]);
        for reply in replies {
            assert_eq!(Reply::parse(&reply.emit()), reply);
        }
    }

    #[test]
    fn emitting_what_was_parsed_settles_for_every_first_byte() {
        // Bits and bytes that the standard reserves are sent as zero, so once through makes a frame canonical.
        for command in 0..=u8::MAX {
            for rest in [[0; 7], [0xFF; 7], [1, 2, 3, 4, 5, 6, 7]] {
                let mut raw = [command; LENGTH];
                raw[1..].copy_from_slice(&rest);
                let request = Request::parse(&raw).emit();
                assert_eq!(Request::parse(&request).emit(), request);
                assert_eq!(request[0] >> 5, command >> 5);
                let reply = Reply::parse(&raw).emit();
                assert_eq!(Reply::parse(&reply).emit(), reply);
                assert_eq!(reply[0] >> 5, command >> 5);
            }
        }
    }

    #[test]
    fn printed_frames_read_as_the_standard_says() {
        let parse = |text: &str| Request::parse(text.parse::<can::Frame>().unwrap().padded());
        assert_eq!(
            parse("604#2B40600006000000"),
            Request::InitiateDownload(Mux::new(0x6040, 0), Payload::Expedited { length: Some(2), bytes: [6, 0, 0, 0] })
        );
        assert_eq!(
            parse("604#2111200109000000"),
            Request::InitiateDownload(Mux::new(0x2011, 1), Payload::Segmented { size: Some(9) })
        );
        assert_eq!(parse("604#40416000"), Request::InitiateUpload(Mux::new(0x6041, 0)));
        assert_eq!(parse("604#8041600011000906"), Request::Abort(Mux::new(0x6041, 0), AbortCode::NO_SUCH_SUB_INDEX));
        assert_eq!(parse("604#1B61620000000000"), Request::DownloadSegment(Segment::new(true, true, b"ab")));
    }
}
