//! `--log` of a command: every frame that it sends and hears, with the time.
//!
//! A thread of its own writes what has come ten times a second, so that a command that is killed loses less than a second,
//! and a slow disk costs frames of the log, never time of the bus.

use std::fs::File;
use std::io;
use std::time::Duration;

use can::{BusFrame, Frame, Instant, Listen};
use canlog::{Content, Direction, Interface, LogWriter, Record};

use super::background::{Background, Output, Pace, WaitingRules};
use words::failure::Failure;

/// A log file that has just been begun.
pub type NewLog = LogWriter<io::BufWriter<File>>;

/// How long frames may wait in memory.
const INTERVAL: Duration = Duration::from_millis(100);

/// Frames that may wait for the disk: some 10 s of a full bus at 1 Mbit/s.
const MOST_WAITING: usize = 1 << 17;

/// A log under way; the clones write the same file. Without a file nothing is kept.
#[derive(Clone, Default)]
pub struct CommandLog(Option<Log>);

#[derive(Clone)]
struct Log {
    file: Background<Record>,
    interface: Interface,
    unix_zero: Duration,
}

/// The end of a log, which its owner waits for.
pub struct Writing(Option<Background<Record>>);

impl Output<Record> for NewLog {
    const FILE: &'static str = "the log";
    const PIECES: &'static str = "frames";

    fn write(&mut self, record: Record) -> io::Result<()> {
        Self::write(self, &record)
    }

    fn flush(&mut self) -> io::Result<()> {
        Self::flush(self)
    }

    fn end(self) -> io::Result<()> {
        self.finish().map(drop)
    }
}

impl CommandLog {
    /// Writes to `file` from now on. `unix_zero` is the Unix time of the bus's zero; a bus of virtual time waits for the
    /// disk. What goes wrong is reported at the end.
    pub fn start(file: Option<NewLog>, interface: Interface, unix_zero: Duration, pace: Pace) -> (Self, Writing) {
        let waiting = WaitingRules { pace, room: MOST_WAITING, gathers: INTERVAL };
        let file = file.map(|file| Background::start(file, waiting, None));
        (Self(file.clone().map(|file| Log { file, interface, unix_zero })), Writing(file))
    }

    /// Takes a frame that passed.
    pub fn frame(&self, frame: &Frame, now: Instant, direction: Direction) {
        self.take(Content::Frame(*frame), now, Some(direction));
    }

    /// Takes what was on the bus.
    pub fn take(&self, content: Content, now: Instant, direction: Option<Direction>) {
        let Some(Log { file, interface, unix_zero }) = &self.0 else { return };
        file.write(Record { at: Some(now + *unix_zero), interface: *interface, direction, content }, 1);
    }

    /// Takes a record of another log as it is.
    pub fn record(&self, record: &Record) {
        if let Some(log) = &self.0 {
            log.file.write(record.clone(), 1);
        }
    }
}

impl Writing {
    /// Waits until everything is written.
    ///
    /// # Errors
    /// The log is not whole.
    pub fn finish(self) -> Result<(), Failure> {
        self.0.map_or(Ok(()), |file| file.finish(Duration::MAX))
    }
}

impl Listen for CommandLog {
    fn hear(&mut self, BusFrame { at, frame, own }: BusFrame) {
        self.frame(&frame, at, if own { Direction::Transmitted } else { Direction::Received });
    }
}
