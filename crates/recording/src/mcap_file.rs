//! A record as MCAP.
//!
//! Chunks are built in memory and written whole: the file of a program that was killed ends between two of them.

use std::fmt::Write as _;
use std::io;

use can::{Frame, Instant};
use serde_json::json;

use super::column::{Column, Subject};
use super::mcap_writer::McapWriter;
use super::piece::{Mark, Severity, Target};

pub(super) const FRAMES: &str = "/can";
pub(super) const EVENTS: &str = "/events";

/// An MCAP file that is being written.
pub(super) struct Mcap {
    writer: McapWriter,
    topics: Vec<Topic>,
    frames: u16,
    events: u16,
    text: String,
}

/// The signals of one subject.
struct Topic {
    channel: u16,
    /// By their place in a row.
    fields: Vec<(usize, String)>,
}

impl Mcap {
    pub(super) fn begin(target: Box<dyn Target>, columns: &[Column]) -> io::Result<Self> {
        let mut writer = McapWriter::begin(target, concat!("ferrodrive ", env!("CARGO_PKG_VERSION")))?;
        let mut subjects: Vec<&Subject> = Vec::new();
        for column in columns {
            if !subjects.contains(&&column.subject) {
                subjects.push(&column.subject);
            }
        }
        let mut topics = Vec::new();
        for subject in subjects {
            let of_it = columns.iter().enumerate().filter(|(_, column)| column.subject == *subject);
            let of_it: Vec<(usize, &Column)> = of_it.collect();
            let (name, schema) = schema_of(subject, &of_it);
            let channel = channel(&mut writer, &subject.topic(), &name, &schema)?;
            let fields = of_it.iter().map(|(place, column)| (*place, json!(column.signal).to_string())).collect();
            topics.push(Topic { channel, fields });
        }
        let frames = channel(&mut writer, FRAMES, "ferrodrive.Frame", &frame_schema())?;
        // The name and the fields of a line of a log, as Foxglove knows them.
        let events = channel(&mut writer, EVENTS, "foxglove.Log", &log_schema())?;
        let mut file = Self { writer, topics, frames, events, text: String::new() };
        // A reader that follows the file sees its topics at once.
        file.flush()?;
        Ok(file)
    }

    pub(super) fn row(&mut self, at: Instant, values: &[f64]) -> io::Result<()> {
        (0..self.topics.len()).try_for_each(|place| self.row_of(place, at, values))
    }

    /// The subjects of which there is a value.
    pub(super) fn sparse_row(&mut self, at: Instant, values: &[f64]) -> io::Result<()> {
        for place in 0..self.topics.len() {
            let has_value = |(column, _): &(usize, String)| values.get(*column).is_some_and(|value| value.is_finite());
            if self.topics[place].fields.iter().any(has_value) {
                self.row_of(place, at, values)?;
            }
        }
        Ok(())
    }

    fn row_of(&mut self, place: usize, at: Instant, values: &[f64]) -> io::Result<()> {
        let topic = &self.topics[place];
        self.text.clear();
        self.text.push('{');
        for (column, name) in &topic.fields {
            let value = values.get(*column).copied().unwrap_or(f64::NAN);
            let comma = if self.text.len() > 1 { "," } else { "" };
            // JSON has no form for what is not a number.
            let _ = if value.is_finite() {
                write!(self.text, "{comma}{name}:{value}")
            } else {
                write!(self.text, "{comma}{name}:null")
            };
        }
        self.text.push('}');
        let channel = topic.channel;
        self.message(channel, at)
    }

    pub(super) fn frame(&mut self, at: Instant, frame: &Frame) -> io::Result<()> {
        self.text.clear();
        let _ = write!(
            self.text,
            r#"{{"id":{},"extended":{},"remote":{},"length":{},"data":""#,
            frame.id().raw(),
            frame.id().is_extended(),
            frame.is_remote(),
            frame.dlc()
        );
        for byte in frame.data() {
            let _ = write!(self.text, "{byte:02X}");
        }
        let _ = write!(self.text, r#"","text":"{frame}"}}"#);
        self.message(self.frames, at)
    }

    pub(super) fn mark(&mut self, mark: &Mark) -> io::Result<()> {
        // Levels of foxglove.Log: 2 is INFO, 3 WARNING, 4 ERROR.
        let level = match mark.severity {
            Severity::Note => 2,
            Severity::Warning => 3,
            Severity::Fault => 4,
        };
        let nanos = mark.at.as_nanos();
        let timestamp = json!({ "sec": nanos / 1_000_000_000, "nsec": nanos % 1_000_000_000 });
        let message = json!({
            "timestamp": timestamp, "level": level, "message": mark.text, "name": mark.of, "file": "", "line": 0,
            "kind": mark.kind
        });
        self.text.clear();
        let _ = write!(self.text, "{message}");
        self.message(self.events, mark.at)
    }

    pub(super) fn flush(&mut self) -> io::Result<()> {
        self.writer.flush()
    }

    pub(super) fn finish(mut self) -> io::Result<()> {
        self.writer.finish()
    }

    /// Writes what stands in `text`.
    fn message(&mut self, channel: u16, at: Instant) -> io::Result<()> {
        self.writer.message(channel, at.as_nanos(), self.text.as_bytes())
    }
}

fn channel(writer: &mut McapWriter, topic: &str, name: &str, schema: &serde_json::Value) -> io::Result<u16> {
    let schema = writer.schema(name, "jsonschema", schema.to_string().as_bytes())?;
    writer.channel(schema, topic, "json")
}

/// Name and schema of the signals of one subject.
fn schema_of(subject: &Subject, columns: &[(usize, &Column)]) -> (String, serde_json::Value) {
    let property = |column: &Column| {
        let unit = if column.unit.is_empty() { "no unit" } else { &column.unit };
        json!({ "type": ["number", "null"], "description": unit, "unit": column.unit })
    };
    let properties: serde_json::Map<String, serde_json::Value> =
        columns.iter().map(|(_, column)| (column.signal.to_string(), property(column))).collect();
    let title = subject.title();
    let schema = json!({ "title": title, "type": "object", "properties": properties });
    // A schema of its own for each subject: readers keep the first of a name.
    (format!("ferrodrive.Signals of {title}"), schema)
}

fn frame_schema() -> serde_json::Value {
    json!({
        "title": "a CAN frame, at the end of its last bit",
        "type": "object",
        "properties": {
            "id": { "type": "integer", "description": "CAN identifier" },
            "extended": { "type": "boolean", "description": "29 bits" },
            "remote": { "type": "boolean", "description": "a remote transmission request" },
            "length": { "type": "integer", "description": "data length code" },
            "data": { "type": "string", "description": "hexadecimal" },
            "text": { "type": "string", "description": "as candump writes it" }
        }
    })
}

fn log_schema() -> serde_json::Value {
    json!({
        "title": "foxglove.Log",
        "description": "what happened",
        "type": "object",
        "properties": {
            "timestamp": {
                "type": "object", "title": "time",
                "properties": { "sec": { "type": "integer" }, "nsec": { "type": "integer" } }
            },
            "level": { "type": "integer", "description": "2 note, 3 warning, 4 fault" },
            "message": { "type": "string" },
            "name": { "type": "string", "description": "to what it happened" },
            "file": { "type": "string" },
            "line": { "type": "integer" },
            "kind": { "type": "string", "description": "what kind of thing: fault, state, stimulus, .." }
        }
    })
}
