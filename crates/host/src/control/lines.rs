//! Lines of bytes that come in pieces, read with a bound.

/// Longest request in bytes: many times a subscription to every signal of a bus.
pub const MAX_LINE_LENGTH: usize = 64 * 1024;

/// Input that is not a whole line yet.
#[derive(Clone, Debug, Default)]
pub struct LineBuffer {
    bytes: Vec<u8>,
    /// The rest of a line that is too long is discarded.
    skipping: bool,
}

/// A line that has ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ReadLine {
    /// Its text without its end; bytes that are not UTF-8 are replaced.
    Text(String),
    /// Longer than [`MAX_LINE_LENGTH`]; it was not kept.
    TooLong,
}

impl LineBuffer {
    /// Takes bytes in and hands each line that they end to `each`. What has no end yet waits; it is never handed out as a line, so
    /// that a connection that breaks does not leave half a request behind.
    pub fn take(&mut self, mut bytes: &[u8], mut each: impl FnMut(ReadLine)) {
        while let Some(end) = bytes.iter().position(|byte| *byte == b'\n') {
            self.keep(&bytes[..end]);
            each(self.finish());
            bytes = &bytes[end + 1..];
        }
        self.keep(bytes);
    }

    fn keep(&mut self, bytes: &[u8]) {
        if self.bytes.len() + bytes.len() > MAX_LINE_LENGTH {
            self.skipping = true;
            self.bytes = Vec::new();
        }
        if !self.skipping {
            self.bytes.extend_from_slice(bytes);
        }
    }

    fn finish(&mut self) -> ReadLine {
        if std::mem::take(&mut self.skipping) {
            return ReadLine::TooLong;
        }
        let text = String::from_utf8_lossy(&self.bytes).trim_end_matches('\r').to_owned();
        self.bytes.clear();
        ReadLine::Text(text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(pieces: &[&[u8]]) -> Vec<ReadLine> {
        let (mut buffer, mut lines) = (LineBuffer::default(), Vec::new());
        pieces.iter().for_each(|piece| buffer.take(piece, |line| lines.push(line)));
        lines
    }

    #[test]
    fn lines_come_whole_wherever_the_pieces_end_and_half_a_line_does_not_come() {
        let text = |text: &str| ReadLine::Text(text.to_owned());
        assert_eq!(lines(&[b"no", b"w\r\n\n4 g", b"et\n4 power of"]), [text("now"), text(""), text("4 get")]);
        assert_eq!(lines(&[b"\xFF\n"]), [text("\u{FFFD}")]);
    }

    #[test]
    fn a_line_without_end_costs_no_memory_and_the_next_one_comes() {
        let (mut buffer, mut lines) = (LineBuffer::default(), Vec::new());
        for _ in 0..1000 {
            buffer.take(&[b'x'; 4096], |line| lines.push(line));
            assert!(buffer.bytes.capacity() <= 2 * MAX_LINE_LENGTH);
        }
        buffer.take(b"\nnow\n", |line| lines.push(line));
        assert_eq!(lines, [ReadLine::TooLong, ReadLine::Text("now".to_owned())]);
    }
}
