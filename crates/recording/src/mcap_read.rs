//! An MCAP file, read back.

use std::collections::HashMap;

use can::Instant;
use mcap::read::{LinearReader, Options};
use mcap::records::{Channel, ChunkHeader, Record};
use serde_json::Value;

use super::cdr::CdrReader;
use super::channels::{EVENTS, MESSAGE_ENCODING, NAMED};
use super::column::{Column, Subject};
use super::packing;
use super::piece::{Mark, Recorded, Series, Severity};

/// The longest chunk that is unpacked, in bytes. Writers end theirs at some MB.
const LONGEST_CHUNK: u64 = 64 << 20;

pub(super) fn read_mcap(bytes: &[u8]) -> Result<Recorded, String> {
    if !bytes.starts_with(mcap::MAGIC) {
        return Err("not an MCAP file: it does not begin as one".into());
    }
    let records = LinearReader::new_with_options(bytes, Options::IgnoreEndMagic.into())
        .map_err(|error| format!("not an MCAP file: {error}"))?;
    let mut reading = McapContents::default();
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
    let Ok(plain) = packing::unpacked(&header.compression, data, size)? else { return Ok(None) };
    // A check sum of 0 says that there is none.
    let is_whole = plain.len() as u64 == size
        && (header.uncompressed_crc == 0 || header.uncompressed_crc == crc32fast::hash(&plain));
    Ok(is_whole.then_some(plain))
}

/// What was read so far.
#[derive(Default)]
struct McapContents {
    recorded: Recorded,
    schemas: HashMap<u16, Vec<u8>>,
    channels: HashMap<u16, Topic>,
}

/// A channel of which messages are read.
enum Topic {
    /// What happened.
    Events { is_json: bool },
    /// Signals: the columns of a message, in its order.
    Signals { fields: Vec<SignalField> },
    /// Signals of another program, or of a record of before: JSON, with a JSON schema.
    Json { subject: Subject, schema: Value, places: HashMap<String, usize> },
    /// Anything else.
    Other,
}

/// A field of a message, and where its signal stands in the record.
struct SignalField {
    column: Column,
    place: Option<usize>,
}

impl McapContents {
    /// Nothing for a message whose channel is not known.
    fn take(&mut self, record: Record<'_>) -> Option<()> {
        match record {
            Record::Schema { header, data } => drop(self.schemas.insert(header.id, data.into_owned())),
            Record::Channel(channel) => {
                let schema = self.schemas.get(&channel.schema_id).map(Vec::as_slice);
                // It may be repeated.
                self.channels.entry(channel.id).or_insert_with(|| Topic::of(&channel, schema.unwrap_or_default()));
            }
            Record::Message { header, data } => {
                let topic = self.channels.get_mut(&header.channel_id)?;
                let at = Instant::from_nanos(header.log_time);
                // A message of another program may be anything.
                let _ = topic.read(at, &data, &mut self.recorded);
            }
            _ => {}
        }
        Some(())
    }
}

impl Topic {
    fn of(channel: &Channel, schema: &[u8]) -> Self {
        let is_json = channel.message_encoding == "json";
        if !is_json && channel.message_encoding != MESSAGE_ENCODING {
            return Self::Other;
        }
        if channel.topic == EVENTS {
            return Self::Events { is_json };
        }
        match Subject::of_topic(&channel.topic) {
            Some(subject) if is_json => {
                let schema = serde_json::from_slice(schema).unwrap_or_default();
                Self::Json { subject, schema, places: HashMap::new() }
            }
            Some(subject) => fields_of(&subject, schema).map_or(Self::Other, |fields| Self::Signals { fields }),
            None => Self::Other,
        }
    }

    /// Nothing if it is not what was expected.
    fn read(&mut self, at: Instant, data: &[u8], recorded: &mut Recorded) -> Option<()> {
        let mut push = |place: &mut Option<usize>, column: &dyn Fn() -> Column, value: f64| {
            let place = *place.get_or_insert_with(|| {
                recorded.series.push(Series { column: column(), points: Vec::new() });
                recorded.series.len() - 1
            });
            recorded.series[place].points.push((at.as_secs_f64(), value));
        };
        match self {
            Self::Events { is_json: false } => recorded.marks.push(mark_of_cdr(at, data)?),
            Self::Events { is_json: true } => {
                recorded.marks.push(mark_of_json(at, &serde_json::from_slice(data).ok()?))
            }
            Self::Signals { fields } => {
                let mut data = CdrReader::new(data)?;
                for SignalField { column, place } in fields {
                    push(place, &|| column.clone(), data.f64()?);
                }
            }
            Self::Json { subject, schema, places } => {
                let Value::Object(values) = serde_json::from_slice(data).ok()? else { return None };
                for (signal, value) in values {
                    let value = match value {
                        Value::Number(number) => number.as_f64().unwrap_or(f64::NAN),
                        Value::Null => f64::NAN,
                        _ => continue,
                    };
                    let unit = schema["properties"][&signal]["unit"].as_str().unwrap_or_default().to_owned();
                    let column = || Column {
                        subject: subject.clone(),
                        signal: signal.clone().into(),
                        unit: unit.clone().into(),
                    };
                    let mut place = places.get(&signal).copied();
                    push(&mut place, &column, value);
                    places.extend(place.map(|place| (signal.clone(), place)));
                }
            }
            Self::Other => {}
        }
        Some(())
    }
}

/// The signals of a schema; `None` if it has anything but numbers of the one kind that is written.
fn fields_of(subject: &Subject, schema: &[u8]) -> Option<Vec<SignalField>> {
    let field = |line: &str| {
        let (field, comment) = line.split_once("  # ").unwrap_or((line, ""));
        let name = field.strip_prefix("float64 ")?;
        let (unit, signal) = comment.split_once(NAMED).unwrap_or((comment, name));
        let (signal, unit) = (signal.to_owned().into(), unit.to_owned().into());
        Some(SignalField { column: Column { subject: subject.clone(), signal, unit }, place: None })
    };
    std::str::from_utf8(schema).ok()?.lines().map(field).collect()
}

fn mark_of_cdr(at: Instant, data: &[u8]) -> Option<Mark> {
    let mut data = CdrReader::new(data)?;
    // The time is that of the message.
    let (_, _, level) = (data.u32()?, data.u32()?, data.u8()?);
    let (text, of, _, _) = (data.text()?.to_owned(), data.text()?.to_owned(), data.text()?, data.u32()?);
    let kind = data.text().unwrap_or_default().to_owned();
    Some(Mark { at, of: of.into(), kind: kind.into(), severity: severity_of(level.into()), text })
}

fn mark_of_json(at: Instant, fields: &Value) -> Mark {
    let text = |name: &str| fields[name].as_str().unwrap_or_default().to_owned();
    let severity = severity_of(fields["level"].as_u64().unwrap_or_default());
    Mark { at, of: text("name").into(), kind: text("kind").into(), severity, text: text("message") }
}

/// Of a level of `foxglove.Log`.
fn severity_of(level: u64) -> Severity {
    match level {
        0..=2 => Severity::Note,
        3 => Severity::Warning,
        _ => Severity::Fault,
    }
}
