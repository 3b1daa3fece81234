//! Log files line by line: a reader that says which line is wrong, and a writer.

use std::io::{self, BufRead, Read, Write};

use can::{Frame, Instant};

use super::record::{ParseRecordError, emit_line, parse_line};
use crate::text;

/// Longest line that is read, in bytes; candump's own stay below 120.
const MAX_LINE_LENGTH: u64 = 1024;

/// Why a log cannot be read on.
#[derive(Debug, thiserror::Error)]
pub enum LogError {
    /// The file itself.
    #[error("reading line {line}")]
    Io {
        /// Counted from 1.
        line: usize,
        /// What the system said.
        source: io::Error,
    },
    /// A line that is no frame.
    #[error("line {line}, '{text}'")]
    Line {
        /// Counted from 1.
        line: usize,
        /// The line, shortened.
        text: String,
        /// What is wrong with it.
        source: ParseRecordError,
    },
}

/// Reads a candump log.
#[derive(Debug)]
pub struct LogReader<R> {
    input: R,
    line: usize,
    buffer: Vec<u8>,
    last: Instant,
}

impl<R: BufRead> LogReader<R> {
    /// A reader over `input`.
    pub fn new(input: R) -> Self {
        Self { input, line: 0, buffer: Vec::new(), last: Instant::ZERO }
    }

    /// The time stamp of the frame read last; zero before the first.
    pub fn last_time(&self) -> Instant {
        self.last
    }

    /// The next frame with its time stamp (that of the frame before, where the line has none); `None` at the end.
    ///
    /// After an error the next call goes on with the next line.
    pub fn next_frame(&mut self) -> Result<Option<(Instant, Frame)>, LogError> {
        loop {
            self.line += 1;
            self.buffer.clear();
            let mut limited = (&mut self.input).take(MAX_LINE_LENGTH);
            let read = limited.read_until(b'\n', &mut self.buffer);
            if read.map_err(|source| LogError::Io { line: self.line, source })? == 0 {
                return Ok(None);
            }
            if !self.buffer.ends_with(b"\n") {
                // What is beyond the longest line belongs to this one.
                self.input.skip_until(b'\n').map_err(|source| LogError::Io { line: self.line, source })?;
            }
            let text = String::from_utf8_lossy(&self.buffer);
            let record = parse_line(&text).map_err(|source| LogError::Line {
                line: self.line,
                text: text::shown(&text),
                source,
            })?;
            if let Some(record) = record {
                self.last = record.at.unwrap_or(self.last);
                return Ok(Some((self.last, record.frame)));
            }
        }
    }
}

/// Writes a candump log.
#[derive(Debug)]
pub struct LogWriter<W> {
    output: W,
    interface: String,
    buffer: Vec<u8>,
}

impl<W: Write> LogWriter<W> {
    /// A writer that names `interface` on every line.
    pub fn new(output: W, interface: impl Into<String>) -> Self {
        Self { output, interface: interface.into(), buffer: Vec::new() }
    }

    /// Writes one line. `at` is what the log shall say, usually Unix time.
    pub fn write(&mut self, at: Instant, frame: &Frame) -> io::Result<()> {
        self.buffer.clear();
        emit_line(at, &self.interface, frame, &mut self.buffer);
        self.output.write_all(&self.buffer)
    }

    /// Passes everything written on to the system.
    pub fn flush(&mut self) -> io::Result<()> {
        self.output.flush()
    }
}

#[cfg(test)]
mod tests {
    use std::error::Error;

    use super::*;

    #[test]
    fn an_error_names_its_line_and_reading_goes_on() {
        let log = "(1.0) can0 701#00\n\n(1.5) can0 701#0\n can0  702  [1]  05\n(1.7) can0 703#";
        let mut reader = LogReader::new(log.as_bytes());
        assert_eq!(reader.next_frame().unwrap(), Some((Instant::from_secs(1), "701#00".parse().unwrap())));
        let error = reader.next_frame().unwrap_err();
        assert_eq!(error.to_string(), "line 3, '(1.5) can0 701#0'");
        assert!(error.source().unwrap().to_string().contains("pairs of hexadecimal digits"));
        assert_eq!(reader.next_frame().unwrap(), Some((Instant::from_secs(1), "702#05".parse().unwrap())));
        assert_eq!(reader.next_frame().unwrap(), Some((Instant::from_millis(1700), "703#".parse().unwrap())));
        assert!(reader.next_frame().unwrap().is_none());
    }

    #[test]
    fn a_line_that_is_too_long_is_one_line() {
        let log = format!("(1.0) can0 701#{}\n(1.5) can0 702#05\n", "0".repeat(5000));
        let mut reader = LogReader::new(log.as_bytes());
        assert!(matches!(reader.next_frame(), Err(LogError::Line { line: 1, .. })));
        assert_eq!(reader.next_frame().unwrap(), Some((Instant::from_millis(1500), "702#05".parse().unwrap())));
        assert!(reader.next_frame().unwrap().is_none());
    }

    #[test]
    fn a_file_without_line_feeds_is_not_read_into_memory() {
        let mut reader = LogReader::new(io::repeat(b'x').take(1 << 20).into_buf());
        assert!(matches!(reader.next_frame(), Err(LogError::Line { line: 1, .. })));
        assert!(reader.buffer.capacity() <= 4 * MAX_LINE_LENGTH as usize);
    }

    trait IntoBuf: Read + Sized {
        fn into_buf(self) -> io::BufReader<Self> {
            io::BufReader::new(self)
        }
    }
    impl<R: Read> IntoBuf for R {}

    #[test]
    fn the_writer_writes_the_log_form() {
        let mut writer = LogWriter::new(Vec::new(), "can0");
        writer.write(Instant::from_micros(1_700_000_000_123_456), &"604#40".parse().unwrap()).unwrap();
        writer.write(Instant::from_millis(1500), &"123#R4".parse().unwrap()).unwrap();
        assert_eq!(writer.output, b"(1700000000.123456) can0 604#40\n(0000000001.500000) can0 123#R4\n");
    }
}
