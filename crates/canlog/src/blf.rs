//! Vector's binary logging format (BLF), read.
//!
//! A head has the begin of the measurement; then objects follow, most of them inside containers that are compressed with
//! zlib. An object may go on in the next container, so that what comes out of all containers is one stream. Source: Vector's
//! published header of the binlog library, and files of its tools; there is no public standard. The begin has no time zone and
//! is taken for UTC. What is damaged is passed over up to the next signature.

use std::collections::BTreeSet;
use std::io::{self, Read};

use can::{CanId, Frame, Instant, MAX_DATA_LENGTH};
use flate2::read::ZlibDecoder;

use crate::bytes::{ByteSource, u16_at, u32_at, u64_at};
use crate::calendar::of_system_time;
use crate::finding::{Finding, Place};
use crate::record::{Content, Direction, Entry, Interface, RawErrorFrame, Record};

pub(super) const FILE_SIGNATURE: [u8; 4] = *b"LOGG";
pub(super) const OBJECT_SIGNATURE: [u8; 4] = *b"LOBJ";
/// Length of the header of a file: a field of the file, the same in all.
pub(super) const FILE_HEAD: usize = 144;
/// Where the begin of the measurement stands in it.
pub(super) const BEGIN_OF_MEASUREMENT: usize = 40;
/// Signature, head length, head version, length, type.
pub(super) const BASE_HEAD: usize = 16;
/// The same with flags and time (head versions 1 and 2 agree up to there).
pub(super) const TIMED_HEAD: usize = 32;
/// Compression and length in front of a container's contents.
pub(super) const CONTAINER_HEAD: usize = 16;
pub(super) const ZLIB: u16 = 2;
/// Flag of a time in nanoseconds; without it the unit is 10 µs.
pub(super) const NANOSECONDS: u32 = 2;

/// Types of objects.
pub(super) mod kind {
    pub(crate) const MESSAGE: u32 = 1;
    pub(crate) const ERROR: u32 = 2;
    pub(crate) const CONTAINER: u32 = 10;
    pub(crate) const ERROR_EXT: u32 = 73;
    pub(crate) const MESSAGE2: u32 = 86;
    pub(crate) const FD_MESSAGE: u32 = 100;
    pub(crate) const FD_MESSAGE_64: u32 = 101;
    pub(crate) const FD_ERROR_64: u32 = 104;
}

/// Objects that say nothing about frames and are in every log: overload, statistics, triggers, environment variables, texts,
/// marks, comments, state of the controller and of the logger. Others are a finding, once for each type.
const KNOWN_OTHERS: [u32; 17] = [3, 4, 5, 6, 7, 8, 9, 31, 65, 72, 90, 91, 92, 96, 105, 115, 131];

pub(super) const FLAG_TRANSMITTED: u8 = 0x01;
pub(super) const FLAG_REMOTE: u8 = 0x80;
pub(super) const ID_EXTENDED: u32 = 0x8000_0000;

/// Largest object that is taken into memory, and most that a container may hold: Vector's own have 128 KiB.
const MAX_SIZE: u32 = 16 << 20;

/// Largest object in a container. None about frames comes near; a damaged length must not swallow the rest of the log.
const MAX_INNER_SIZE: u32 = 1 << 20;

/// Types that are reported; a damaged file could have four billion.
const MAX_TOLD: usize = 64;

#[derive(Debug)]
pub(super) struct BlfReader<R> {
    source: ByteSource<R>,
    begin: Instant,
    stage: Stage,
    /// What came out of containers and is not used up.
    plain: Vec<u8>,
    used: usize,
    /// Bytes that came out of containers before those in `plain`.
    before: u64,
    reported: BTreeSet<u32>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    Head,
    Objects,
    End,
}

impl<R: Read> BlfReader<R> {
    pub(super) fn new(input: R) -> Self {
        let source = ByteSource::new(input);
        let (plain, reported) = (Vec::new(), BTreeSet::new());
        Self { source, begin: Instant::ZERO, stage: Stage::Head, plain, used: 0, before: 0, reported }
    }

