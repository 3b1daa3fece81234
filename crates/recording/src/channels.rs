//! The channels of a record and their messages: one list for the file and for those who watch while it is written.
//!
//! Messages are CDR with schemas as ROS 2 writes them (`ros2msg`), which Foxglove, Lichtblick, PlotJuggler and Rerun read; it is
//! the only form that PlotJuggler takes over a socket. Signals are `float64`, not a number where there is no value.

use can::{Frame, Instant};

use super::cdr::Encoder;
use super::column::{Column, Subject};
use super::piece::{Entry, Mark, Severity};

/// Topic of the frames.
pub(super) const FRAMES: &str = "/can";
/// Topic of what happened.
pub(super) const EVENTS: &str = "/events";

/// Messages of all channels are written so.
pub const MESSAGE_ENCODING: &str = "cdr";
/// Schemas of all channels are written so.
pub const SCHEMA_ENCODING: &str = "ros2msg";

/// What stands between the name of a signal that its field cannot have and what is before it in the comment of the field.
pub(super) const NAMED: &str = "; named ";

/// What a reader needs to know of the messages of a topic.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Channel {
    /// `/node/4`, `/node/5/2`, `/body/base`, `/can`, `/events`.
    pub topic: String,
    /// As ROS 2 writes it: `ferrodrive_msgs/msg/Node4`.
    pub schema_name: String,
    /// A line for each field, in [`SCHEMA_ENCODING`].
    pub schema: String,
}

/// Where messages go: a file, or those who watch.
pub trait Sink {
    /// Why it takes no more.
    type Error;

    /// A message of the channel at this place of [`Channels::list`].
    ///
    /// # Errors
    /// It is not taken.
    fn message(&mut self, channel: usize, at: Instant, data: &[u8]) -> Result<(), Self::Error>;
}

/// The channels, and the form of their messages.
pub struct Channels {
    list: Vec<Channel>,
    subjects: Vec<SubjectSignals>,
    /// Columns that have a channel.
    width: usize,
    /// Values are not rounded.
    is_exact: bool,
    data: Encoder,
}

/// The signals of one subject.
struct SubjectSignals {
    subject: Subject,
    channel: usize,
    /// Place in a row, and how many of its binary digits after the point are kept.
    fields: Vec<(usize, Option<u8>)>,
}

/// Places of the two that each record has, in the list.
const FRAMES_PLACE: usize = 0;
const EVENTS_PLACE: usize = 1;

impl Channels {
    /// A channel for the frames, one for what happened, and one for each subject of these columns. Simulated values are rounded.
    pub fn of(columns: &[Column]) -> Self {
        Self::begun(columns, false)
    }

    /// As [`of`](Self::of), of values that keep every digit: what was measured.
    pub fn exact(columns: &[Column]) -> Self {
        Self::begun(columns, true)
    }

    fn begun(columns: &[Column], is_exact: bool) -> Self {
        let list = vec![
            Channel { topic: FRAMES.into(), schema_name: "can_msgs/msg/Frame".into(), schema: frame_schema() },
            // The name and the fields of a line of a log, as Foxglove knows them, and what kind of thing it is.
            Channel { topic: EVENTS.into(), schema_name: "foxglove_msgs/msg/Log".into(), schema: log_schema() },
        ];
        let mut channels = Self { list, subjects: Vec::new(), width: 0, is_exact, data: Encoder::default() };
        channels.add(columns);
        channels
    }

    /// Adds columns at the end of a row, whose subjects have no channel yet.
    pub fn add(&mut self, columns: &[Column]) {
        let mut subjects: Vec<&Subject> = Vec::new();
        for column in columns {
            if !subjects.contains(&&column.subject) {
                subjects.push(&column.subject);
            }
        }
        for subject in subjects {
            let of_it = columns.iter().enumerate().filter(|(_, column)| column.subject == *subject);
            let (places, of_it): (Vec<usize>, Vec<&Column>) = of_it.unzip();
            let bits = of_it.iter().map(|column| column.kept_bits().filter(|_| !self.is_exact));
            let fields = places.iter().map(|place| self.width + place).zip(bits).collect();
            self.subjects.push(SubjectSignals { subject: subject.clone(), channel: self.list.len(), fields });
            let mut channel = channel_of(subject, &of_it);
            // Of "left arm" and "left-arm" the second is "BodyLeftArm2": readers keep the first of a name.
            let is_taken = |name: &String| self.list.iter().any(|other| other.schema_name == *name);
            let numbered = (2..).map(|number| format!("{}{number}", channel.schema_name));
            let free = std::iter::once(channel.schema_name.clone()).chain(numbered).find(|name| !is_taken(name));
            channel.schema_name = free.unwrap_or_default();
            self.list.push(channel);
        }
        self.width += columns.len();
    }

