//! Wireshark's format (pcapng), read and written: blocks with their length, sections of either byte order, an interface for
//! each bus, with its name.
//!
//! Source: draft-ietf-opsawg-pcapng. Read are enhanced, simple and obsolete packet blocks; blocks of other types are left out,
//! as the draft wants. Written are enhanced packets with nanoseconds and the direction.

use std::io::{self, Read, Write};

use can::Instant;

use crate::bytes::ByteSource;
use crate::finding::{Finding, Place};
use crate::packet::{self, CAN_SOCKETCAN};
use crate::record::{Content, Direction, Entry, Interface, Record};

const SECTION: u32 = 0x0A0D_0D0A;
const INTERFACE: u32 = 1;
const OBSOLETE_PACKET: u32 = 2;
const SIMPLE_PACKET: u32 = 3;
const ENHANCED_PACKET: u32 = 6;
const BYTE_ORDER: u32 = 0x1A2B_3C4D;

const OPTION_NAME: u16 = 2;
const OPTION_RESOLUTION: u16 = 9;
const OPTION_OFFSET: u16 = 14;
const OPTION_FLAGS: u16 = 2;

/// Largest block that is taken into memory; those of CAN frames have some 60 bytes.
const MAX_BLOCK: u32 = 1 << 20;
/// More interfaces are not kept.
const MAX_INTERFACES: usize = 256;

#[derive(Debug)]
pub(super) struct PcapngReader<R> {
    source: ByteSource<R>,
    swapped: bool,
    interfaces: Vec<Link>,
    state: ReadState,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ReadState {
    /// Before the first section.
    Begin,
    Blocks,
    End,
}

/// What an interface block said.
#[derive(Clone, Copy, Debug)]
struct Link {
    kind: u32,
    interface: Interface,
    /// Ticks of a second.
    ticks: u64,
    /// Seconds to add.
    offset_s: i64,
}

/// What a block says, or why it cannot be read; `fatal` if nothing behind it can be found.
struct Bad {
    reason: String,
    fatal: bool,
}

impl From<&'static str> for Bad {
    fn from(reason: &'static str) -> Self {
        Self { reason: reason.to_owned(), fatal: false }
    }
}

impl<R: Read> PcapngReader<R> {
    pub(super) fn new(input: R) -> Self {
        Self { source: ByteSource::new(input), swapped: false, interfaces: Vec::new(), state: ReadState::Begin }
    }

    pub(super) fn next_entry(&mut self) -> io::Result<Option<Entry>> {
        while self.state != ReadState::End {
            let place = self.source.offset();
            match self.block()? {
                Ok(Some(record)) => return Ok(Some(Entry::Record(record))),
                Ok(None) => {}
                Err(Bad { reason, fatal }) => {
                    if fatal {
                        self.state = ReadState::End;
                    }
                    return Ok(Some(Entry::Finding(Finding {
                        place: Place::Byte(place),
                        text: String::new(),
                        reason,
                    })));
                }
            }
        }
        Ok(None)
    }

    fn block(&mut self) -> io::Result<Result<Option<Record>, Bad>> {
        let fatal = |reason: &str| Ok(Err(Bad { reason: reason.to_owned(), fatal: true }));
        let mut head = [0; 8];
        match self.source.read_up_to(&mut head)? {
            8 => {}
            0 if self.state == ReadState::Blocks => {
                self.state = ReadState::End;
                return Ok(Ok(None));
            }
            _ => return fatal("the log ends within the header of a block"),
        }
        // The same in both byte orders.
        let is_section = head[..4] == SECTION.to_be_bytes();
        let mut body = Vec::new();
        if is_section {
            // The byte order stands behind the length that it is the byte order of.
            if !self.source.read_exactly(4, &mut body)? {
                return fatal("the log ends within the header of a section");
            }
            self.swapped = match self.number_in(&body, 0, false) {
                BYTE_ORDER => false,
                other if other.swap_bytes() == BYTE_ORDER => true,
                _ => return fatal("a section has no byte order of pcapng, 1A2B3C4Dh"),
            };
        } else if self.state == ReadState::Begin {
            return fatal("this is not a pcapng file: it does not begin with a section header, 0A0D0D0Ah");
        }
        let kind = if is_section { SECTION } else { self.number(&head, 0) };
        let length = self.number(&head, 4);
        if length < 12 || !length.is_multiple_of(4) || (is_section && length < 28) {
            return fatal(&format!(
                "a block declares {length} bytes, which no block has; nothing behind it can be found"
            ));
        }
        let left = length as usize - head.len() - body.len();
        if length > MAX_BLOCK {
            self.source.skip(left as u64)?;
            let reason = format!("a block declares {length} bytes; more than {MAX_BLOCK} are not read");
            return Ok(Err(Bad { reason, fatal: false }));
        }
        if !self.source.read_exactly(left, &mut body)? {
            return fatal("the log ends within a block");
        }
        // Its length again, to read files backwards.
        body.truncate(body.len() - 4);
        Ok(match kind {
            SECTION => {
                self.interfaces.clear();
                self.state = ReadState::Blocks;
                Ok(None)
            }
            INTERFACE => self.interface(&body).map(|()| None),
            ENHANCED_PACKET => self.enhanced(&body),
            OBSOLETE_PACKET => self.obsolete(&body),
            SIMPLE_PACKET => self.simple(&body),
            _ => Ok(None),
        })
    }