    pub(super) fn next_entry(&mut self) -> io::Result<Option<Entry>> {
        loop {
            if let Some(entry) = self.object() {
                return Ok(Some(entry));
            }
            let finding = match self.stage {
                Stage::Head => self.head()?,
                Stage::Objects => self.fill()?,
                Stage::End => return Ok(None),
            };
            if let Some(finding) = finding {
                return Ok(Some(Entry::Finding(finding)));
            }
        }
    }

    fn head(&mut self) -> io::Result<Option<Finding>> {
        let mut head = [0; FILE_HEAD];
        let read = self.source.read_up_to(&mut head)?;
        self.stage = Stage::Objects;
        if read < FILE_HEAD || head[..4] != FILE_SIGNATURE {
            self.stage = Stage::End;
            return Ok(Some(found(0, "this is not a BLF file: it does not begin with LOGG and a header of 144 bytes")));
        }
        let fields = std::array::from_fn(|i| u16_at(&head, BEGIN_OF_MEASUREMENT + 2 * i));
        // A missing date is not an error: the times then count from the begin.
        self.begin = of_system_time(fields).unwrap_or(Instant::ZERO);
        let longer = u64::from(u32_at(&head, 4)).saturating_sub(FILE_HEAD as u64);
        self.source.skip(longer.min(u64::from(MAX_SIZE)))?;
        Ok(None)
    }

    /// Takes the next object of the file into `plain`, or out of it what is in a container.
    fn fill(&mut self) -> io::Result<Option<Finding>> {
        let place = self.source.offset();
        let mut head = [0; BASE_HEAD];
        let read = self.source.read_up_to(&mut head)?;
        if read == 0 || (read < BASE_HEAD && head[..read].iter().all(|byte| *byte == 0)) {
            self.stage = Stage::End;
            let torn = self.plain.len() > self.used;
            return Ok(torn.then(|| self.found_inside("the log ends within an object")));
        }
        if read < BASE_HEAD {
            self.stage = Stage::End;
            return Ok(Some(found(place, "the log ends within the header of an object")));
        }
        let size = u32_at(&head, 8);
        if head[..4] != OBJECT_SIGNATURE || (size as usize) < BASE_HEAD {
            self.source.find(&OBJECT_SIGNATURE, &head[1..])?;
            return Ok(Some(found(place, "no object begins here; reading goes on at the next one")));
        }
        if size > MAX_SIZE {
            self.source.skip(u64::from(size) - BASE_HEAD as u64)?;
            return Ok(Some(found(
                place,
                format!("an object declares {size} bytes; more than {MAX_SIZE} are not read"),
            )));
        }
        let mut body = Vec::new();
        let complete = self.source.read_exactly(size as usize - BASE_HEAD, &mut body)?;
        // Objects are padded so in files, whatever "aligned" would be.
        self.source.skip(u64::from(size % 4))?;
        self.forget_used();
        let cut = (!complete).then(|| found(place, "the log ends within an object"));
        if u32_at(&head, 12) == kind::CONTAINER {
            return Ok(self.unpack(place, &body).or(cut));
        }
        if complete {
            self.plain.extend_from_slice(&head);
            self.plain.extend_from_slice(&body);
        }
        Ok(cut)
    }

    /// Appends what a container holds; of a damaged one what comes out before the damage.
    fn unpack(&mut self, place: u64, body: &[u8]) -> Option<Finding> {
        let Some((head, packed)) = body.split_at_checked(CONTAINER_HEAD) else {
            return Some(found(place, "a container is shorter than its head"));
        };
        let declared = u32_at(head, 8);
        if declared > MAX_SIZE {
            return Some(found(
                place,
                format!("a container declares {declared} bytes; more than {MAX_SIZE} are not read"),
            ));
        }
        match u16_at(head, 0) {
            0 => {
                self.plain.extend_from_slice(packed);
                None
            }
            ZLIB => {
                let unpacked = ZlibDecoder::new(packed).take(u64::from(declared)).read_to_end(&mut self.plain);
                unpacked.err().map(|error| found(place, format!("a container cannot be unpacked to its end: {error}")))
            }
            other => Some(found(
                place,
                format!("a container is compressed by method {other}; 0 (none) and 2 (zlib) are known"),
            )),
        }
    }

