//! cannelloni datagrams as data: [`emit`] makes one, [`Datagram::parse`] reads one.
//!
//! A datagram is a head of five bytes (version 2, operation, sequence number, count of frames as 16 bits) and the frames: the
//! identifier with Linux's flags as 32 bits, a length with bit 7 for CAN FD, for those a byte of flags, and the data; a remote
//! frame has none. Numbers are big endian.
//!
//! Pure: bytes in, items out. What is torn costs the rest of its datagram, whose frames cannot be found any more.

use can::{CanId, Frame, MAX_DATA_LENGTH};

use crate::raw_id::RawId;

/// The version of the protocol.
const VERSION: u8 = 2;
/// The operation that carries frames; 1 and 2 (acknowledgements) are reserved and never sent.
const DATA: u8 = 0;
const HEAD_LENGTH: usize = 5;
/// In the byte of the length: a CAN FD frame.
const FD_FLAG: u8 = 0x80;
/// Longest data of a CAN FD frame.
const MAX_FD_LENGTH: u8 = 64;

/// A datagram whose head is right.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Datagram<'a> {
    sequence: u8,
    frames_left: u16,
    rest: &'a [u8],
}

/// What a datagram carries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Item {
    /// A frame of classical CAN.
    Frame(Frame),
    /// A CAN FD frame, whose data are not kept.
    FdFrame {
        /// Its identifier.
        id: CanId,
        /// Bytes of data, 0 to 64.
        length: u8,
    },
    /// An error message of Linux's: class and data (`linux/can/error.h`).
    Error {
        /// The class, as bits.
        class: u32,
        /// What it says.
        data: [u8; MAX_DATA_LENGTH],
    },
}

/// Why bytes are not a cannelloni datagram.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MalformedDatagram {
    /// Less than a head.
    #[error("{0} bytes, expected a head of {HEAD_LENGTH}")]
    NoHead(usize),
    /// Another version, or another protocol.
    #[error("version {0}, expected {VERSION}")]
    Version(u8),
    /// An operation that is not known.
    #[error("operation {0}, expected {DATA} (frames)")]
    Operation(u8),
    /// The bytes end inside of a frame.
    #[error("the datagram ends {missing} frames short of what its head says")]
    Truncated {
        /// Frames that are not there or not whole.
        missing: u16,
    },
    /// A standard identifier above 7FFh, or more data than a frame can have.
    #[error("identifier word {word:08X}h with {length} bytes is not a CAN frame")]
    Frame {
        /// The identifier with its flags.
        word: u32,
        /// The length, without the flag of CAN FD.
        length: u8,
    },
}

/// Appends a datagram that carries `frame` alone: a frame waits for no other.
pub fn emit(sequence: u8, frame: &Frame, out: &mut Vec<u8>) {
    out.extend_from_slice(&[VERSION, DATA, sequence, 0, 1]);
    out.extend_from_slice(&RawId::word_of(frame).to_be_bytes());
    out.push(frame.dlc());
    out.extend_from_slice(frame.data());
}

impl<'a> Datagram<'a> {
    /// Reads the head.
    pub fn parse(bytes: &'a [u8]) -> Result<Self, MalformedDatagram> {
        let ([version, operation, sequence, high, low], rest) =
            bytes.split_first_chunk::<HEAD_LENGTH>().ok_or(MalformedDatagram::NoHead(bytes.len()))?;
        match (*version, *operation) {
            (VERSION, DATA) => Ok(Self { sequence: *sequence, frames_left: u16::from_be_bytes([*high, *low]), rest }),
            (VERSION, other) => Err(MalformedDatagram::Operation(other)),
            (other, _) => Err(MalformedDatagram::Version(other)),
        }
    }

    /// Counts up with each datagram, and wraps.
    pub const fn sequence(&self) -> u8 {
        self.sequence
    }

    fn item(&mut self) -> Result<Item, MalformedDatagram> {
        let truncated = MalformedDatagram::Truncated { missing: self.frames_left };
        let ([a, b, c, d, length], rest) = self.rest.split_first_chunk::<5>().ok_or(truncated)?;
        let word = u32::from_be_bytes([*a, *b, *c, *d]);
        let (is_fd, length) = (length & FD_FLAG != 0, length & !FD_FLAG);
        let id = RawId::of_word(word).ok_or(MalformedDatagram::Frame { word, length })?;
        if let RawId::Remote(id) = id {
            self.rest = rest;
            let fits = usize::from(length) <= MAX_DATA_LENGTH && !is_fd;
            return if fits {
                Ok(Item::Frame(Frame::remote(id, length)))
            } else {
                Err(MalformedDatagram::Frame { word, length })
            };
        }
        let longest = if is_fd { MAX_FD_LENGTH } else { MAX_DATA_LENGTH as u8 };
        if length > longest {
            return Err(MalformedDatagram::Frame { word, length });
        }
        let rest = if is_fd { rest.get(1..).ok_or(truncated)? } else { rest };
        let (data, rest) = rest.split_at_checked(usize::from(length)).ok_or(truncated)?;
        self.rest = rest;
        Ok(match id {
            RawId::Data(id) if is_fd => Item::FdFrame { id, length },
            RawId::Data(id) | RawId::Remote(id) => Item::Frame(Frame::new(id, data)),
            RawId::Error(class) => {
                let mut said = [0; MAX_DATA_LENGTH];
                said.iter_mut().zip(data).for_each(|(to, from)| *to = *from);
                Item::Error { class, data: said }
            }
        })
    }
}

