//! An MCAP file, read back.

use std::collections::HashMap;
use std::io::Read as _;

use can::Instant;
use mcap::read::{LinearReader, Options};
use mcap::records::{Channel, ChunkHeader, Record};
use serde_json::Value;

use super::column::{Column, Subject};
use super::mcap_file::EVENTS;
use super::mcap_writer::LZ4;
use super::piece::{Mark, Recorded, Series, Severity};

/// The longest chunk that is unpacked, in bytes. Writers end theirs at some MB.
const LONGEST_CHUNK: u64 = 64 << 20;

pub(super) fn read_mcap(bytes: &[u8]) -> Result<Recorded, String> {
    if !bytes.starts_with(mcap::MAGIC) {
        return Err("not an MCAP file: it does not begin as one".into());
    }
    let records = LinearReader::new_with_options(bytes, Options::IgnoreEndMagic.into())
        .map_err(|error| format!("not an MCAP file: {error}"))?;
    let mut reading = Reading::default();
    reading.recorded.torn = !bytes.ends_with(mcap::MAGIC);
    for record in records {
        let whole = match record {
            // What follows repeats what stands before.
            Ok(Record::DataEnd(_)) => break,
            Ok(Record::Chunk { header, data }) => match unpacked(&header, &data)? {
                Some(plain) => LinearReader::sans_magic(&plain).try_for_each(|record| reading.take(record.ok()?)),
                None => None,
            },
            Ok(record) => reading.take(record),
            Err(_) => None,
        };
        if whole.is_none() {
            reading.recorded.torn = true;
            break;
        }
    }
    Ok(reading.recorded)
}

/// The records of a chunk; nothing if it is torn.
///
/// # Errors
/// A sentence: it is packed in a way that is not read.
fn unpacked(header: &ChunkHeader, data: &[u8]) -> Result<Option<Vec<u8>>, String> {
    let size = header.uncompressed_size;
    if size > LONGEST_CHUNK {
        return Err(format!("a chunk of it has {size} bytes; expected at most {LONGEST_CHUNK}"));
    }
    let mut plain = Vec::new();
    let read = match header.compression.as_str() {
        "" => data.take(size).read_to_end(&mut plain),
        LZ4 => lz4_flex::frame::FrameDecoder::new(data).take(size).read_to_end(&mut plain),
        other => {
            return Err(format!("its chunks are compressed with '{other}'; expected '{LZ4}', or none"));
        }
    };
    // A check sum of 0 says that there is none.
    let is_whole = read.is_ok_and(|read| read as u64 == size)
        && (header.uncompressed_crc == 0 || header.uncompressed_crc == crc32fast::hash(&plain));
    Ok(is_whole.then_some(plain))
}

/// What was read so far.
#[derive(Default)]
struct Reading {
    recorded: Recorded,
    /// Those that hold JSON.
    schemas: HashMap<u16, Value>,
    channels: HashMap<u16, Channel>,
    /// Where the signal of a channel stands in the record.
    places: HashMap<(u16, String), usize>,
}

impl Reading {
    /// Nothing for a message whose channel is not known.
    fn take(&mut self, record: Record<'_>) -> Option<()> {
        match record {
            Record::Schema { header, data } => {
                if let Ok(schema) = serde_json::from_slice(&data) {
                    self.schemas.insert(header.id, schema);
                }
            }
            Record::Channel(channel) => drop(self.channels.insert(channel.id, channel)),
            Record::Message { header, data } => {
                let channel = self.channels.get(&header.channel_id)?;
                // A message of another program may be anything.
                let Ok(Value::Object(fields)) = serde_json::from_slice(&data) else { return Some(()) };
                let at = Instant::from_nanos(header.log_time);
                if channel.topic == EVENTS {
                    self.recorded.marks.push(mark_of(at, &fields));
                } else if let Some(subject) = Subject::of_topic(&channel.topic) {
                    let schema = self.schemas.get(&channel.schema_id);
                    let channel = channel.id;
                    for (signal, value) in fields {
                        let value = match value {
                            Value::Number(number) => number.as_f64().unwrap_or(f64::NAN),
                            Value::Null => f64::NAN,
                            _ => continue,
                        };
                        let series = &mut self.recorded.series;
                        let place = *self.places.entry((channel, signal)).or_insert_with_key(|(_, signal)| {
                            let unit = unit_in(schema, signal).into();
                            let column = Column { subject: subject.clone(), signal: signal.clone().into(), unit };
                            series.push(Series { column, points: Vec::new() });
                            series.len() - 1
                        });
                        self.recorded.series[place].points.push((at.as_secs_f64(), value));
                    }
                }
            }
            _ => {}
        }
        Some(())
    }
}

/// The unit that a schema gives a signal.
fn unit_in(schema: Option<&Value>, signal: &str) -> String {
    let unit = schema.and_then(|schema| schema["properties"][signal]["unit"].as_str());
    unit.unwrap_or_default().to_owned()
}

fn mark_of(at: Instant, fields: &serde_json::Map<String, Value>) -> Mark {
    let text = |name: &str| fields.get(name).and_then(Value::as_str).unwrap_or_default().to_owned();
    let severity = match fields.get("level").and_then(Value::as_u64) {
        Some(0..=2) | None => Severity::Note,
        Some(3) => Severity::Warning,
        Some(_) => Severity::Fault,
    };
    Mark { at, of: text("name").into(), kind: text("kind").into(), severity, text: text("message") }
}
