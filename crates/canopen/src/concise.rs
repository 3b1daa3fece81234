//! The concise form of a device configuration file: what a configuration manager keeps of each node in 1F22h, and writes to
//! it at boot-up. Source: CiA 302-3, object 1F22h; little-endian, without any padding:
//!
//! ```text
//! entries: U32, then for each: index U16, sub-index U8, size U32, the data in `size` bytes
//! ```
//!
//! In: bytes, borrowed. Out: entries in the order of the stream, which is the order to write them in, or what is wrong and
//! where. What the entries mean is not known here: a stream does not even say which device it is for.
//!
//! ```
//! use canopen::concise::{Concise, Entry, emit};
//! use canopen::Mux;
//!
//! let heartbeat = Entry { mux: Mux::new(0x1017, 0), data: &[0xC8, 0x00] };
//! let mut stream = Vec::new();
//! emit([heartbeat], |bytes| stream.extend_from_slice(bytes));
//! assert_eq!(stream, [1, 0, 0, 0, 0x17, 0x10, 0, 2, 0, 0, 0, 0xC8, 0]);
//! assert_eq!(Concise::parse(&stream)?.entries().next(), Some(heartbeat));
//! # Ok::<(), canopen::concise::ConciseError>(())
//! ```

use core::fmt;

use crate::Mux;

/// Bytes of the number of entries.
const COUNT: usize = 4;
/// Bytes of an entry before its data.
const HEAD: usize = 7;

/// One value and the object that it is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Entry<'a> {
    /// The object.
    pub mux: Mux,
    /// Its value as an SDO carries it.
    pub data: &'a [u8],
}

/// A concise DCF that is whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[doc(alias = "CDCF")]
pub struct Concise<'a> {
    count: u32,
    /// Behind the count.
    entries: &'a [u8],
}

/// What is wrong with a stream. Positions count entries from 1 and bytes from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ConciseError {
    /// Not even the number of entries is there.
    NoCount {
        /// Bytes of the stream.
        length: usize,
    },
    /// The stream ends inside an entry, or before it.
    Ends {
        /// Which entry.
        entry: u32,
        /// How many the stream says to have.
        of: u32,
        /// Where it begins.
        at: usize,
        /// Its object, if that much of it is there.
        mux: Option<Mux>,
        /// Bytes that it needs, as far as known.
        needed: u64,
        /// Bytes that are left.
        left: usize,
    },
    /// More follows behind the last entry.
    Goes {
        /// How many entries the stream says to have.
        entries: u32,
        /// Where the last one ends.
        at: usize,
        /// Bytes behind it.
        left: usize,
    },
}

/// The entries of a stream, in its order.
#[derive(Clone, Debug)]
pub struct Entries<'a> {
    rest: &'a [u8],
    left: u32,
}

impl<'a> Concise<'a> {
    /// Takes a stream that has all entries that it says to have, and nothing else.
    ///
    /// # Errors
    /// What is wrong with it, and where. Nothing of a broken stream is given out: half a configuration cannot be used.
    pub fn parse(stream: &'a [u8]) -> Result<Self, ConciseError> {
        let Some((count, entries)) = stream.split_first_chunk::<COUNT>() else {
            return Err(ConciseError::NoCount { length: stream.len() });
        };
        let of = u32::from_le_bytes(*count);
        let mut rest = entries;
        // A stream of n bytes ends this loop after n / 7 turns, whatever it says to have.
        for entry in 1..=of {
            let at = stream.len() - rest.len();
            let ends = |mux, needed| ConciseError::Ends { entry, of, at, mux, needed, left: rest.len() };
            let (mux, size, behind) = head(rest).ok_or_else(|| ends(None, HEAD as u64))?;
            let needed = u64::from(size) + HEAD as u64;
            // The size as the machine counts: 4 GiB are never there on one of 32 bits.
            let size = usize::try_from(size).unwrap_or(usize::MAX);
            rest = behind.get(size..).ok_or_else(|| ends(Some(mux), needed))?;
        }
        match rest.len() {
            0 => Ok(Self { count: of, entries }),
            left => Err(ConciseError::Goes { entries: of, at: stream.len() - left, left }),
        }
    }

    /// How many entries it has.
    pub const fn len(&self) -> u32 {
        self.count
    }

    /// True for a stream of none: what 1F22h has for a node without a configuration.
    pub const fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// The entries in order.
    pub const fn entries(&self) -> Entries<'a> {
        Entries { rest: self.entries, left: self.count }
    }
}

impl<'a> Iterator for Entries<'a> {
    type Item = Entry<'a>;

    fn next(&mut self) -> Option<Self::Item> {
        self.left = self.left.checked_sub(1)?;
        let (mux, size, behind) = head(self.rest)?;
        let (data, rest) = behind.split_at_checked(usize::try_from(size).ok()?)?;
        self.rest = rest;
        Some(Entry { mux, data })
    }
}

/// Object and size of the entry that `bytes` begin with, and what follows.
fn head(bytes: &[u8]) -> Option<(Mux, u32, &[u8])> {
    let ([low, high, sub_index, size @ ..], rest) = bytes.split_first_chunk::<HEAD>()?;
    Some((Mux::new(u16::from_le_bytes([*low, *high]), *sub_index), u32::from_le_bytes(*size), rest))
}

