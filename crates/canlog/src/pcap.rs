//! libpcap's first format (pcap), read: a head, then packets, in either byte order, with microseconds or nanoseconds.
//!
//! Source: draft-ietf-opsawg-pcap. A packet has only its own length, so that nothing behind a damaged one can be found.

use std::io::{self, Read};

use can::Instant;

use crate::bytes::ByteSource;
use crate::finding::{Finding, Place};
use crate::packet::{self, MAX_PACKET};
use crate::record::{Entry, Interface, Record};

/// The magic numbers, read in the byte order of the file.
const MICROSECONDS: u32 = 0xA1B2_C3D4;
const NANOSECONDS: u32 = 0xA1B2_3C4D;

/// Longest packet that a file may have: libpcap's own limit.
const MAX_DECLARED: u32 = 256 << 10;

#[derive(Debug)]
pub(super) struct PcapReader<R> {
    source: ByteSource<R>,
    state: ReadState,
}

#[derive(Clone, Copy, Debug)]
enum ReadState {
    Head,
    Packets { swapped: bool, nanos: bool, link: u32 },
    End,
}

impl<R: Read> PcapReader<R> {
    pub(super) fn new(input: R) -> Self {
        Self { source: ByteSource::new(input), state: ReadState::Head }
    }

    pub(super) fn next_entry(&mut self) -> io::Result<Option<Entry>> {
        loop {
            let result = match self.state {
                ReadState::End => return Ok(None),
                ReadState::Head => self.head()?.map(|()| None),
                ReadState::Packets { swapped, nanos, link } => self.packet(swapped, nanos, link)?,
            };
            match result {
                Ok(Some(entry)) => return Ok(Some(entry)),
                Ok(None) => {}
                Err(finding) => {
                    self.state = ReadState::End;
                    return Ok(Some(Entry::Finding(finding)));
                }
            }
        }
    }

    fn head(&mut self) -> io::Result<Result<(), Finding>> {
        let mut head = [0; 24];
        let read = self.source.read_up_to(&mut head)?;
        let number = |swapped: bool, place: usize| {
            let bytes = [head[place], head[place + 1], head[place + 2], head[place + 3]];
            if swapped { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) }
        };
        for swapped in [false, true] {
            let nanos = match number(swapped, 0) {
                _ if read < head.len() => break,
                MICROSECONDS => false,
                NANOSECONDS => true,
                _ => continue,
            };
            // The upper bits are about frame check sequences, which CAN does not have.
            let link = number(swapped, 20) & 0x0FFF_FFFF;
            self.state = ReadState::Packets { swapped, nanos, link };
            return Ok(packet::refused_link(link).map_or(Ok(()), |reason| Err(found(20, reason))));
        }
        Ok(Err(found(
            0,
            "this is not a pcap file: it does not begin with A1B2C3D4h or A1B23C4Dh and a head of 24 bytes",
        )))
    }

    /// `Err` ends the reading.
    fn packet(&mut self, swapped: bool, nanos: bool, link: u32) -> io::Result<Result<Option<Entry>, Finding>> {
        let place = self.source.offset();
        let mut head = [0; 16];
        match self.source.read_up_to(&mut head)? {
            0 => {
                self.state = ReadState::End;
                return Ok(Ok(None));
            }
            16 => {}
            _ => return Ok(Err(found(place, "the log ends within the header of a packet"))),
        }
        let number = |place: usize| {
            let bytes = [head[place], head[place + 1], head[place + 2], head[place + 3]];
            if swapped { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) }
        };
        let length = number(8);
        if length > MAX_DECLARED {
            let reason =
                format!("a packet declares {length} bytes, more than {MAX_DECLARED}; nothing behind it can be found");
            return Ok(Err(found(place, reason)));
        }
        let mut data = Vec::with_capacity(MAX_PACKET);
        let kept = (length as usize).min(MAX_PACKET);
        if !self.source.read_exactly(kept, &mut data)? {
            return Ok(Err(found(place, "the log ends within a packet")));
        }
        self.source.skip(u64::from(length) - kept as u64)?;
        let unit = if nanos { 1 } else { 1_000 };
        let at = u64::from(number(0)) * 1_000_000_000 + u64::from(number(4)) * unit;
        Ok(Ok(match packet::parse(link, &data) {
            Ok(Some((direction, content))) => {
                let (at, interface) = (Some(Instant::from_nanos(at)), Interface::default());
                Some(Entry::Record(Record { at, interface, direction, content }))
            }
            Ok(None) => None,
            Err(reason) => Some(Entry::Finding(found(place, reason))),
        }))
    }
}

fn found(byte: u64, reason: impl Into<String>) -> Finding {
    Finding { place: Place::Byte(byte), text: String::new(), reason: reason.into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(swapped: bool, magic: u32, packets: &[(u32, u32, &[u8])]) -> Vec<u8> {
        let number = |value: u32| if swapped { value.to_be_bytes() } else { value.to_le_bytes() };
        let mut out = number(magic).to_vec();
        for word in [4 << 16 | 2, 0, 0, 262_144, 227] {
            out.extend(number(word));
        }
        for (seconds, fraction, data) in packets {
            for word in [*seconds, *fraction, data.len() as u32, data.len() as u32] {
                out.extend(number(word));
            }
            out.extend_from_slice(data);
        }
        out
    }

    fn entries(bytes: &[u8]) -> Vec<Entry> {
        let mut reader = PcapReader::new(bytes);
        std::iter::from_fn(|| reader.next_entry().unwrap()).collect()
    }

    const SYNC: &[u8] = &[0, 0, 0, 0x80, 0, 0, 0, 0];

    #[test]
    fn both_byte_orders_and_both_units_are_read() {
        for (swapped, magic, fraction) in
            [(false, MICROSECONDS, 123_456), (true, MICROSECONDS, 123_456), (false, NANOSECONDS, 123_456_000)]
        {
            let read = entries(&file(swapped, magic, &[(1_700_000_000, fraction, SYNC)]));
            let at = Instant::from_nanos(1_700_000_000_123_456_000);
            assert_eq!(read, [Entry::Record(Record::of_frame(at, "080#".parse().unwrap()))]);
        }
    }

    #[test]
    fn a_torn_packet_is_passed_over_and_a_torn_file_ends() {
        let whole = file(false, MICROSECONDS, &[(1, 0, &[1, 2]), (2, 0, SYNC)]);
        let read = entries(&whole);
        assert!(
            matches!(&read[..], [Entry::Finding(found), Entry::Record(_)] if found.place == Place::Byte(24)),
            "{read:?}"
        );
        for (bytes, reason) in [
            (&whole[..whole.len() - 1], "ends within a packet"),
            (&whole[..30], "ends within the header of a packet"),
            (&whole[..20], "not a pcap file"),
            (&file(false, MICROSECONDS, &[(1, 0, SYNC)])[..24], ""),
        ] {
            let last = entries(bytes).pop();
            assert_eq!(last.is_none(), reason.is_empty());
            assert!(last.is_none_or(|last| matches!(last, Entry::Finding(found) if found.reason.contains(reason))));
        }
        let mut huge = file(false, MICROSECONDS, &[(1, 0, SYNC)]);
        huge[32..36].copy_from_slice(&1_000_000_000u32.to_le_bytes());
        assert!(
            matches!(&entries(&huge)[..], [Entry::Finding(found)] if found.reason.contains("declares 1000000000 bytes"))
        );
    }
}
