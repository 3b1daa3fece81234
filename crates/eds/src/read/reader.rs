//! What has been read so far, and how findings are put down.

use std::collections::HashMap;
use std::collections::hash_map::Entry::{Occupied, Vacant};

use super::places::{self, Info, ObjectSection, SectionPlace};

use crate::Rule;
use crate::document::{Document, Entry, LineKind, Section};
use crate::{Eds, Finding, Findings, Refusal};

/// What has been read so far.
#[derive(Default)]
pub(super) struct Reader {
    pub(super) eds: Eds,
    pub(super) findings: Findings,
    /// Sections about the file and the device, and their lines.
    infos: Vec<(Info, u32)>,
    pub(super) variables: usize,
    pub(super) repeated: usize,
    /// Where `CompactPDO` stands.
    pub(super) compact_pdo_line: u32,
}

impl Reader {
    /// Lines that are nothing, and lines that belong to no section.
    pub(super) fn strays(&mut self, document: &Document) -> Result<(), Refusal> {
        let Some(first) = document.sections().next() else {
            let next = "an EDS begins with [FileInfo] and [DeviceInfo]: is this the right file?";
            return Err(Refusal::new(0, "the file has no sections", next));
        };
        for (line, kind, text) in document.lines() {
            let what = match kind {
                LineKind::Stray => "the line is not a section, a key=value or a comment",
                LineKind::Entry { .. } if line < first.line() => "a value before the first section",
                _ => continue,
            };
            self.findings.push(Finding {
                line,
                section: String::new(),
                key: None,
                rule: Rule::Stray,
                what: format!("{what}: {:?}", shortened(text.trim())),
                taken_instead: Some("nothing".into()),
            });
        }
        Ok(())
    }

    /// Reads a section, or puts it aside for its object.
    pub(super) fn section<'a>(&mut self, section: Section<'a>, parts: &mut Vec<ObjectSection<'a>>) {
        if !section.is_well_formed() {
            let what = "the heading is not [name] and nothing else";
            self.found_in(Rule::Heading, section, what, format!("[{}]", section.name()));
        }
        match places::place(section.name()) {
            SectionPlace::Part(key) => parts.push(ObjectSection { key, section }),
            SectionPlace::List => {}
            SectionPlace::Info(which) => match self.infos.iter().find(|(other, _)| *other == which) {
                Some((_, first)) => self.section_twice(section, *first),
                None => {
                    self.infos.push((which, section.line()));
                    self.info(which, section);
                }
            },
            SectionPlace::Module | SectionPlace::Unknown => self.keep(section),
        }
    }

    /// The entries of a section; of two lines of one key the first.
    pub(super) fn entries<'a>(&mut self, section: Section<'a>) -> Vec<Entry<'a>> {
        let mut seen = HashMap::new();
        let mut kept = Vec::new();
        for entry in section.entries() {
            match seen.entry(entry.key.to_ascii_lowercase()) {
                Vacant(place) => {
                    place.insert(entry);
                    kept.push(entry);
                }
                Occupied(first) => self.key_twice(section, entry, *first.get()),
            }
        }
        kept
    }

    pub(super) fn key_twice(&mut self, section: Section<'_>, entry: Entry<'_>, first: Entry<'_>) {
        let what = format!("the key stands twice, first in line {}", first.line);
        self.found(Rule::KeyTwice, section, entry, what, shortened(first.value));
    }

    /// A section of which one stands in `first` already.
    pub(super) fn section_twice(&mut self, section: Section<'_>, first: u32) {
        let taken = format!("the one in line {first}");
        self.found_in(Rule::SectionTwice, section, "two sections of this name", taken);
    }

    /// At an entry.
    pub(super) fn found(
        &mut self,
        rule: Rule,
        section: Section<'_>,
        entry: Entry<'_>,
        what: impl Into<String>,
        taken: impl Into<Taken>,
    ) {
        let key = Some(shortened(entry.key));
        self.push((entry.line, section.name(), key), rule, what.into(), taken.into().0);
    }

    /// At the heading of a section.
    pub(super) fn found_in(
        &mut self,
        rule: Rule,
        section: Section<'_>,
        what: impl Into<String>,
        taken: impl Into<Taken>,
    ) {
        self.push((section.line(), section.name(), None), rule, what.into(), taken.into().0);
    }

    /// At a line, a section and a key.
    pub(super) fn push(
        &mut self,
        (line, section, key): (u32, &str, Option<String>),
        rule: Rule,
        what: String,
        taken_instead: Option<String>,
    ) {
        self.findings.push(Finding { line, section: shortened(section), key, rule, what, taken_instead });
    }
}

/// What is taken instead of what was found.
pub(super) struct Taken(Option<String>);

/// Nothing else: the value is taken as it stands.
pub(super) const AS_IT_STANDS: Taken = Taken(None);

impl From<&str> for Taken {
    fn from(taken: &str) -> Self {
        Self(Some(taken.to_owned()))
    }
}

impl From<String> for Taken {
    fn from(taken: String) -> Self {
        Self(Some(taken))
    }
}

/// Text of a file as it is shown in a finding.
pub(super) fn shortened(text: &str) -> String {
    const MOST: usize = 40;
    if text.chars().count() <= MOST { text.to_owned() } else { text.chars().take(MOST).chain("...".chars()).collect() }
}