    fn forget_used(&mut self) {
        self.plain.drain(..self.used);
        self.before += self.used as u64;
        self.used = 0;
    }

    /// The next object in `plain`, if it is whole.
    fn object(&mut self) -> Option<Entry> {
        loop {
            let rest = &self.plain[self.used..];
            let Some(gap) = rest.windows(4).position(|bytes| bytes == OBJECT_SIGNATURE) else {
                return self.no_object_in_sight();
            };
            // Up to a few bytes of padding stand between objects.
            if gap > 8 {
                let finding = self.found_inside("no object begins here; reading goes on at the next one");
                self.used += gap;
                return Some(Entry::Finding(finding));
            }
            let rest = &rest[gap..];
            if rest.len() < BASE_HEAD {
                return None;
            }
            let size = u32_at(rest, 8);
            if (size as usize) < BASE_HEAD || size > MAX_INNER_SIZE {
                let finding = self.found_inside(format!("an object declares {size} bytes"));
                self.used += gap + OBJECT_SIGNATURE.len();
                return Some(Entry::Finding(finding));
            }
            let object = rest.get(..size as usize)?;
            let read = read_object(object, self.begin);
            let kind = u32_at(object, 12);
            let result = match read {
                Ok(Some(record)) => Some(Entry::Record(record)),
                Ok(None)
                    if KNOWN_OTHERS.contains(&kind)
                        || self.reported.len() >= MAX_TOLD
                        || !self.reported.insert(kind) =>
                {
                    None
                }
                Ok(None) => Some(Entry::Finding(self.found_inside(format!("objects of type {kind} are not read")))),
                Err(reason) => Some(Entry::Finding(self.found_inside(reason))),
            };
            self.used += gap + size as usize;
            if result.is_some() {
                return result;
            }
        }
    }

    /// Without a signature what is left is the begin of an object, or garbage.
    fn no_object_in_sight(&mut self) -> Option<Entry> {
        let rest = self.plain.len() - self.used;
        if rest <= 8 {
            return None;
        }
        let finding = self.found_inside("no object begins here; reading goes on at the next one");
        self.used += rest - (OBJECT_SIGNATURE.len() - 1);
        Some(Entry::Finding(finding))
    }

    fn found_inside(&self, reason: impl Into<String>) -> Finding {
        found(self.before + self.used as u64, format!("in containers: {}", reason.into()))
    }
}

fn found(byte: u64, reason: impl Into<String>) -> Finding {
    Finding { place: Place::Byte(byte), text: String::new(), reason: reason.into() }
}