    /// All of them; an identifier is a place in this list.
    pub fn list(&self) -> &[Channel] {
        &self.list
    }

    /// Whether there is a channel for this subject.
    pub fn has(&self, subject: &Subject) -> bool {
        self.subjects.iter().any(|signals| signals.subject == *subject)
    }

    /// The messages of an entry; a subject of which the row has no value has none.
    ///
    /// # Errors
    /// What the sink says.
    pub fn encode<S: Sink>(&mut self, entry: Entry<'_>, sink: &mut S) -> Result<(), S::Error> {
        match entry {
            Entry::Row(at, values) => self.row(at, values, sink),
            Entry::Frame(at, frame) => {
                put_frame(self.data.begin(), at, frame);
                sink.message(FRAMES_PLACE, at, self.data.bytes())
            }
            Entry::Mark(mark) => {
                put_mark(self.data.begin(), mark);
                sink.message(EVENTS_PLACE, mark.at, self.data.bytes())
            }
        }
    }

    fn row<S: Sink>(&mut self, at: Instant, values: &[f64], sink: &mut S) -> Result<(), S::Error> {
        let value = |place: usize| values.get(place).copied().filter(|value| value.is_finite());
        for SubjectSignals { channel, fields, .. } in &self.subjects {
            if fields.iter().all(|(place, _)| value(*place).is_none()) {
                continue;
            }
            let data = self.data.begin();
            for (place, bits) in fields {
                data.f64(value(*place).map_or(f64::NAN, |value| kept(value, *bits)));
            }
            sink.message(*channel, at, self.data.bytes())?;
        }
        Ok(())
    }
}

/// The nearest number with so many binary digits after the point: what is finer says nothing, and is most of what would be stored.
fn kept(value: f64, bits: Option<u8>) -> f64 {
    let Some(bits) = bits else { return value };
    let steps = f64::from(1_u32 << bits);
    let rounded = (value * steps).round() / steps;
    if rounded.is_finite() { rounded } else { value }
}

/// As `can_msgs/msg/Frame` of ROS 2 has it, at the end of its last bit.
fn put_frame(data: &mut Encoder, at: Instant, frame: &Frame) {
    put_time(data, at);
    data.text("").u32(frame.id().raw());
    // None is an error frame.
    data.u8(frame.is_remote().into()).u8(frame.id().is_extended().into()).u8(0).u8(frame.dlc());
    let bytes = frame.data().iter().copied().chain(std::iter::repeat(0));
    for byte in bytes.take(8) {
        data.u8(byte);
    }
}

fn put_mark(data: &mut Encoder, mark: &Mark) {
    // Levels of foxglove.Log: 2 is INFO, 3 WARNING, 4 ERROR.
    let level = match mark.severity {
        Severity::Note => 2,
        Severity::Warning => 3,
        Severity::Fault => 4,
    };
    put_time(data, mark.at);
    // Neither a file nor a line of it.
    data.u8(level).text(&mark.text).text(&mark.of).text("").u32(0).text(&mark.kind);
}

/// Seconds and nanoseconds.
fn put_time(data: &mut Encoder, at: Instant) {
    let nanos = at.as_nanos();
    data.u32((nanos / 1_000_000_000) as u32).u32((nanos % 1_000_000_000) as u32);
}

