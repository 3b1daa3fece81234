//! Requests and replies of LSS as frames (CiA 305, clause 7), and what they carry. Source of all numbers: CiA 305.

use can::{CanId, Frame};

use crate::connection_set::{LSS_MASTER, LSS_SLAVE};

/// Bytes of every LSS frame.
const LENGTH: usize = 8;

/// The node-ID of a device that has none. Source: CiA 305, 5.2.
pub const UNCONFIGURED: u8 = 255;

/// What names one device among all: identity and serial number, 1018h:01 to 04.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Address {
    /// Vendor-ID, product code, revision number, serial number.
    pub numbers: [u32; 4],
}

/// One of the four numbers of an address.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// 1018h:01.
    VendorId,
    /// 1018h:02.
    ProductCode,
    /// 1018h:03.
    RevisionNumber,
    /// 1018h:04.
    SerialNumber,
}

impl Part {
    /// In their order on the wire.
    pub const ALL: [Self; 4] = [Self::VendorId, Self::ProductCode, Self::RevisionNumber, Self::SerialNumber];
}

/// What devices are to be like that answer [`Request::Identify`]. Clause 6.5.1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bound {
    /// 1018h:01 is this.
    VendorId,
    /// 1018h:02 is this.
    ProductCode,
    /// 1018h:03 is this or higher.
    LowestRevision,
    /// 1018h:03 is this or lower.
    HighestRevision,
    /// 1018h:04 is this or higher.
    LowestSerial,
    /// 1018h:04 is this or lower.
    HighestSerial,
}

impl Bound {
    /// In their order on the wire.
    pub const ALL: [Self; 6] = [
        Self::VendorId,
        Self::ProductCode,
        Self::LowestRevision,
        Self::HighestRevision,
        Self::LowestSerial,
        Self::HighestSerial,
    ];
}

/// The bit rates of CiA 305, table 1, in kbit/s, by their index; 5 is reserved, and 9 is that which the device finds out.
pub const BIT_RATES_KBIT: [Option<u16>; 9] =
    [Some(1000), Some(800), Some(500), Some(250), Some(125), None, Some(50), Some(20), Some(10)];

/// What a master asks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Request {
    /// All devices wait (false) or let themselves be configured (true). No answer. Clause 6.2.1.
    SwitchGlobal(bool),
    /// One number of the device that is meant; the fourth is answered by the one that all four fit. Clause 6.2.2.
    SwitchSelective(Part, u32),
    /// The node-ID from the next NMT reset communication on. Clause 6.3.1.
    ConfigureNodeId(u8),
    /// The bit rate by table and index. Clause 6.3.2.
    ConfigureBitRate {
        /// 0 is CiA 305's own.
        table: u8,
        /// The place in it.
        index: u8,
    },
    /// All take their new bit rate, silent for this long in ms before and after. No answer. Clause 6.3.3.
    ActivateBitRate(u16),
    /// Node-ID and bit rate are kept. Clause 6.3.4.
    Store,
    /// One number of the address. Clause 6.4.1.
    Inquire(Part),
    /// The node-ID. Clause 6.4.2.
    InquireNodeId,
    /// Is there a device without a node-ID? Clause 6.5.2.
    IdentifyNonConfigured,
    /// Is there a device within all six bounds, with a node-ID or without? The sixth is answered. Clause 6.5.1.
    Identify(Bound, u32),
    /// Is there a device whose number has these bits, above `bit`? Clause 6.5.3.
    FastScan {
        /// What is compared.
        number: u32,
        /// The lowest bit that counts; 128 asks whether there is any device.
        bit: u8,
        /// Which number, 0 to 3.
        part: u8,
        /// Which one comes next, for whom this one fits.
        next: u8,
    },
    /// Any other command specifier.
    Unknown(u8),
}

