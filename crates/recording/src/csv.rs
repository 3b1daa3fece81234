//! A record as CSV (RFC 4180).

use std::fmt::Write as _;
use std::io::{self, BufWriter, Write};

use can::Instant;

use super::column::Column;
use super::piece::{Mark, Target};

/// A CSV file that is being written.
pub(super) struct Csv {
    file: BufWriter<Box<dyn Target>>,
    width: usize,
    /// What happened since the last line, and when the last of it.
    marks: String,
    marked_at: Instant,
    line: String,
}

impl Csv {
    pub(super) fn begin(target: Box<dyn Target>, columns: &[Column]) -> io::Result<Self> {
        let mut file = BufWriter::new(target);
        let mut header = String::from("t_s");
        for column in columns {
            header.push(',');
            header.push_str(&quoted(&column.name()));
        }
        header.push_str(",mark\n");
        file.write_all(header.as_bytes())?;
        Ok(Self { file, width: columns.len(), marks: String::new(), marked_at: Instant::ZERO, line: String::new() })
    }

    pub(super) fn row(&mut self, at: Instant, values: &[f64]) -> io::Result<()> {
        self.line.clear();
        let _ = write!(self.line, "{at}");
        for value in values {
            self.line.push(',');
            if value.is_finite() {
                // The shortest text that reads back as the same number.
                let _ = write!(self.line, "{value}");
            }
        }
        self.line.push(',');
        self.line.push_str(&quoted(&self.marks));
        self.line.push('\n');
        self.marks.clear();
        self.file.write_all(self.line.as_bytes())
    }

    pub(super) fn mark(&mut self, mark: &Mark) -> io::Result<()> {
        /// A line without values.
        const LONGEST: usize = 4096;
        if self.marks.len() > LONGEST {
            self.write_marks()?;
        }
        if !self.marks.is_empty() {
            self.marks.push_str("; ");
        }
        // One line of the file is one line of text.
        self.marks.push_str(&mark.line().replace(['\n', '\r'], " "));
        self.marked_at = mark.at;
        Ok(())
    }

    pub(super) fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }

    pub(super) fn finish(mut self) -> io::Result<()> {
        if !self.marks.is_empty() {
            self.write_marks()?;
        }
        self.file.flush()
    }

    /// A line for marks alone: no sample follows them.
    fn write_marks(&mut self) -> io::Result<()> {
        let nothing = vec![f64::NAN; self.width];
        self.row(self.marked_at, &nothing)
    }
}

/// A field, quoted where RFC 4180 asks for it.
fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}