/// The channel of the signals of one subject.
fn channel_of(subject: &Subject, columns: &[&Column]) -> Channel {
    let mut names: Vec<String> = Vec::new();
    let mut schema = String::new();
    for column in columns {
        let mut name = field_name(&column.signal);
        while names.contains(&name) {
            name.push('_');
        }
        let mut comment = column.unit.to_string();
        if name != column.signal {
            comment.push_str(NAMED);
            comment.push_str(&column.signal);
        }
        let comment = comment.replace(|letter: char| letter.is_control(), " ");
        let comment = if comment.is_empty() { comment } else { format!("  # {comment}") };
        schema.push_str(&format!("float64 {name}{comment}\n"));
        names.push(name);
    }
    let words = subject.title().replace(|letter: char| !letter.is_ascii_alphanumeric(), " ");
    let type_name: String = words.split_whitespace().map(capitalised).collect();
    let prefix = if matches!(subject, Subject::Body(_)) { "Body" } else { "" };
    Channel { topic: subject.topic(), schema_name: format!("ferrodrive_msgs/msg/{prefix}{type_name}"), schema }
}

/// The signal's name, with what the name of a field may be made of: letters, digits and `_`, a letter first.
fn field_name(signal: &str) -> String {
    let name = signal.replace(|letter: char| !letter.is_ascii_alphanumeric(), "_");
    if name.starts_with(|letter: char| letter.is_ascii_alphabetic()) { name } else { format!("signal_{name}") }
}

fn capitalised(word: &str) -> String {
    let (first, rest) = word.split_at(1);
    first.to_ascii_uppercase() + rest
}

/// The schema of a type, and those of the types that it is made of.
fn with_types(own: &str, types: &[(&str, &str)]) -> String {
    let others = types.iter().map(|(name, fields)| format!("{}\nMSG: {name}\n{fields}", "=".repeat(80)));
    std::iter::once(own.to_owned()).chain(others).collect()
}

const TIME: (&str, &str) = ("builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n");

fn frame_schema() -> String {
    let own =
        "std_msgs/Header header\nuint32 id\nbool is_rtr\nbool is_extended\nbool is_error\nuint8 dlc\nuint8[8] data\n";
    with_types(own, &[("std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id\n"), TIME])
}

fn log_schema() -> String {
    let own = "builtin_interfaces/Time timestamp\n\
        uint8 level  # 2 note, 3 warning, 4 fault\n\
        string message\n\
        string name  # to what it happened\n\
        string file\n\
        uint32 line\n\
        string kind  # what kind of thing: fault, state, stimulus, ..\n";
    with_types(own, &[TIME])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_have_names_that_readers_take_and_types_one_for_each_subject() {
        let names = [
            "4.606C_00",
            "4.velocity rpm",
            "4.velocity_rpm",
            "5.2.current_a",
            "left arm.x_m",
            "left-arm.x_m",
            "left_arm.x_m",
        ];
        let columns: Vec<Column> = names.iter().map(|name| name.parse().expect("a column")).collect();
        let channels = Channels::of(&columns);
        let found: Vec<(&str, &str, &str)> = channels.list()[2..]
            .iter()
            .map(|channel| (&*channel.topic, &*channel.schema_name, &*channel.schema))
            .collect();
        let of_4 = "float64 signal_606C_00  # ; named 606C_00\n\
                    float64 velocity_rpm  # ; named velocity rpm\n\
                    float64 velocity_rpm_  # r/min; named velocity_rpm\n";
        assert_eq!(
            found,
            [
                ("/node/4", "ferrodrive_msgs/msg/Node4", of_4),
                ("/node/5/2", "ferrodrive_msgs/msg/Node5Axis2", "float64 current_a  # A\n"),
                ("/body/left arm", "ferrodrive_msgs/msg/BodyLeftArm", "float64 x_m  # m\n"),
                ("/body/left-arm", "ferrodrive_msgs/msg/BodyLeftArm2", "float64 x_m  # m\n"),
                ("/body/left_arm", "ferrodrive_msgs/msg/BodyLeftArm3", "float64 x_m  # m\n"),
            ]
        );
    }

    #[test]
    fn what_is_kept_of_a_number_is_the_nearest_step() {
        assert_eq!(kept(48.0 + 0.4 / 128.0, Some(7)), 48.0);
        assert_eq!(kept(-1.0 - 0.6 / 128.0, Some(7)), -1.0 - 1.0 / 128.0);
        assert_eq!((kept(0.1, None), kept(f64::MAX, Some(20))), (0.1, f64::MAX));
    }
}
