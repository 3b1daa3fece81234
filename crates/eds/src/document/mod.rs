//! The file as it stands: lines, sections and keys, nothing interpreted.
//!
//! A [`Document`] keeps every byte, so that a file that is read and written is the same file, and a value that is
//! rewritten changes its own line only. Source: CiA 306-1, clause 4.2 (sections, keys, comments that begin with a
//! semicolon).

mod bounds;
mod edit;
mod encoding;

pub use bounds::Bounds;
pub use edit::EditError;
pub use encoding::Encoding;

use crate::Refusal;

/// What a line is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LineKind {
    /// Nothing but blanks.
    Blank,
    /// A remark: begins with `;` (or `#`, which some tools write).
    Comment,
    /// `[name]`.
    Section,
    /// `key=value`; the place of the `=` in the document's text.
    Entry {
        /// Byte offset of the `=`.
        equals: u32,
    },
    /// None of these.
    Stray,
}

/// A line, without its end.
#[derive(Clone, Copy, Debug)]
struct LineSpan {
    start: u32,
    end: u32,
    kind: LineKind,
}

#[derive(Clone, Copy, Debug)]
struct SectionLines {
    /// Place of the name in the text.
    name: (u32, u32),
    /// The line with the name, from 0.
    heading: u32,
    /// The line after its last.
    end: u32,
}

/// A file, line by line. See the [module](self).
#[derive(Clone, Debug)]
pub struct Document {
    text: String,
    encoding: Encoding,
    lines: Vec<LineSpan>,
    sections: Vec<SectionLines>,
}

/// One section of a [`Document`].
#[derive(Clone, Copy, Debug)]
pub struct Section<'a> {
    document: &'a Document,
    lines: SectionLines,
}

/// A `key=value` line, both without the blanks around them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Entry<'a> {
    /// The line, from 1.
    pub line: u32,
    /// Before the `=`.
    pub key: &'a str,
    /// After it.
    pub value: &'a str,
}

impl Document {
    /// Reads a file's bytes: UTF-8, with or without a byte order mark, else Latin-1.
    ///
    /// # Errors
    /// Refused is what is larger than the [`Bounds`], and text of 16-bit characters.
    pub fn parse(bytes: &[u8]) -> Result<Self, Refusal> {
        Self::parse_within(bytes, Bounds::DEFAULT)
    }

    /// As [`parse`](Self::parse), with bounds of one's own.
    ///
    /// # Errors
    /// As [`parse`](Self::parse).
    pub fn parse_within(bytes: &[u8], bounds: Bounds) -> Result<Self, Refusal> {
        bounds.check_size(bytes.len())?;
        let (encoding, text) = encoding::decode(bytes)?;
        // Latin-1 letters may have grown to two bytes each.
        bounds.check_size(text.len() / 2)?;
        let mut document = Self { text, encoding, lines: Vec::new(), sections: Vec::new() };
        document.index(bounds)?;
        Ok(document)
    }

    /// The bytes of the file: those it was read from, but for what was changed since.
    pub fn to_bytes(&self) -> Vec<u8> {
        encoding::encode(self.encoding, &self.text)
    }

    /// The text, without a byte order mark.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// How letters beyond ASCII are coded.
    pub const fn encoding(&self) -> Encoding {
        self.encoding
    }

    /// How many lines there are.
    pub fn line_count(&self) -> usize {
        self.lines.len()
    }

    /// All lines, in order: number from 1, kind, text without its end.
    pub fn lines(&self) -> impl Iterator<Item = (u32, LineKind, &str)> {
        let numbered = self.lines.iter().zip(1..);
        numbered.map(|(line, number)| (number, line.kind, &self.text[line.start as usize..line.end as usize]))
    }

