use crate::Refusal;

/// How large a file may be. Beyond it a file is refused before it costs memory or time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bounds {
    /// Bytes in the file.
    pub bytes: usize,
    /// Lines.
    pub lines: usize,
    /// Bytes in one line.
    pub line_bytes: usize,
    /// Sections.
    pub sections: usize,
}

impl Bounds {
    /// Twenty times the largest file that was seen of a maker, and still 64 MB of memory at most.
    pub const DEFAULT: Self = Self { bytes: 4 << 20, lines: 250_000, line_bytes: 4_096, sections: 40_000 };

    pub(super) fn check_size(self, bytes: usize) -> Result<(), Refusal> {
        if bytes <= self.bytes {
            return Ok(());
        }
        let reason = format!("the file has {bytes} bytes, more than the {} that are read", self.bytes);
        Err(Refusal::new(0, reason, "an EDS is a few hundred kilobytes at most: is this the right file?"))
    }

    pub(super) fn check_line(self, number: usize, line: &str) -> Result<(), Refusal> {
        if number > self.lines {
            let reason = format!("more than {} lines", self.lines);
            return Err(Refusal::new(number, reason, "an EDS has some ten thousand at most: is this the right file?"));
        }
        if line.len() > self.line_bytes {
            let reason = format!("the line has {} bytes, more than the {} that are read", line.len(), self.line_bytes);
            return Err(Refusal::new(number, reason, "CiA 306 allows 255 characters: shorten the line"));
        }
        Ok(())
    }

    pub(super) fn check_sections(self, number: usize, sections: usize) -> Result<(), Refusal> {
        if sections <= self.sections {
            return Ok(());
        }
        let reason = format!("more than {} sections", self.sections);
        Err(Refusal::new(number, reason, "an EDS has one for each object and sub-object: is this the right file?"))
    }
}

impl Default for Bounds {
    fn default() -> Self {
        Self::DEFAULT
    }
}
