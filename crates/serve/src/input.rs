//! Lines of standard input, read with a bound.

use std::io::{self, BufRead};

use sim::command::MAX_LINE_LENGTH;

/// The next line without its end; `None` at the end of input. Of a line that is too long only so much is kept that
/// the caller sees that it is: the rest is skipped without being stored.
pub(crate) fn next_line(input: &mut impl BufRead) -> io::Result<Option<String>> {
    let mut line = Vec::new();
    let mut any = false;
    loop {
        let chunk = match input.fill_buf() {
            Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
            chunk => chunk?,
        };
        any |= !chunk.is_empty();
        let end = chunk.iter().position(|byte| *byte == b'\n');
        let piece = &chunk[..end.unwrap_or(chunk.len())];
        line.extend_from_slice(&piece[..piece.len().min(MAX_LINE_LENGTH + 1 - line.len())]);
        let used = end.map_or(chunk.len(), |end| end + 1);
        let over = used == 0 || end.is_some();
        input.consume(used);
        if over {
            return Ok(any.then(|| String::from_utf8_lossy(&line).into_owned()));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{BufReader, Read};

    fn lines(capacity: usize, input: impl Read) -> Vec<String> {
        let mut input = BufReader::with_capacity(capacity, input);
        std::iter::from_fn(|| next_line(&mut input).expect("memory does not fail")).collect()
    }

    #[test]
    fn lines_come_whole_wherever_the_buffer_ends() {
        assert_eq!(lines(7, &b"now\n\n4 get position\nlast"[..]), ["now", "", "4 get position", "last"]);
        assert_eq!(lines(7, &b""[..]), [""; 0]);
        assert_eq!(lines(7, &b"\xFF\n"[..]), ["\u{FFFD}"]);
    }

    #[test]
    fn an_endless_line_costs_no_memory_and_the_next_one_comes() {
        let endless = io::repeat(b'x').take(100_000_000).chain(&b"\nnow\n"[..]);
        let got = lines(1 << 16, endless);
        assert_eq!((got.len(), got[0].len(), got[1].as_str()), (2, MAX_LINE_LENGTH + 1, "now"));
    }
}