/// Reads an object; `None` for one that is not a frame.
fn read_object(object: &[u8], begin: Instant) -> Result<Option<Record>, &'static str> {
    const SHORT: &str = "an object is too short for its type";
    let kind = u32_at(object, 12);
    let body = object.get(usize::from(u16_at(object, 4)).max(TIMED_HEAD)..).unwrap_or_default();
    let long = |bytes: usize| body.get(..bytes).ok_or(SHORT);
    let (channel, transmitted, content) = match kind {
        kind::MESSAGE | kind::MESSAGE2 => {
            let body = long(16)?;
            let frame = frame(u32_at(body, 4), body[3], body[2] & FLAG_REMOTE != 0, &body[8..16]);
            (u16_at(body, 0), Some(body[2] & FLAG_TRANSMITTED != 0), Content::Frame(frame))
        }
        kind::ERROR => (u16_at(long(4)?, 0), None, Content::Error(RawErrorFrame::UNSPECIFIED)),
        kind::ERROR_EXT => {
            let body = long(32)?;
            (u16_at(body, 0), None, Content::Error(error_frame(body)))
        }
        kind::FD_ERROR_64 => (u16::from(long(1)?[0]), None, Content::Error(RawErrorFrame::UNSPECIFIED)),
        kind::FD_MESSAGE => {
            let body = long(20)?;
            let (id, remote, length) = (u32_at(body, 4), body[2] & FLAG_REMOTE != 0, body[14]);
            let content = fd_or_classical(body[13] & 1 != 0, id, body[3], remote, length, object, body.len());
            (u16_at(body, 0), Some(body[2] & FLAG_TRANSMITTED != 0), content)
        }
        kind::FD_MESSAGE_64 => {
            let body = long(40)?;
            let flags = u32_at(body, 12);
            let (id, remote) = (u32_at(body, 4), flags & 0x10 != 0);
            let content = fd_or_classical(flags & 0x1000 != 0, id, body[1], remote, body[2], object, body.len());
            (u16::from(body[0]), Some(body[34] != 0), content)
        }
        _ => return Ok(None),
    };
    let unit = if u32_at(object, 16) == NANOSECONDS { 1 } else { 10_000 };
    let nanos = u64_at(object, 24).checked_mul(unit).and_then(|nanos| begin.as_nanos().checked_add(nanos));
    let at = nanos.map(Instant::from_nanos).ok_or("the time of an object is beyond all years")?;
    let direction = transmitted.map(|sent| if sent { Direction::Transmitted } else { Direction::Received });
    Ok(Some(Record { at: Some(at), interface: Interface::numbered(channel), direction, content }))
}

/// The content of an object that may hold either; its data stands behind `before` bytes of the object's own.
fn fd_or_classical(fd: bool, id: u32, dlc: u8, remote: bool, length: u8, object: &[u8], before: usize) -> Content {
    if fd {
        return Content::FdFrame { id: can_id(id), length: length.min(64) };
    }
    let data_begin = usize::from(u16_at(object, 4)).max(TIMED_HEAD) + before;
    Content::Frame(frame(id, dlc, remote, object.get(data_begin..).unwrap_or_default()))
}

fn frame(id: u32, dlc: u8, remote: bool, data: &[u8]) -> Frame {
    // A DLC above 8 means 8 bytes (ISO 11898-1, 8.4.2.4).
    let length = usize::from(dlc).min(MAX_DATA_LENGTH);
    let id = can_id(id);
    if remote { Frame::remote(id, length as u8) } else { Frame::new(id, &data[..length.min(data.len())]) }
}

fn can_id(raw: u32) -> CanId {
    if raw & ID_EXTENDED != 0 { CanId::extended(raw) } else { CanId::standard(raw as u16) }
}

/// Flags, error code capture, position and frame length are those of Vector's hardware; where they are all 0, the identifier has the
/// classes as Linux has them (so python-can, and this program, write it).
fn error_frame(body: &[u8]) -> RawErrorFrame {
    let (class, ecc) = (u32_at(body, 16) & CanId::MAX_EXTENDED, body[8]);
    let of_hardware = u32_at(body, 4) != 0 || ecc != 0 || body[9] != 0 || u32_at(body, 12) != 0;
    if !of_hardware && class != 0 {
        let mut data = [0; 8];
        data.copy_from_slice(&body[24..32]);
        return RawErrorFrame { class, data };
    }
    if ecc == 0 {
        return RawErrorFrame::UNSPECIFIED;
    }
    // The error code capture of the SJA1000, in the bits that Linux gives it: kind, direction, place in the frame.
    let kind = [0x01, 0x02, 0x04, 0x00][usize::from(ecc >> 6)];
    let sending = if ecc & 0x20 == 0 { 0x80 } else { 0 };
    RawErrorFrame { class: 0x88, data: [0, 0, kind | sending, ecc & 0x1F, 0, 0, 0, 0] }
}