    /// All sections, in order. Two of the same name are two sections.
    pub fn sections(&self) -> impl Iterator<Item = Section<'_>> {
        self.sections.iter().map(|lines| Section { document: self, lines: *lines })
    }

    /// The first section of a name, in any case of letters.
    pub fn section(&self, name: &str) -> Option<Section<'_>> {
        self.sections().find(|section| section.name().eq_ignore_ascii_case(name))
    }

    /// The value of a key, the first of that name in the first section of that name.
    pub fn value(&self, section: &str, key: &str) -> Option<&str> {
        self.section(section)?.entry(key).map(|entry| entry.value)
    }

    /// Finds lines and sections in the text.
    fn index(&mut self, bounds: Bounds) -> Result<(), Refusal> {
        let text = self.text.as_str();
        let mut lines = Vec::with_capacity(text.len() / 12 + 1);
        let mut sections: Vec<SectionLines> = Vec::with_capacity(text.len() / 64 + 1);
        let mut start = 0;
        // Files of old Macintoshes end lines with CR alone.
        let end_of_line = if text.contains('\n') { '\n' } else { '\r' };
        while start < text.len() {
            let stop = text[start..].find(end_of_line).map_or(text.len(), |length| start + length);
            let line = &text[start..stop];
            let line = line.trim_end_matches('\r');
            let number = lines.len() + 1;
            bounds.check_line(number, line)?;
            let kind = kind_of(line, start);
            if kind == LineKind::Section {
                if let Some(last) = sections.last_mut() {
                    last.end = lines.len() as u32;
                }
                let name = section_name(line, start);
                sections.push(SectionLines { name, heading: lines.len() as u32, end: 0 });
                bounds.check_sections(number, sections.len())?;
            }
            lines.push(LineSpan { start: start as u32, end: (start + line.len()) as u32, kind });
            start = stop + 1;
        }
        if let Some(last) = sections.last_mut() {
            last.end = lines.len() as u32;
        }
        (self.lines, self.sections) = (lines, sections);
        Ok(())
    }
}

impl<'a> Section<'a> {
    /// Its name, without the blanks around it.
    pub fn name(self) -> &'a str {
        &self.document.text[self.lines.name.0 as usize..self.lines.name.1 as usize]
    }

    /// The line with its name, from 1.
    pub const fn line(self) -> u32 {
        self.lines.heading + 1
    }

    /// True if its heading is `[name]` and nothing else.
    pub fn is_well_formed(self) -> bool {
        let line = self.document.lines[self.lines.heading as usize];
        let heading = self.document.text[line.start as usize..line.end as usize].trim();
        heading.len() == self.name().len() + 2 && heading.ends_with(']')
    }

    /// Its entries, in order.
    pub fn entries(self) -> impl Iterator<Item = Entry<'a>> {
        let text = self.document.text.as_str();
        let range = self.lines.heading as usize + 1..self.lines.end as usize;
        let numbered = self.document.lines[range].iter().zip(self.lines.heading + 2..);
        numbered.filter_map(move |(line, number)| {
            let LineKind::Entry { equals } = line.kind else { return None };
            let key = text[line.start as usize..equals as usize].trim();
            let value = text[equals as usize + 1..line.end as usize].trim();
            Some(Entry { line: number, key, value })
        })
    }

    /// The first entry of a key, in any case of letters.
    pub fn entry(self, key: &str) -> Option<Entry<'a>> {
        self.entries().find(|entry| entry.key.eq_ignore_ascii_case(key))
    }
}

fn kind_of(line: &str, start: usize) -> LineKind {
    let trimmed = line.trim_start();
    match trimmed.as_bytes().first() {
        None => LineKind::Blank,
        Some(b';' | b'#') => LineKind::Comment,
        Some(b'[') => LineKind::Section,
        Some(_) => match line.bytes().position(|byte| byte == b'=') {
            Some(at) => LineKind::Entry { equals: (start + at) as u32 },
            None => LineKind::Stray,
        },
    }
}

/// Where the name stands between the brackets; a missing one of the two is found by [`Section::is_well_formed`].
fn section_name(line: &str, start: usize) -> (u32, u32) {
    let open = line.len() - line.trim_start().len() + 1;
    let inside = &line[open..];
    let inside = &inside[..inside.find(']').unwrap_or(inside.len())];
    let leading = inside.len() - inside.trim_start().len();
    let from = start + open + leading;
    (from as u32, (from + inside.trim().len()) as u32)
}

#[cfg(test)]
mod tests;