/// What a slave answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reply {
    /// It is the device with that address, and can be configured.
    Selected,
    /// Outcome of [`Request::ConfigureNodeId`].
    NodeIdConfigured(Outcome),
    /// Outcome of [`Request::ConfigureBitRate`].
    BitRateConfigured(Outcome),
    /// Outcome of [`Request::Store`].
    Stored(Outcome),
    /// A number of its address.
    Number(Part, u32),
    /// Its node-ID, 255 for none.
    NodeId(u8),
    /// A slave fits. Of several that answer at once one frame is seen.
    Identified,
    /// A slave has no node-ID.
    NonConfigured,
    /// Any other command specifier.
    Unknown(u8),
}

/// How a configuration went: 0 is done, 255 an error of the maker's, and others by service.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Outcome {
    /// The error code.
    pub code: u8,
    /// The maker's, where the code is 255.
    pub specific: u8,
}

impl Outcome {
    /// Done.
    pub const DONE: Self = Self { code: 0, specific: 0 };
    /// Node-ID out of range, bit rate not supported, or no store: by service.
    pub const REFUSED: Self = Self { code: 1, specific: 0 };
}

const SWITCH_GLOBAL: u8 = 4;
const CONFIGURE_NODE_ID: u8 = 17;
const CONFIGURE_BIT_RATE: u8 = 19;
const ACTIVATE_BIT_RATE: u8 = 21;
const STORE: u8 = 23;
/// Four specifiers, one for each part; the answer to the fourth is the one behind.
const SWITCH_SELECTIVE: u8 = 64;
const SELECTED: u8 = 68;
/// Six specifiers, one for each bound.
const IDENTIFY: u8 = 70;
const IDENTIFY_NON_CONFIGURED: u8 = 76;
const IDENTIFIED: u8 = 79;
const NON_CONFIGURED: u8 = 80;
const FAST_SCAN: u8 = 81;
/// Four specifiers, one for each part.
const INQUIRE: u8 = 90;
const INQUIRE_NODE_ID: u8 = 94;

fn part(specifier: u8, first: u8) -> Option<Part> {
    Part::ALL.get(usize::from(specifier.checked_sub(first)?)).copied()
}

fn bound(specifier: u8) -> Option<Bound> {
    Bound::ALL.get(usize::from(specifier.checked_sub(IDENTIFY)?)).copied()
}

fn number(raw: &[u8; LENGTH]) -> u32 {
    u32::from_le_bytes([raw[1], raw[2], raw[3], raw[4]])
}

fn with_number(specifier: u8, number: u32) -> [u8; LENGTH] {
    let [a, b, c, d] = number.to_le_bytes();
    [specifier, a, b, c, d, 0, 0, 0]
}

impl Request {
    /// Reads a frame; `None` if it is not of an LSS master.
    pub fn parse(frame: &Frame) -> Option<Self> {
        let raw = payload(frame, LSS_MASTER)?;
        Some(match raw[0] {
            SWITCH_GLOBAL => Self::SwitchGlobal(raw[1] != 0),
            CONFIGURE_NODE_ID => Self::ConfigureNodeId(raw[1]),
            CONFIGURE_BIT_RATE => Self::ConfigureBitRate { table: raw[1], index: raw[2] },
            ACTIVATE_BIT_RATE => Self::ActivateBitRate(u16::from_le_bytes([raw[1], raw[2]])),
            STORE => Self::Store,
            INQUIRE_NODE_ID => Self::InquireNodeId,
            IDENTIFY_NON_CONFIGURED => Self::IdentifyNonConfigured,
            FAST_SCAN => Self::FastScan { number: number(raw), bit: raw[5], part: raw[6], next: raw[7] },
            specifier => match (part(specifier, SWITCH_SELECTIVE), bound(specifier), part(specifier, INQUIRE)) {
                (Some(part), ..) => Self::SwitchSelective(part, number(raw)),
                (_, Some(bound), _) => Self::Identify(bound, number(raw)),
                (.., Some(part)) => Self::Inquire(part),
                _ => Self::Unknown(specifier),
            },
        })
    }