/// The items; after the first error there are no more.
impl Iterator for Datagram<'_> {
    type Item = Result<Item, MalformedDatagram>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.frames_left == 0 {
            return None;
        }
        let item = self.item();
        self.frames_left = if item.is_ok() { self.frames_left - 1 } else { 0 };
        Some(item)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;

    fn items(bytes: &[u8]) -> Vec<Result<Item, MalformedDatagram>> {
        Datagram::parse(bytes).map_or_else(|error| vec![Err(error)], Iterator::collect)
    }

    fn frame(text: &str) -> Result<Item, MalformedDatagram> {
        Ok(Item::Frame(text.parse().unwrap()))
    }

    #[test]
    fn a_datagram_has_the_form_of_the_protocol() {
        let mut out = Vec::new();
        emit(7, &"604#4041".parse().unwrap(), &mut out);
        assert_eq!(out, [2, 0, 7, 0, 1, 0, 0, 0x06, 0x04, 2, 0x40, 0x41]);
        out.clear();
        emit(255, &"1AAAAAAA#R3".parse().unwrap(), &mut out);
        assert_eq!(out, [2, 0, 255, 0, 1, 0xDA, 0xAA, 0xAA, 0xAA, 3]);
    }

    #[test]
    fn several_frames_of_every_kind_come_out_in_order() {
        let bytes = [
            &[2, 0, 9, 0, 4][..],
            &[0, 0, 0x01, 0x81, 1, 0xAB],
            &[0, 0, 0x02, 0x81, 0x80 | 12, 1, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12],
            &[0x20, 0, 0, 0x40, 8, 0, 0, 0, 0, 0, 0, 0, 0],
            &[0x40, 0, 0x07, 0x04, 0],
        ]
        .concat();
        let found = items(&bytes);
        let error = Ok(Item::Error { class: 0x40, data: [0; 8] });
        let fd = Ok(Item::FdFrame { id: CanId::standard(0x281), length: 12 });
        assert_eq!(found, [frame("181#AB"), fd, error, frame("704#R0")]);
        assert_eq!(Datagram::parse(&bytes).unwrap().sequence(), 9);
    }

    #[test]
    fn what_is_malformed_is_named_and_ends_its_datagram() {
        assert_eq!(items(&[]), [Err(MalformedDatagram::NoHead(0))]);
        assert_eq!(items(&[2, 0, 1, 0]), [Err(MalformedDatagram::NoHead(4))]);
        assert_eq!(items(&[1, 0, 1, 0, 0]), [Err(MalformedDatagram::Version(1))]);
        assert_eq!(items(&[2, 1, 1, 0, 0]), [Err(MalformedDatagram::Operation(1))]);
        let whole = [2, 0, 0, 0, 2, 0, 0, 1, 0x81, 1, 0xAB, 0, 0, 1, 0x82, 1];
        assert_eq!(items(&whole), [frame("181#AB"), Err(MalformedDatagram::Truncated { missing: 1 })]);
        assert_eq!(items(&whole[..8]), [Err(MalformedDatagram::Truncated { missing: 2 })]);
        let long = [2, 0, 0, 0, 1, 0, 0, 1, 0x81, 9, 1, 2, 3, 4, 5, 6, 7, 8, 9];
        assert_eq!(items(&long), [Err(MalformedDatagram::Frame { word: 0x181, length: 9 })]);
        let wide = [2, 0, 0, 0, 1, 0, 0, 8, 0, 0];
        assert_eq!(items(&wide), [Err(MalformedDatagram::Frame { word: 0x800, length: 0 })]);
        let fd = [2, 0, 0, 0, 1, 0, 0, 1, 0x81, 0x80 | 65];
        assert_eq!(items(&fd), [Err(MalformedDatagram::Frame { word: 0x181, length: 65 })]);
    }

    #[test]
    fn reading_gives_back_what_was_emitted_and_random_bytes_never_panic() {
        let mut random = Random::new(0x5EED_0010);
        for _ in 0..2_000 {
            let frame = random.frame();
            let mut out = Vec::new();
            emit(random.next() as u8, &frame, &mut out);
            assert_eq!(items(&out), [Ok(Item::Frame(frame))]);
            let mut noise = random.salad(&[&[2, 0, 1, 0, 5], &[0, 0, 1, 0x81, 2, 1, 2], &[0x80], &[0xFF]], 12);
            assert!(items(&noise).len() <= usize::from(u16::MAX));
            noise.splice(0..0, [2, 0, 0, 0xFF, 0xFF]);
            assert!(items(&noise).last().unwrap().is_err(), "no salad has 65535 frames");
        }
    }
}
