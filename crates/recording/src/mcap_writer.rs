//! Records, chunks and the list of contents of an MCAP file (<https://mcap.dev/spec>), as they are written.
//!
//! What is held while a file is written does not grow with it: a chunk is compressed and written whole, and the index of all chunks,
//! which stands at the end of the file, is made from what the file then holds.

use std::io::{self, BufRead as _, BufReader, Read, Seek, SeekFrom};
use std::ops::Range;

use super::packing::{Packer, WRITTEN};
use super::piece::Target;

/// Bytes of a chunk, uncompressed, before it is written without a flush.
const CHUNK: usize = 256 << 10;
/// Bytes of the index that are made before they are written.
const INDEX_PIECE: usize = 64 << 10;

/// Kinds of record.
mod op {
    pub(super) const HEADER: u8 = 0x01;
    pub(super) const FOOTER: u8 = 0x02;
    pub(super) const SCHEMA: u8 = 0x03;
    pub(super) const CHANNEL: u8 = 0x04;
    pub(super) const MESSAGE: u8 = 0x05;
    pub(super) const CHUNK: u8 = 0x06;
    pub(super) const MESSAGE_INDEX: u8 = 0x07;
    pub(super) const CHUNK_INDEX: u8 = 0x08;
    pub(super) const STATISTICS: u8 = 0x0B;
    pub(super) const SUMMARY_OFFSET: u8 = 0x0E;
    pub(super) const DATA_END: u8 = 0x0F;
}

/// An MCAP file that is being written.
pub(super) struct McapWriter {
    target: Box<dyn Target>,
    /// Bytes written.
    place: u64,
    /// Of everything written.
    check_sum: crc32fast::Hasher,
    /// Where the first chunk begins.
    data_from: u64,
    schemas: Vec<u8>,
    schema_count: u16,
    channels: Vec<u8>,
    /// Of each channel, by its identifier less one.
    counts: Vec<Count>,
    /// The records of the chunk that has not been written.
    chunk: Vec<u8>,
    /// Times of the messages in it.
    chunk_span: Option<(u64, u64)>,
    chunk_count: u32,
    message_count: u64,
    /// Times of all messages, ns.
    span: Option<(u64, u64)>,
    packer: Packer,
    /// What is put together before it is written.
    out: Vec<u8>,
    /// The target refused a write: how much of it is in the file is unknown.
    failed: bool,
    /// Written to its end.
    ended: bool,
}

/// The messages of a channel.
#[derive(Default)]
struct Count {
    messages: u64,
    /// Time in ns and place of each message in the chunk that has not been written.
    in_chunk: Vec<(u64, u64)>,
}

impl McapWriter {
    pub(super) fn begin(target: Box<dyn Target>, library: &str) -> io::Result<Self> {
        let mut file = Self {
            target,
            place: 0,
            check_sum: crc32fast::Hasher::new(),
            data_from: 0,
            schemas: Vec::new(),
            schema_count: 0,
            channels: Vec::new(),
            counts: Vec::new(),
            chunk: Vec::new(),
            chunk_span: None,
            chunk_count: 0,
            message_count: 0,
            span: None,
            packer: Packer::new()?,
            out: Vec::new(),
            failed: false,
            ended: false,
        };
        file.out.extend_from_slice(mcap::MAGIC);
        record(&mut file.out, op::HEADER, |body| {
            put_text(body, "");
            put_text(body, library);
        });
        file.write_out()?;
        Ok(file)
    }

    /// A schema, whose identifier is returned. It is given before the first message.
    pub(super) fn schema(&mut self, name: &str, encoding: &str, data: &[u8]) -> io::Result<u16> {
        self.schema_count += 1;
        let id = self.schema_count;
        let from = self.schemas.len();
        record(&mut self.schemas, op::SCHEMA, |body| {
            body.extend(id.to_le_bytes());
            put_text(body, name);
            put_text(body, encoding);
            put_length(body, data.len());
            body.extend_from_slice(data);
        });
        self.out.extend_from_slice(&self.schemas[from..]);
        self.write_out()?;
        Ok(id)
    }

    /// A channel, whose identifier is returned. It is given before the first message.
    pub(super) fn channel(&mut self, schema: u16, topic: &str, encoding: &str) -> io::Result<u16> {
        self.counts.push(Count::default());
        let id = self.counts.len() as u16;
        let from = self.channels.len();
        record(&mut self.channels, op::CHANNEL, |body| {
            body.extend(id.to_le_bytes());
            body.extend(schema.to_le_bytes());
            put_text(body, topic);
            put_text(body, encoding);
            put_length(body, 0);
        });
        self.out.extend_from_slice(&self.channels[from..]);
        self.write_out()?;
        Ok(id)
    }