    /// The frame of eight bytes: a master's on 7E5h, a slave's on 7E4h (CiA 305).
    pub fn emit(self) -> Frame {
        let short = |specifier, a, b| [specifier, a, b, 0, 0, 0, 0, 0];
        let raw = match self {
            Self::SwitchGlobal(configure) => short(SWITCH_GLOBAL, u8::from(configure), 0),
            Self::SwitchSelective(part, number) => with_number(SWITCH_SELECTIVE + part as u8, number),
            Self::ConfigureNodeId(node) => short(CONFIGURE_NODE_ID, node, 0),
            Self::ConfigureBitRate { table, index } => short(CONFIGURE_BIT_RATE, table, index),
            Self::ActivateBitRate(ms) => short(ACTIVATE_BIT_RATE, ms.to_le_bytes()[0], ms.to_le_bytes()[1]),
            Self::Store => short(STORE, 0, 0),
            Self::Inquire(part) => short(INQUIRE + part as u8, 0, 0),
            Self::InquireNodeId => short(INQUIRE_NODE_ID, 0, 0),
            Self::IdentifyNonConfigured => short(IDENTIFY_NON_CONFIGURED, 0, 0),
            Self::Identify(bound, number) => with_number(IDENTIFY + bound as u8, number),
            Self::FastScan { number, bit, part, next } => {
                let mut raw = with_number(FAST_SCAN, number);
                raw[5..].copy_from_slice(&[bit, part, next]);
                raw
            }
            Self::Unknown(specifier) => short(specifier, 0, 0),
        };
        Frame::full(LSS_MASTER, raw)
    }

    /// True if `reply` may be an answer to it.
    pub const fn is_answered_by(&self, reply: &Reply) -> bool {
        match (self, reply) {
            (Self::SwitchSelective(Part::SerialNumber, _), Reply::Selected)
            | (Self::ConfigureNodeId(_), Reply::NodeIdConfigured(_))
            | (Self::ConfigureBitRate { .. }, Reply::BitRateConfigured(_))
            | (Self::Store, Reply::Stored(_))
            | (Self::InquireNodeId, Reply::NodeId(_))
            | (Self::IdentifyNonConfigured, Reply::NonConfigured)
            | (Self::FastScan { .. } | Self::Identify(Bound::HighestSerial, _), Reply::Identified) => true,
            (Self::Inquire(asked), Reply::Number(answered, _)) => *asked as u8 == *answered as u8,
            _ => false,
        }
    }

    /// True if a slave may answer it.
    pub const fn is_answered(&self) -> bool {
        match self {
            Self::SwitchGlobal(_) | Self::ActivateBitRate(_) => false,
            // Of the frames of one question the last is answered.
            Self::SwitchSelective(part, _) => matches!(part, Part::SerialNumber),
            Self::Identify(bound, _) => matches!(bound, Bound::HighestSerial),
            _ => true,
        }
    }
}

impl Reply {
    /// Reads a frame; `None` if it is not of an LSS slave.
    pub fn parse(frame: &Frame) -> Option<Self> {
        let raw = payload(frame, LSS_SLAVE)?;
        let outcome = Outcome { code: raw[1], specific: raw[2] };
        Some(match raw[0] {
            SELECTED => Self::Selected,
            CONFIGURE_NODE_ID => Self::NodeIdConfigured(outcome),
            CONFIGURE_BIT_RATE => Self::BitRateConfigured(outcome),
            STORE => Self::Stored(outcome),
            INQUIRE_NODE_ID => Self::NodeId(raw[1]),
            IDENTIFIED => Self::Identified,
            NON_CONFIGURED => Self::NonConfigured,
            specifier => match part(specifier, INQUIRE) {
                Some(part) => Self::Number(part, number(raw)),
                None => Self::Unknown(specifier),
            },
        })
    }