    fn interface(&mut self, body: &[u8]) -> Result<(), Bad> {
        if body.len() < 8 {
            return Err("an interface block is too short".into());
        }
        if self.interfaces.len() >= MAX_INTERFACES {
            return Err("there are more interfaces than are read, 256".into());
        }
        let kind = u32::from(self.short(body, 0));
        let mut link = Link {
            kind,
            interface: Interface::numbered(self.interfaces.len() as u16 + 1),
            ticks: 1_000_000,
            offset_s: 0,
        };
        let mut bad = None;
        self.options(&body[8..], |code, value| match (code, value) {
            (OPTION_NAME, name) => {
                link.interface = Interface::named(String::from_utf8_lossy(name).trim_end_matches('\0'));
            }
            (OPTION_RESOLUTION, [exponent, ..]) => match ticks(*exponent) {
                Some(ticks) => link.ticks = ticks,
                None => bad = Some("the resolution of an interface's time is finer than 1e-18 s"),
            },
            (OPTION_OFFSET, value) if value.len() == 8 => {
                let (low, high) = (self.number(value, 0), self.number(value, 4));
                let (low, high) = if self.swapped { (high, low) } else { (low, high) };
                link.offset_s = (u64::from(high) << 32 | u64::from(low)) as i64;
            }
            _ => {}
        });
        self.interfaces.push(link);
        match (bad, packet::refused_link(kind)) {
            (Some(reason), _) => Err(reason.into()),
            (None, Some(reason)) => Err(Bad { reason, fatal: false }),
            (None, None) => Ok(()),
        }
    }

    fn enhanced(&self, body: &[u8]) -> Result<Option<Record>, Bad> {
        const SHORT: &str = "a packet block is too short";
        if body.len() < 20 {
            return Err(SHORT.into());
        }
        let captured = self.number(body, 12) as usize;
        let packet = body[20..].get(..captured).ok_or(SHORT)?;
        let ticks = u64::from(self.number(body, 4)) << 32 | u64::from(self.number(body, 8));
        let mut flags = 0;
        let padded = captured.next_multiple_of(4);
        self.options(body[20..].get(padded..).unwrap_or_default(), |code, value| {
            if code == OPTION_FLAGS && value.len() == 4 {
                flags = self.number(value, 0);
            }
        });
        self.packet(self.number(body, 0) as usize, Some(ticks), packet, flags)
    }

    fn obsolete(&self, body: &[u8]) -> Result<Option<Record>, Bad> {
        const SHORT: &str = "a packet block is too short";
        if body.len() < 20 {
            return Err(SHORT.into());
        }
        let packet = body[20..].get(..self.number(body, 12) as usize).ok_or(SHORT)?;
        let ticks = u64::from(self.number(body, 4)) << 32 | u64::from(self.number(body, 8));
        self.packet(usize::from(self.short(body, 0)), Some(ticks), packet, 0)
    }

    /// A simple packet has no time, and is of the first interface.
    fn simple(&self, body: &[u8]) -> Result<Option<Record>, Bad> {
        let packet = body.get(4..).ok_or("a packet block is too short")?;
        let length = (self.number(body, 0) as usize).min(packet.len());
        self.packet(0, None, &packet[..length], 0)
    }

    fn packet(&self, of: usize, ticks: Option<u64>, packet: &[u8], flags: u32) -> Result<Option<Record>, Bad> {
        let link = self.interfaces.get(of).ok_or("a packet is of an interface that no block describes")?;
        if packet::refused_link(link.kind).is_some() {
            // Reported once, at the interface.
            return Ok(None);
        }
        let Some((direction, content)) = packet::parse(link.kind, packet)? else { return Ok(None) };
        let direction = match flags & 3 {
            1 => Some(Direction::Received),
            2 => Some(Direction::Transmitted),
            _ => direction,
        };
        let at = match ticks {
            Some(ticks) => Some(link.time(ticks).ok_or("the time of a packet is beyond all years")?),
            None => None,
        };
        Ok(Some(Record { at, interface: link.interface, direction, content }))
    }

    /// Code, length, value padded to four bytes, until code 0 or the end.
    fn options(&self, mut rest: &[u8], mut take: impl FnMut(u16, &[u8])) {
        while rest.len() >= 4 {
            let (code, length) = (self.short(rest, 0), usize::from(self.short(rest, 2)));
            let Some(value) = rest[4..].get(..length) else { return };
            if code == 0 {
                return;
            }
            take(code, value);
            rest = rest.get(4 + length.next_multiple_of(4)..).unwrap_or_default();
        }
    }