    /// A message of a channel at `time` ns. Sequence numbers count on each channel alike: readers want them ascending.
    pub(super) fn message(&mut self, channel: u16, time: u64, data: &[u8]) -> io::Result<()> {
        let sequence = self.message_count as u32;
        self.message_count += 1;
        let count = &mut self.counts[usize::from(channel) - 1];
        count.messages += 1;
        count.in_chunk.push((time, self.chunk.len() as u64));
        record(&mut self.chunk, op::MESSAGE, |body| {
            body.extend(channel.to_le_bytes());
            body.extend(sequence.to_le_bytes());
            body.extend(time.to_le_bytes());
            body.extend(time.to_le_bytes());
            body.extend_from_slice(data);
        });
        for span in [&mut self.chunk_span, &mut self.span] {
            *span = Some(span.map_or((time, time), |(first, last)| (first.min(time), last.max(time))));
        }
        if self.chunk.len() >= CHUNK { self.end_chunk() } else { Ok(()) }
    }

    /// Hands everything given so far to the target.
    pub(super) fn flush(&mut self) -> io::Result<()> {
        self.end_chunk()?;
        self.target.flush()
    }

    /// Writes the end of the file. What was written before is read for it.
    pub(super) fn finish(&mut self) -> io::Result<()> {
        if self.ended {
            return Ok(());
        }
        self.end_chunk()?;
        let data_until = self.place;
        let data_check_sum = self.check_sum.clone().finalize();
        record(&mut self.out, op::DATA_END, |body| body.extend(data_check_sum.to_le_bytes()));
        self.write_out()?;
        self.check_sum = crc32fast::Hasher::new();
        let summary_from = self.place;
        let groups = self.write_summary(data_until)?;
        let offsets_from = self.place;
        for (kind, group) in groups.iter().filter(|(_, group)| !group.is_empty()) {
            record(&mut self.out, op::SUMMARY_OFFSET, |body| {
                body.push(*kind);
                body.extend(group.start.to_le_bytes());
                body.extend((group.end - group.start).to_le_bytes());
            });
        }
        self.write_out()?;
        record(&mut self.out, op::FOOTER, |body| {
            body.extend(summary_from.to_le_bytes());
            body.extend(offsets_from.to_le_bytes());
        });
        // Its check sum covers what stands before it in the footer, whose length counts it.
        self.out[1..9].copy_from_slice(&20_u64.to_le_bytes());
        self.check_sum.update(&self.out);
        self.out.extend(self.check_sum.clone().finalize().to_le_bytes());
        self.out.extend_from_slice(mcap::MAGIC);
        self.write_out()?;
        self.ended = true;
        self.target.flush()
    }

    /// Writes the groups of the summary, and returns where they stand.
    fn write_summary(&mut self, data_until: u64) -> io::Result<[(u8, Range<u64>); 4]> {
        let schemas_from = self.place;
        self.out.extend_from_slice(&self.schemas);
        self.write_out()?;
        let channels_from = self.place;
        self.out.extend_from_slice(&self.channels);
        self.write_out()?;
        let statistics_from = self.place;
        let (first, last) = self.span.unwrap_or_default();
        let Self { out, counts, schema_count, chunk_count, message_count, .. } = self;
        record(out, op::STATISTICS, |body| {
            body.extend(message_count.to_le_bytes());
            body.extend(schema_count.to_le_bytes());
            body.extend((counts.len() as u32).to_le_bytes());
            // Neither attachments nor metadata.
            body.extend([0; 8]);
            body.extend(chunk_count.to_le_bytes());
            body.extend(first.to_le_bytes());
            body.extend(last.to_le_bytes());
            put_length(body, counts.len() * 10);
            for (id, count) in (1_u16..).zip(counts.iter()) {
                body.extend(id.to_le_bytes());
                body.extend(count.messages.to_le_bytes());
            }
        });
        self.write_out()?;
        let index_from = self.place;
        self.write_index(data_until)?;
        Ok([
            (op::SCHEMA, schemas_from..channels_from),
            (op::CHANNEL, channels_from..statistics_from),
            (op::STATISTICS, statistics_from..index_from),
            (op::CHUNK_INDEX, index_from..self.place),
        ])
    }

