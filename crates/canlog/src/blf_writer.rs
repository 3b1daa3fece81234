//! Vector's binary logging format (BLF), written: see [`crate::blf`] for what stands where.
//!
//! What was handed on is whole containers, and the head counts them, so that a file whose writer was killed can be read.

use std::io::{self, Seek, SeekFrom, Write};

use can::{CanId, Instant};
use flate2::Compression;
use flate2::write::ZlibEncoder;

use crate::blf::{
    BASE_HEAD, BEGIN_OF_MEASUREMENT, CONTAINER_HEAD, FILE_HEAD, FILE_SIGNATURE, FLAG_REMOTE, FLAG_TRANSMITTED,
    ID_EXTENDED, NANOSECONDS, OBJECT_SIGNATURE, TIMED_HEAD, ZLIB, kind,
};
use crate::calendar::to_system_time;
use crate::record::{Content, Direction, Record};

/// A container is written when it holds so much; Vector's own hold 128 KiB.
const CONTAINER_SIZE: usize = 128 << 10;

/// Version of the format that the head names: that of files which Vector's and other tools read.
const FORMAT_VERSION: [u8; 4] = [2, 6, 8, 1];

#[derive(Debug, Default)]
pub(super) struct BlfWriter {
    begin: Option<Instant>,
    last: Instant,
    /// Objects of the container to come.
    objects: Vec<u8>,
    count: u32,
    uncompressed: u64,
    size: u64,
}

impl BlfWriter {
    /// Takes a record; FD frames are left out, because their data was not kept.
    pub(super) fn write(&mut self, output: &mut (impl Write + Seek), record: &Record) -> io::Result<()> {
        let channel = record.interface.number().to_le_bytes();
        let (kind, body) = match &record.content {
            Content::Frame(frame) => {
                let sent = if record.direction == Some(Direction::Transmitted) { FLAG_TRANSMITTED } else { 0 };
                let remote = if frame.is_remote() { FLAG_REMOTE } else { 0 };
                let mut body = Vec::with_capacity(16);
                body.extend([channel[0], channel[1], sent | remote, frame.dlc()]);
                body.extend(id(frame.id()).to_le_bytes());
                body.extend(frame.padded());
                (kind::MESSAGE, body)
            }
            Content::Error(error) => {
                let mut body = vec![0; 32];
                body[..2].copy_from_slice(&channel);
                body[10] = error.data.len() as u8;
                body[16..20].copy_from_slice(&error.class.to_le_bytes());
                body[24..32].copy_from_slice(&error.data);
                (kind::ERROR_EXT, body)
            }
            Content::FdFrame { .. } => return Ok(()),
        };
        let begin = self.begin(output, record.at)?;
        self.last = record.at.unwrap_or(self.last).max(begin);
        let size = (TIMED_HEAD + body.len()) as u32;
        self.objects.extend(base_head(TIMED_HEAD as u16, size, kind));
        self.objects.extend(NANOSECONDS.to_le_bytes());
        self.objects.extend([0; 4]);
        self.objects.extend((self.last.as_nanos() - begin.as_nanos()).to_le_bytes());
        self.objects.extend(body);
        self.count += 1;
        if self.objects.len() >= CONTAINER_SIZE { self.container(output) } else { Ok(()) }
    }

    /// Writes what there is as a container, and the head that counts it.
    pub(super) fn flush(&mut self, output: &mut (impl Write + Seek)) -> io::Result<()> {
        if self.objects.is_empty() {
            return Ok(());
        }
        self.container(output)?;
        output.seek(SeekFrom::Start(0))?;
        output.write_all(&self.head())?;
        output.seek(SeekFrom::Start(self.size))?;
        Ok(())
    }

    /// [`flush`](Self::flush); a log without a frame gets its head.
    pub(super) fn finish(&mut self, output: &mut (impl Write + Seek)) -> io::Result<()> {
        self.begin(output, Some(Instant::ZERO))?;
        self.flush(output)
    }

    /// The file's zero of time, which its head has to the millisecond.
    fn begin(&mut self, output: &mut impl Write, first: Option<Instant>) -> io::Result<Instant> {
        if let Some(begin) = self.begin {
            return Ok(begin);
        }
        let begin = Instant::from_millis(first.unwrap_or(Instant::ZERO).as_nanos() / 1_000_000);
        (self.begin, self.last) = (Some(begin), begin);
        output.write_all(&self.head())?;
        (self.size, self.uncompressed) = (FILE_HEAD as u64, FILE_HEAD as u64);
        Ok(begin)
    }

    fn container(&mut self, output: &mut impl Write) -> io::Result<()> {
        let mut packed = ZlibEncoder::new(Vec::new(), Compression::default());
        packed.write_all(&self.objects)?;
        let packed = packed.finish()?;
        let size = BASE_HEAD + CONTAINER_HEAD + packed.len();
        let mut container = Vec::with_capacity(size + 3);
        container.extend(base_head(BASE_HEAD as u16, size as u32, kind::CONTAINER));
        container.extend(ZLIB.to_le_bytes());
        container.extend([0; 6]);
        container.extend((self.objects.len() as u32).to_le_bytes());
        container.extend([0; 4]);
        container.extend(packed);
        container.resize(size + size % 4, 0);
        output.write_all(&container)?;
        self.size += container.len() as u64;
        self.uncompressed += (BASE_HEAD + CONTAINER_HEAD + self.objects.len()) as u64;
        self.objects.clear();
        Ok(())
    }

    fn head(&self) -> [u8; FILE_HEAD] {
        let mut head = [0; FILE_HEAD];
        head[..4].copy_from_slice(&FILE_SIGNATURE);
        head[4..8].copy_from_slice(&(FILE_HEAD as u32).to_le_bytes());
        head[12..16].copy_from_slice(&FORMAT_VERSION);
        head[16..24].copy_from_slice(&self.size.to_le_bytes());
        head[24..32].copy_from_slice(&self.uncompressed.to_le_bytes());
        head[32..36].copy_from_slice(&self.count.to_le_bytes());
        let times = [self.begin.unwrap_or(Instant::ZERO), self.last].map(to_system_time);
        for (place, field) in times.iter().flatten().enumerate() {
            let place = BEGIN_OF_MEASUREMENT + 2 * place;
            head[place..place + 2].copy_from_slice(&field.to_le_bytes());
        }
        head
    }
}

fn base_head(head: u16, size: u32, kind: u32) -> [u8; BASE_HEAD] {
    let mut bytes = [0; BASE_HEAD];
    bytes[..4].copy_from_slice(&OBJECT_SIGNATURE);
    bytes[4..6].copy_from_slice(&head.to_le_bytes());
    bytes[6..8].copy_from_slice(&1u16.to_le_bytes());
    bytes[8..12].copy_from_slice(&size.to_le_bytes());
    bytes[12..].copy_from_slice(&kind.to_le_bytes());
    bytes
}

fn id(id: CanId) -> u32 {
    id.raw() | if id.is_extended() { ID_EXTENDED } else { 0 }
}
