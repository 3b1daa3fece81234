//! What is wrong with a file, with the line that it stands in.

use std::fmt;

use crate::{Rule, Severity};

/// One thing that is wrong with a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// The line, from 1; 0 for the file as a whole.
    pub line: u32,
    /// The section, as the file spells it; empty outside of any.
    pub section: String,
    /// The key, if one is meant.
    pub key: Option<String>,
    /// What is wrong with it, as a rule.
    pub rule: Rule,
    /// What is wrong.
    pub what: String,
    /// What was taken instead; `None` if the value was taken as it stands.
    pub taken_instead: Option<String>,
}

impl Finding {
    /// How bad it is.
    pub const fn severity(&self) -> Severity {
        self.rule.explanation().severity
    }
}

/// `12: [1018] SubNumber: error EDS204: ...; taken: ...`
impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.line > 0 {
            write!(f, "{}: ", self.line)?;
        }
        if !self.section.is_empty() {
            write!(f, "[{}] ", self.section)?;
        }
        if let Some(key) = &self.key {
            write!(f, "{key}: ")?;
        }
        write!(f, "{} {}: {}", self.severity().name(), self.rule.id(), self.what)?;
        self.taken_instead.as_ref().map_or(Ok(()), |taken| write!(f, "; taken: {taken}"))
    }
}

/// All that was found in one file, in the order of its lines.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Findings {
    list: Vec<Finding>,
    beyond: u32,
}

impl Findings {
    /// Most findings that are kept. A file with more of them is not an EDS, and further ones are of no use.
    pub const MOST: usize = 2_000;

    /// Adds one; beyond [`MOST`](Self::MOST) it is only counted.
    pub fn push(&mut self, finding: Finding) {
        if self.list.len() < Self::MOST {
            self.list.push(finding);
        } else {
            self.beyond += 1;
        }
    }

    /// The findings.
    pub fn iter(&self) -> std::slice::Iter<'_, Finding> {
        self.list.iter()
    }

    /// How many were counted and not kept.
    pub const fn beyond(&self) -> u32 {
        self.beyond
    }

    /// True if nothing is wrong.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// How many of this severity were kept.
    pub fn count(&self, severity: Severity) -> usize {
        self.list.iter().filter(|finding| finding.severity() == severity).count()
    }

    pub(crate) fn sort(&mut self) {
        self.list.sort_by_key(|finding| finding.line);
    }
}

impl<'a> IntoIterator for &'a Findings {
    type Item = &'a Finding;
    type IntoIter = std::slice::Iter<'a, Finding>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

/// Why a file is not read at all.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refusal {
    /// The line, from 1; 0 for the file as a whole.
    pub line: u32,
    /// What keeps it from being read, as a sentence.
    pub reason: String,
    /// What to do.
    pub next: String,
}

impl Refusal {
    pub(crate) fn new(line: usize, reason: impl Into<String>, next: impl Into<String>) -> Self {
        Self { line: u32::try_from(line).unwrap_or(u32::MAX), reason: reason.into(), next: next.into() }
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.line {
            0 => write!(f, "{}; {}", self.reason, self.next),
            line => write!(f, "line {line}: {}; {}", self.reason, self.next),
        }
    }
}

impl std::error::Error for Refusal {}