    /// Writes the index of all chunks, of which the last ends at `data_until`.
    fn write_index(&mut self, data_until: u64) -> io::Result<()> {
        let mut at = self.data_from;
        while self.chunk_count > 0 && at < data_until {
            self.target.seek(SeekFrom::Start(at))?;
            let mut written = BufReader::new(&mut self.target);
            while at < data_until && self.out.len() < INDEX_PIECE {
                at = index_chunk(&mut written, at, data_until, &mut self.out)?;
            }
            self.target.seek(SeekFrom::Start(self.place))?;
            self.write_out()?;
        }
        Ok(())
    }

    /// Writes the chunk, and where each message is in it.
    fn end_chunk(&mut self) -> io::Result<()> {
        let Some((first, last)) = self.chunk_span.take() else { return Ok(()) };
        if self.chunk_count == 0 {
            self.data_from = self.place;
        }
        self.chunk_count += 1;
        let chunk = &self.chunk;
        let packed = self.packer.pack(chunk)?;
        record(&mut self.out, op::CHUNK, |body| {
            body.extend(first.to_le_bytes());
            body.extend(last.to_le_bytes());
            body.extend((chunk.len() as u64).to_le_bytes());
            body.extend(crc32fast::hash(chunk).to_le_bytes());
            put_text(body, WRITTEN);
            body.extend((packed.len() as u64).to_le_bytes());
            body.extend_from_slice(&packed);
        });
        for (id, count) in (1_u16..).zip(&mut self.counts).filter(|(_, count)| !count.in_chunk.is_empty()) {
            record(&mut self.out, op::MESSAGE_INDEX, |body| {
                body.extend(id.to_le_bytes());
                put_length(body, count.in_chunk.len() * 16);
                for (time, offset) in count.in_chunk.drain(..) {
                    body.extend(time.to_le_bytes());
                    body.extend(offset.to_le_bytes());
                }
            });
        }
        self.chunk.clear();
        self.write_out()
    }

    /// Writes what was put together; nothing more after a failure.
    fn write_out(&mut self) -> io::Result<()> {
        if self.failed {
            return Err(io::Error::other("an earlier write to the file failed"));
        }
        let written = self.target.write_all(&self.out);
        self.failed = written.is_err();
        self.check_sum.update(&self.out);
        self.place += self.out.len() as u64;
        self.out.clear();
        written
    }
}

impl Drop for McapWriter {
    /// A file that was not finished is finished, as far as possible.
    fn drop(&mut self) {
        let _ = self.finish();
    }
}

/// Appends a record whose body `body` appends.
fn record(out: &mut Vec<u8>, kind: u8, body: impl FnOnce(&mut Vec<u8>)) {
    out.push(kind);
    let length_at = out.len();
    out.extend([0; 8]);
    body(out);
    let length = (out.len() - length_at - 8) as u64;
    out[length_at..length_at + 8].copy_from_slice(&length.to_le_bytes());
}

fn put_text(out: &mut Vec<u8>, text: &str) {
    put_length(out, text.len());
    out.extend_from_slice(text.as_bytes());
}

/// A length in bytes of what follows. Nothing here comes near 4 GiB: a chunk is written from [`CHUNK`] on.
fn put_length(out: &mut Vec<u8>, length: usize) {
    out.extend((length as u32).to_le_bytes());
}

/// Appends the index of the chunk that begins at `at`, where `file` stands, and returns where the next begins.
fn index_chunk(file: &mut BufReader<impl Read + Seek>, at: u64, data_until: u64, out: &mut Vec<u8>) -> io::Result<u64> {
    let changed = || io::Error::new(io::ErrorKind::InvalidData, "another program has changed the file");
    // Kind and length of the record, then times, uncompressed size, check sum, name of the compression and its size.
    let head: [u8; 9 + 24 + 4 + 4 + WRITTEN.len() + 8] = take(file)?;
    let number = |from: usize| u64_at(&head, from);
    let (length, packed) = (number(1), number(head.len() - 8));
    let after = |at: u64, length: u64| at.checked_add(length)?.checked_add(9).filter(|end| *end <= data_until);
    let is_chunk = head[0] == op::CHUNK && packed <= length;
    let after_chunk = after(at, length).filter(|_| is_chunk).ok_or_else(changed)?;
    file.seek_relative(packed as i64)?;
    let (mut end, mut indexes) = (after_chunk, Vec::new());
    while end < data_until {
        if file.fill_buf()?.first() != Some(&op::MESSAGE_INDEX) {
            break;
        }
        let head: [u8; 9 + 2] = take(file)?;
        let length = u64_at(&head, 1);
        indexes.push((u16::from_le_bytes([head[9], head[10]]), end));
        end = after(end, length).ok_or_else(changed)?;
        file.seek_relative(length as i64 - 2)?;
    }
    record(out, op::CHUNK_INDEX, |body| {
        body.extend_from_slice(&head[9..25]);
        body.extend(at.to_le_bytes());
        body.extend((after_chunk - at).to_le_bytes());
        put_length(body, indexes.len() * 10);
        for (channel, place) in &indexes {
            body.extend(channel.to_le_bytes());
            body.extend(place.to_le_bytes());
        }
        body.extend((end - after_chunk).to_le_bytes());
        put_text(body, WRITTEN);
        body.extend(packed.to_le_bytes());
        body.extend(number(25).to_le_bytes());
    });
    Ok(end)
}

