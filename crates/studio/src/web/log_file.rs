//! The frames of a log that a page has chosen, in any form that `ferrodrive` reads, with their times.

use std::path::Path;

use can::{Frame, Instant};
use canlog::{Content, Entry, Format, LogReader, Record};

/// The form of a log, by its content or else by its name.
pub(super) fn format_of(name: &str, bytes: &[u8]) -> Option<Format> {
    let format = Format::of_content(bytes.get(..bytes.len().min(512)).unwrap_or_default());
    format.or_else(|| Format::of_name(Path::new(name)))
}

/// Reads it, with times from its first frame on; afterwards it has what was passed over.
pub(super) struct LogFile<'a> {
    log: LogReader<&'a [u8]>,
    first: Option<Instant>,
    passed_over: usize,
    without_time: usize,
    failed: Option<String>,
}

impl<'a> LogFile<'a> {
    pub(super) fn new(bytes: &'a [u8], format: Format) -> Self {
        let log = LogReader::new(bytes, format);
        Self { log, first: None, passed_over: 0, without_time: 0, failed: None }
    }

    /// What was not read of it; empty if everything was.
    pub(super) fn remark(self) -> String {
        let Self { passed_over, without_time, failed, .. } = self;
        let parts = [
            (passed_over > 0).then(|| format!("{passed_over} lines or parts are not frames and were passed over")),
            (without_time > 0).then(|| format!("{without_time} frames have no time")),
            failed,
        ];
        parts.into_iter().flatten().collect::<Vec<_>>().join("; ")
    }
}

impl Iterator for LogFile<'_> {
    type Item = (Instant, Frame);

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            match self.log.next()? {
                Ok(Entry::Record(Record { at: Some(at), content: Content::Frame(frame), .. })) => {
                    let first = *self.first.get_or_insert(at);
                    return Some((Instant::from_nanos(at.nanos_since(first)), frame));
                }
                Ok(Entry::Record(Record { at: None, .. })) => self.without_time += 1,
                Ok(Entry::Record(_)) => {}
                Ok(Entry::Finding(_)) => self.passed_over += 1,
                Err(error) => {
                    self.failed = Some(error.to_string());
                    return None;
                }
            }
        }
    }
}
