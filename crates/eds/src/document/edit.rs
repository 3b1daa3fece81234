use std::fmt;

use super::{Document, LineKind, LineSpan};
use crate::document::Bounds;

/// Why a value cannot be written into a document.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum EditError {
    /// No section of this name.
    NoSection(String),
    /// A value is one line: this one has a line end or another control character in it.
    NotOneLine,
    /// The file's encoding has no such letter.
    Letter(char),
    /// The line or the file would grow beyond the bounds.
    TooLong,
}

impl fmt::Display for EditError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoSection(name) => write!(f, "the file has no section [{name}]"),
            Self::NotOneLine => write!(f, "a value of an EDS is one line without control characters"),
            Self::Letter(letter) => write!(f, "the file's encoding has no letter {letter:?}"),
            Self::TooLong => write!(f, "the line or the file would be longer than is read"),
        }
    }
}

impl std::error::Error for EditError {}

impl Document {
    /// Writes a value: in the line of the key if the section has it, else in a new line after the section's last entry.
    /// No other line changes; blanks around `=` and the line end stay as they are.
    ///
    /// # Errors
    /// If there is no such section, or the value does not fit into one line of this file.
    pub fn set(&mut self, section: &str, key: &str, value: &str) -> Result<(), EditError> {
        self.check(key)?;
        self.check(value)?;
        let found = self.section(section).ok_or_else(|| EditError::NoSection(section.to_owned()))?;
        let (heading, end) = (found.lines.heading as usize, found.lines.end as usize);
        match found.entry(key) {
            Some(entry) => self.rewrite(entry.line as usize - 1, value),
            None => {
                let entries = (heading..end).rev().find(|at| matches!(self.lines[*at].kind, LineKind::Entry { .. }));
                self.insert_after(entries.unwrap_or(heading), key, value)
            }
        }
    }

    /// Adds an empty section at the end of the file, behind an empty line.
    ///
    /// # Errors
    /// If the name does not fit into one line of this file.
    pub fn add_section(&mut self, name: &str) -> Result<(), EditError> {
        self.check(name)?;
        let line_end = self.line_end();
        let mut text = self.text.clone();
        if !text.is_empty() {
            if !text.ends_with(['\n', '\r']) {
                text.push_str(line_end);
            }
            text.push_str(line_end);
        }
        text.push('[');
        text.push_str(name);
        text.push(']');
        text.push_str(line_end);
        self.replace_text(text)
    }

    fn check(&self, text: &str) -> Result<(), EditError> {
        if text.chars().any(char::is_control) {
            return Err(EditError::NotOneLine);
        }
        if text.len() > Bounds::DEFAULT.line_bytes / 2 {
            return Err(EditError::TooLong);
        }
        // An ASCII file may become one of UTF-8.
        let foreign = |letter: &char| !self.encoding.has(*letter) && self.encoding != super::Encoding::Ascii;
        text.chars().find(foreign).map_or(Ok(()), |letter| Err(EditError::Letter(letter)))
    }

    fn rewrite(&mut self, at: usize, value: &str) -> Result<(), EditError> {
        let line = self.lines[at];
        let LineKind::Entry { equals } = line.kind else { return Ok(()) };
        let after = equals as usize + 1;
        let old = &self.text[after..line.end as usize];
        let from = after + old.len() - old.trim_start().len();
        let to = if old.trim().is_empty() { line.end as usize } else { from + old.trim().len() };
        self.note_letters(value);
        self.text.replace_range(from..to, value);
        let grown = value.len() as i64 - (to - from) as i64;
        let moved = |offset: &mut u32| *offset = (i64::from(*offset) + grown) as u32;
        moved(&mut self.lines[at].end);
        for LineSpan { start, end, kind } in &mut self.lines[at + 1..] {
            moved(start);
            moved(end);
            if let LineKind::Entry { equals } = kind {
                moved(equals);
            }
        }
        for section in self.sections.iter_mut().filter(|section| section.heading as usize > at) {
            moved(&mut section.name.0);
            moved(&mut section.name.1);
        }
        Ok(())
    }

    fn insert_after(&mut self, at: usize, key: &str, value: &str) -> Result<(), EditError> {
        let end = self.lines[at].end as usize;
        let mut text = self.text.clone();
        text.insert_str(end, &format!("{}{key}={value}", self.line_end()));
        self.replace_text(text)
    }

    fn replace_text(&mut self, text: String) -> Result<(), EditError> {
        self.note_letters(&text);
        let mut changed = Self { text, encoding: self.encoding, lines: Vec::new(), sections: Vec::new() };
        changed.index(Bounds::DEFAULT).map_err(|_| EditError::TooLong)?;
        *self = changed;
        Ok(())
    }

    /// An ASCII file that gets a letter beyond it is UTF-8 from then on.
    fn note_letters(&mut self, text: &str) {
        if self.encoding == super::Encoding::Ascii && !text.is_ascii() {
            self.encoding = super::Encoding::Utf8;
        }
    }

    /// How this file ends its lines.
    fn line_end(&self) -> &'static str {
        match self.text.find(['\r', '\n']) {
            Some(at) if self.text[at..].starts_with("\r\n") => "\r\n",
            Some(at) if self.text[at..].starts_with('\r') && !self.text.contains('\n') => "\r",
            _ => "\n",
        }
    }
}
