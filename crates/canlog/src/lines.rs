//! Lines of a text that another program wrote, of bounded length.

use std::io::{self, BufRead, Read};

/// Longest line that is read, in bytes; those of logs with classical frames stay below 200.
pub(super) const MAX_LINE_LENGTH: u64 = 1024;

/// What some editors and shells put before a text of UTF-8; no part of its first line.
pub(super) const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";

#[derive(Debug)]
pub(super) struct Lines<R> {
    input: R,
    number: u64,
    buffer: Vec<u8>,
}

impl<R: BufRead> Lines<R> {
    pub(super) fn new(input: R) -> Self {
        Self { input, number: 0, buffer: Vec::new() }
    }

    /// The next line and its number, counted from 1. What is beyond the longest line is left out.
    pub(super) fn next(&mut self) -> io::Result<Option<(u64, std::borrow::Cow<'_, str>)>> {
        self.number += 1;
        self.buffer.clear();
        let read = (&mut self.input).take(MAX_LINE_LENGTH).read_until(b'\n', &mut self.buffer)?;
        if read == 0 {
            return Ok(None);
        }
        if !self.buffer.ends_with(b"\n") && read as u64 == MAX_LINE_LENGTH {
            self.input.skip_until(b'\n')?;
        }
        if self.number == 1 && self.buffer.starts_with(BYTE_ORDER_MARK) {
            self.buffer.drain(..BYTE_ORDER_MARK.len());
        }
        Ok(Some((self.number, String::from_utf8_lossy(&self.buffer))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_that_is_too_long_is_one_line_and_is_cut() {
        let text = format!("a\n{}\nb", "0".repeat(5000));
        let mut lines = Lines::new(text.as_bytes());
        assert_eq!(lines.next().unwrap().unwrap(), (1, "a\n".into()));
        assert_eq!(lines.next().unwrap().unwrap().1.len() as u64, MAX_LINE_LENGTH);
        assert_eq!(lines.next().unwrap().unwrap(), (3, "b".into()));
        assert_eq!(lines.next().unwrap(), None);
    }

    #[test]
    fn a_byte_order_mark_is_passed_over_where_it_begins_the_text_and_nowhere_else() {
        let text = "\u{feff}(1.0) can0 123#\n\u{feff}x\n";
        let mut lines = Lines::new(text.as_bytes());
        assert_eq!(lines.next().unwrap().unwrap(), (1, "(1.0) can0 123#\n".into()));
        assert_eq!(lines.next().unwrap().unwrap(), (2, "\u{feff}x\n".into()));
    }

    #[test]
    fn a_file_without_line_feeds_is_not_read_into_memory() {
        let mut lines = Lines::new(io::BufReader::new(io::repeat(b'x').take(1 << 20)));
        assert!(lines.next().unwrap().is_some());
        assert!(lines.buffer.capacity() as u64 <= 4 * MAX_LINE_LENGTH);
        assert!(lines.next().unwrap().is_none());
    }
}