    /// The frame of eight bytes: a master's on 7E5h, a slave's on 7E4h (CiA 305).
    pub fn emit(self) -> Frame {
        let short = |specifier, a, b| [specifier, a, b, 0, 0, 0, 0, 0];
        let raw = match self {
            Self::Selected => short(SELECTED, 0, 0),
            Self::NodeIdConfigured(outcome) => short(CONFIGURE_NODE_ID, outcome.code, outcome.specific),
            Self::BitRateConfigured(outcome) => short(CONFIGURE_BIT_RATE, outcome.code, outcome.specific),
            Self::Stored(outcome) => short(STORE, outcome.code, outcome.specific),
            Self::Number(part, number) => with_number(INQUIRE + part as u8, number),
            Self::NodeId(node) => short(INQUIRE_NODE_ID, node, 0),
            Self::Identified => short(IDENTIFIED, 0, 0),
            Self::NonConfigured => short(NON_CONFIGURED, 0, 0),
            Self::Unknown(specifier) => short(specifier, 0, 0),
        };
        Frame::full(LSS_SLAVE, raw)
    }
}

/// The eight bytes of a data frame with this identifier. Shorter ones are not LSS (CiA 305, 7.2).
fn payload(frame: &Frame, id: CanId) -> Option<&[u8; LENGTH]> {
    (frame.id() == id && !frame.is_remote() && frame.data().len() == LENGTH).then(|| frame.padded())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn requests_and_replies_are_parsed_back() {
        let requests = [
            Request::SwitchGlobal(true),
            Request::ConfigureNodeId(5),
            Request::ConfigureBitRate { table: 0, index: 2 },
            Request::ActivateBitRate(0x1234),
            Request::Store,
            Request::InquireNodeId,
            Request::IdentifyNonConfigured,
            Request::FastScan { number: 0x8000_0001, bit: 31, part: 3, next: 0 },
            Request::Unknown(200),
        ];
        let of_parts = Part::ALL.map(|part| [Request::SwitchSelective(part, 7), Request::Inquire(part)]);
        let of_bounds = Bound::ALL.map(|bound| Request::Identify(bound, 0xDEAD_BEEF));
        for request in requests.into_iter().chain(of_parts.into_iter().flatten()).chain(of_bounds) {
            assert_eq!(Request::parse(&request.emit()), Some(request));
        }
        let replies = [
            Reply::Selected,
            Reply::NodeIdConfigured(Outcome { code: 255, specific: 3 }),
            Reply::BitRateConfigured(Outcome::REFUSED),
            Reply::Stored(Outcome::DONE),
            Reply::NodeId(UNCONFIGURED),
            Reply::Identified,
            Reply::NonConfigured,
            Reply::Unknown(1),
        ];
        for reply in replies.into_iter().chain(Part::ALL.map(|part| Reply::Number(part, 0xDEAD_BEEF))) {
            assert_eq!(Reply::parse(&reply.emit()), Some(reply));
        }
    }

    #[test]
    fn command_specifiers_are_those_of_the_standard() {
        // CiA 305, clause 7: switch state global 04h, selective 40h to 43h and 44h, node-ID 11h, fastscan 51h and 4Fh.
        let text = |frame: Frame| frame.data()[0];
        assert_eq!(text(Request::SwitchGlobal(true).emit()), 0x04);
        assert_eq!(text(Request::SwitchSelective(Part::SerialNumber, 0).emit()), 0x43);
        assert_eq!((text(Reply::Selected.emit()), text(Request::ConfigureNodeId(1).emit())), (0x44, 0x11));
        assert_eq!((text(Request::Inquire(Part::VendorId).emit()), text(Request::InquireNodeId.emit())), (0x5A, 0x5E));
        // Identify remote slave 46h to 4Bh.
        assert_eq!(text(Request::Identify(Bound::VendorId, 0).emit()), 0x46);
        assert_eq!(text(Request::Identify(Bound::HighestSerial, 0).emit()), 0x4B);
        let scan = Request::FastScan { number: 0x1234_5678, bit: 128, part: 0, next: 0 }.emit();
        assert_eq!(scan, "7E5#5178563412800000".parse().unwrap());
        assert_eq!(text(Reply::Identified.emit()), 0x4F);
        assert_eq!(Request::parse(&"7E5#0401".parse().unwrap()), None);
    }
}