/// Writes a stream of these entries in this order, piece by piece, to whatever takes bytes.
///
/// # Panics
/// On a value of 4 GiB or more, or as many entries: the form has no number for them.
pub fn emit<'a, I>(entries: I, mut put: impl FnMut(&[u8]))
where
    I: IntoIterator<Item = Entry<'a>>,
    I::IntoIter: Clone,
{
    let number = |count: usize| u32::try_from(count).expect("the form counts with 32 bits").to_le_bytes();
    let entries = entries.into_iter();
    put(&number(entries.clone().count()));
    for Entry { mux, data } in entries {
        let ([low, high], [a, b, c, d]) = (mux.index.to_le_bytes(), number(data.len()));
        put(&[low, high, mux.sub_index, a, b, c, d]);
        put(data);
    }
}

impl fmt::Display for ConciseError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::NoCount { length } => write!(
                f,
                "{length} bytes are not a concise DCF: it begins with the number of its entries in {COUNT} bytes"
            ),
            Self::Ends { entry, of, at, mux, needed, left } => {
                write!(f, "entry {entry} of {of}, at byte {at}")?;
                if let Some(mux) = mux {
                    write!(f, ", for {mux}")?;
                }
                write!(f, ": it needs {needed} bytes, and {left} are left: it is truncated or not a concise DCF")
            }
            Self::Goes { entries, at, left } => write!(
                f,
                "{left} bytes follow behind the last of {entries} entries, at byte {at}: the number of entries is wrong, \
                 or two streams were joined"
            ),
        }
    }
}

impl core::error::Error for ConciseError {}

#[cfg(test)]
mod tests {
    extern crate std;

    use std::string::ToString;
    use std::vec::Vec;

    use super::*;

    const TYPE: Entry<'_> = Entry { mux: Mux::new(0x1800, 2), data: &[1] };
    const NAME: Entry<'_> = Entry { mux: Mux::new(0x2000, 0), data: b"boiler" };

    fn stream(entries: &[Entry<'_>]) -> Vec<u8> {
        let mut stream = Vec::new();
        emit(entries.iter().copied(), |bytes| stream.extend_from_slice(bytes));
        stream
    }

    fn refusal(stream: &[u8]) -> ConciseError {
        Concise::parse(stream).expect_err("a broken stream")
    }

    #[test]
    fn entries_stand_one_after_the_other_without_padding() {
        let bytes = stream(&[TYPE, NAME]);
        assert_eq!(bytes[..12], [2, 0, 0, 0, 0x00, 0x18, 2, 1, 0, 0, 0, 1]);
        assert_eq!(bytes[12..], *b"\x00\x20\x00\x06\x00\x00\x00boiler");
        let read = Concise::parse(&bytes).expect("whole");
        assert_eq!((read.len(), read.is_empty()), (2, false));
        assert_eq!(read.entries().collect::<Vec<_>>(), [TYPE, NAME]);
    }

    #[test]
    fn no_entries_are_a_stream_and_so_are_values_of_no_bytes() {
        assert!(Concise::parse(&stream(&[])).expect("whole").is_empty());
        let empty = Entry { data: &[], ..NAME };
        assert_eq!(Concise::parse(&stream(&[empty])).expect("whole").entries().next(), Some(empty));
    }

    #[test]
    fn a_stream_that_is_cut_off_anywhere_is_refused_at_the_entry_it_ends_in() {
        let bytes = stream(&[TYPE, NAME]);
        for length in 0..bytes.len() {
            match refusal(&bytes[..length]) {
                ConciseError::NoCount { length: reported } => assert!(reported == length && length < 4),
                ConciseError::Ends { entry, of: 2, at, left, .. } => {
                    assert_eq!((entry, at), if length < 12 { (1, 4) } else { (2, 12) });
                    assert_eq!(at + left, length);
                }
                other => panic!("{length} bytes: {other}"),
            }
        }
        let expected = "entry 2 of 2, at byte 12, for 2000h:00: it needs 13 bytes, and 12 are left: it is \
                        truncated or not a concise DCF";
        assert_eq!(refusal(&bytes[..24]).to_string(), expected);
    }

    #[test]
    fn counts_and_sizes_that_nothing_could_have_are_refused_at_once() {
        let many = [0xFF; 4];
        let reported = ConciseError::Ends { entry: 1, of: u32::MAX, at: 4, mux: None, needed: 7, left: 0 };
        assert_eq!(refusal(&many), reported);
        let long = [1, 0, 0, 0, 0, 0x20, 0, 0xFF, 0xFF, 0xFF, 0xFF];
        let mux = Some(NAME.mux);
        let needed = u64::from(u32::MAX) + 7;
        assert_eq!(refusal(&long), ConciseError::Ends { entry: 1, of: 1, at: 4, mux, needed, left: 7 });
    }

    #[test]
    fn what_follows_the_last_entry_is_not_passed_over() {
        let mut bytes = stream(&[TYPE]);
        bytes.extend([0, 0]);
        assert_eq!(refusal(&bytes), ConciseError::Goes { entries: 1, at: 12, left: 2 });
    }
}