    fn number(&self, bytes: &[u8], place: usize) -> u32 {
        self.number_in(bytes, place, self.swapped)
    }

    fn number_in(&self, bytes: &[u8], place: usize, swapped: bool) -> u32 {
        let bytes = [bytes[place], bytes[place + 1], bytes[place + 2], bytes[place + 3]];
        if swapped { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) }
    }

    fn short(&self, bytes: &[u8], place: usize) -> u16 {
        let bytes = [bytes[place], bytes[place + 1]];
        if self.swapped { u16::from_be_bytes(bytes) } else { u16::from_le_bytes(bytes) }
    }
}

impl Link {
    fn time(&self, ticks: u64) -> Option<Instant> {
        let nanos = u128::from(ticks) * 1_000_000_000 / u128::from(self.ticks);
        let nanos = i128::try_from(nanos).ok()? + i128::from(self.offset_s) * 1_000_000_000;
        u64::try_from(nanos).ok().map(Instant::from_nanos)
    }
}

/// The upper bit says whether the exponent is one of 2 or of 10.
fn ticks(exponent: u8) -> Option<u64> {
    match exponent & 0x80 {
        0 => 10u64.checked_pow(u32::from(exponent)),
        _ => 1u64.checked_shl(u32::from(exponent & 0x7F)),
    }
}

/// Writes blocks; each bus gets an interface block before its first packet.
#[derive(Debug, Default)]
pub(super) struct PcapngWriter {
    interfaces: Vec<Interface>,
    begun: bool,
    last: Instant,
    block: Vec<u8>,
    packet: Vec<u8>,
}

impl PcapngWriter {
    /// Takes a record; FD frames are left out, because their data was not kept.
    pub(super) fn write(&mut self, output: &mut impl Write, record: &Record) -> io::Result<()> {
        if matches!(record.content, Content::FdFrame { .. }) {
            return Ok(());
        }
        self.begin(output)?;
        let of = self.interface(output, record.interface)?;
        self.last = record.at.unwrap_or(self.last);
        self.packet.clear();
        packet::emit(&record.content, &mut self.packet);
        let nanos = self.last.as_nanos();
        let length = self.packet.len() as u32;
        self.block.clear();
        for number in [of, (nanos >> 32) as u32, nanos as u32, length, length] {
            self.block.extend(number.to_le_bytes());
        }
        self.block.extend(&self.packet);
        self.block.resize(self.block.len().next_multiple_of(4), 0);
        let flags: u32 = match record.direction {
            Some(Direction::Received) => 1,
            Some(Direction::Transmitted) => 2,
            None => 0,
        };
        if flags != 0 {
            push_option(&mut self.block, OPTION_FLAGS, &flags.to_le_bytes());
            self.block.extend([0; 4]);
        }
        write_block(output, ENHANCED_PACKET, &self.block)
    }

    /// The section's head, if it has not been written.
    pub(super) fn begin(&mut self, output: &mut impl Write) -> io::Result<()> {
        if std::mem::replace(&mut self.begun, true) {
            return Ok(());
        }
        let mut head = BYTE_ORDER.to_le_bytes().to_vec();
        // Version 1.0, a section of untold length.
        head.extend([1, 0, 0, 0]);
        head.extend([0xFF; 8]);
        write_block(output, SECTION, &head)
    }

    fn interface(&mut self, output: &mut impl Write, interface: Interface) -> io::Result<u32> {
        if let Some(place) = self.interfaces.iter().position(|known| *known == interface) {
            return Ok(place as u32);
        }
        // What has more buses than a file of this program may have goes on under the last.
        if self.interfaces.len() >= MAX_INTERFACES {
            return Ok(self.interfaces.len() as u32 - 1);
        }
        let mut body = CAN_SOCKETCAN.to_le_bytes().to_vec();
        body.extend([0; 4]);
        push_option(&mut body, OPTION_NAME, interface.name().as_bytes());
        push_option(&mut body, OPTION_RESOLUTION, &[9]);
        body.extend([0; 4]);
        write_block(output, INTERFACE, &body)?;
        self.interfaces.push(interface);
        Ok(self.interfaces.len() as u32 - 1)
    }
}

fn push_option(out: &mut Vec<u8>, code: u16, value: &[u8]) {
    out.extend(code.to_le_bytes());
    out.extend((value.len() as u16).to_le_bytes());
    out.extend(value);
    out.extend(std::iter::repeat_n(0, value.len().next_multiple_of(4) - value.len()));
}

fn write_block(output: &mut impl Write, kind: u32, body: &[u8]) -> io::Result<()> {
    let length = (body.len() as u32 + 12).to_le_bytes();
    output.write_all(&kind.to_le_bytes())?;
    output.write_all(&length)?;
    output.write_all(body)?;
    output.write_all(&length)
}