fn take<const N: usize>(file: &mut impl Read) -> io::Result<[u8; N]> {
    let mut bytes = [0; N];
    file.read_exact(&mut bytes)?;
    Ok(bytes)
}

fn u64_at(bytes: &[u8], from: usize) -> u64 {
    bytes[from..from + 8].try_into().map_or(0, u64::from_le_bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use mcap::records::Record;
    use mcap::sans_io::decompressor::{DecompressResult, Decompressor};
    use mcap::sans_io::linear_reader::LinearReaderOptions;
    use mcap::sans_io::{LinearReadEvent, LinearReader};
    use mcap::{McapResult, Summary};

    use crate::convert::Memory;

    impl McapWriter {
        /// Bytes that are held for what was written and what was not.
        fn held(&self) -> usize {
            // Each part by name: one that is added is thought of here.
            let Self {
                schemas,
                channels,
                counts,
                chunk,
                out,
                packer: _,
                target: _,
                place: _,
                check_sum: _,
                data_from: _,
                ..
            } = self;
            let Self { schema_count: _, chunk_count: _, message_count: _, span: _, chunk_span: _, failed: _, .. } =
                self;
            let index: usize = counts.iter().map(|count| count.in_chunk.capacity() * size_of::<(u64, u64)>()).sum();
            schemas.capacity() + channels.capacity() + counts.capacity() + chunk.capacity() + out.capacity() + index
        }
    }

    /// A file with two channels; `chunks` times three messages and a flush.
    fn written(chunks: u64) -> (Memory, McapWriter) {
        let memory = Memory::default();
        let mut file = McapWriter::begin(Box::new(memory.clone()), "a test").unwrap();
        for topic in ["/first", "/second"] {
            let schema = file.schema(topic, "jsonschema", b"{}").unwrap();
            file.channel(schema, topic, "json").unwrap();
        }
        for number in 0..chunks {
            for (channel, time) in [(1, number * 100), (2, number * 100 + 40), (1, number * 100 + 50)] {
                file.message(channel, time, format!("{{\"at\":{time}}}").as_bytes()).unwrap();
            }
            file.flush().unwrap();
        }
        (memory, file)
    }

    #[test]
    fn what_is_held_does_not_grow_with_the_file() {
        let (short, long) = (written(500), written(5000));
        assert_eq!(short.1.held(), long.1.held());
        let (short, long) = (short.0.contents().len(), long.0.contents().len());
        assert!(long > 9 * short, "{short} bytes, then {long}");
    }

    /// Unpacks for the reader of others, which is given no more than a chunk at a time.
    #[derive(Default)]
    struct Unpack {
        packed: Vec<u8>,
        plain: Option<(Vec<u8>, usize)>,
    }

    impl Decompressor for Unpack {
        fn next_read_size(&self) -> usize {
            0
        }

        fn decompress(&mut self, src: &[u8], dst: &mut [u8]) -> McapResult<DecompressResult> {
            let mut consumed = 0;
            if self.plain.is_none() {
                self.packed.extend_from_slice(src);
                consumed = src.len();
                self.plain = zstd::decode_all(&*self.packed).ok().map(|plain| (plain, 0));
            }
            let Some((plain, at)) = &mut self.plain else { return Ok(DecompressResult { consumed, wrote: 0 }) };
            let wrote = dst.len().min(plain.len() - *at);
            dst[..wrote].copy_from_slice(&plain[*at..*at + wrote]);
            *at += wrote;
            Ok(DecompressResult { consumed, wrote })
        }

        fn reset(&mut self) -> McapResult<()> {
            *self = Self::default();
            Ok(())
        }

        fn name(&self) -> &'static str {
            WRITTEN
        }
    }

    /// Channel, sequence number, time and data of each message, as the format's own reader finds them; it checks each check sum.
    fn messages(bytes: &[u8]) -> Vec<(u16, u32, u64, Vec<u8>)> {
        let options = LinearReaderOptions::default()
            .with_validate_chunk_crcs(true)
            .with_validate_data_section_crc(true)
            .with_validate_summary_section_crc(true);
        let mut reader = LinearReader::new_with_options(options);
        reader.add_decompressor(Unpack::default()).unwrap();
        let (mut found, mut rest) = (Vec::new(), bytes);
        while let Some(event) = reader.next_event() {
            match event.unwrap() {
                LinearReadEvent::ReadRequest(wanted) => {
                    let given = wanted.min(rest.len());
                    reader.insert(given).copy_from_slice(&rest[..given]);
                    reader.notify_read(given);
                    rest = &rest[given..];
                }
                LinearReadEvent::Record { opcode, data } => {
                    if let Record::Message { header, data } = mcap::parse_record(opcode, data).unwrap() {
                        found.push((header.channel_id, header.sequence, header.log_time, data.into_owned()));
                    }
                }
            }
        }
        found
    }

    #[test]
    fn the_reader_of_others_takes_the_file_and_its_check_sums() {
        let (memory, mut file) = written(3000);
        file.finish().unwrap();
        let found = messages(&memory.contents());
        let times = (0..3000_u64).flat_map(|number| [number * 100, number * 100 + 40, number * 100 + 50]);
        let expected = (0_u32..).zip(times).map(|(sequence, time)| {
            let channel = if sequence % 3 == 1 { 2 } else { 1 };
            (channel, sequence, time, format!("{{\"at\":{time}}}").into_bytes())
        });
        assert!(expected.eq(found.iter().cloned()), "{:?}", found.last());
    }

    #[test]
    fn the_index_says_where_each_chunk_and_message_stands() {
        // More than one piece of the index.
        let (memory, mut file) = written(3000);
        file.finish().unwrap();
        let bytes = memory.contents();
        let summary = Summary::read(&bytes).unwrap().expect("a summary");
        let statistics = summary.stats.as_ref().expect("statistics");
        assert_eq!((statistics.message_count, statistics.chunk_count), (9000, 3000));
        assert_eq!((statistics.message_start_time, statistics.message_end_time), (0, 299_950));
        let counts: Vec<(u16, u64)> =
            statistics.channel_message_counts.iter().map(|(id, count)| (*id, *count)).collect();
        assert_eq!(counts, [(1, 6000), (2, 3000)]);
        let topics: Vec<&str> = (1..=2).map(|id| summary.channels[&id].topic.as_str()).collect();
        assert_eq!((topics, summary.schemas.len()), (vec!["/first", "/second"], 2));
        assert_eq!(summary.chunk_indexes.len(), 3000);
        for (number, chunk) in (0_u64..).zip(&summary.chunk_indexes) {
            assert_eq!((chunk.message_start_time, chunk.message_end_time), (number * 100, number * 100 + 50));
            assert_eq!((bytes[chunk.chunk_start_offset as usize], chunk.compression.as_str()), (op::CHUNK, WRITTEN));
            let indexes = summary.read_message_indexes(&bytes, chunk).unwrap();
            let times = |topic: &str| -> Vec<u64> {
                let of_it = indexes.iter().find(|(channel, _)| channel.topic == topic).expect("an index");
                of_it.1.iter().map(|entry| entry.log_time).collect()
            };
            assert_eq!(times("/first"), [number * 100, number * 100 + 50]);
            assert_eq!(times("/second"), [number * 100 + 40]);
            let ends = chunk.chunk_start_offset + chunk.chunk_length + chunk.message_index_length;
            let next = summary.chunk_indexes.get(number as usize + 1).map(|next| next.chunk_start_offset);
            assert!(next.is_none_or(|next| next == ends), "chunk {number} ends at {ends}, then {next:?}");
        }
    }

    #[test]
    fn a_file_without_messages_and_one_that_was_not_finished_are_whole() {
        let (empty, _) = written(0);
        let (dropped, file) = written(2);
        drop(file);
        assert_eq!((messages(&empty.contents()).len(), messages(&dropped.contents()).len()), (0, 6));
        assert_eq!(Summary::read(&dropped.contents()).unwrap().expect("a summary").chunk_indexes.len(), 2);
    }

    #[test]
    fn a_file_that_another_has_changed_is_an_error_at_its_end() {
        let (memory, mut file) = written(2);
        let from = file.data_from as usize;
        memory.change(|bytes| bytes[from + 1..from + 9].fill(0xFF));
        assert_eq!(file.finish().unwrap_err().kind(), io::ErrorKind::InvalidData);
    }
}
