//! What has been read so far, and how findings are put down.

use super::places::{self, ObjectSection, SectionPlace};

use crate::Rule;
use crate::document::{Document, Entry, LineKind, Section};
use crate::{Eds, Finding, Findings, Refusal, Severity};

/// What has been read so far.
#[derive(Default)]
pub(super) struct Reader {
    pub(super) eds: Eds,
    pub(super) findings: Findings,
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
                severity: Severity::Warning,
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
            self.warn_section(Rule::Heading, section, what, Some(format!("[{}]", section.name())));
        }
        match places::place(section.name()) {
            SectionPlace::Part(key) => parts.push(ObjectSection { key, section }),
            SectionPlace::List => {}
            SectionPlace::Info(which) => self.info(which, section),
            SectionPlace::Module | SectionPlace::Unknown => self.keep(section),
        }
    }

    /// At an entry, or where there is none at a line of a section.
    pub(super) fn find(
        &mut self,
        rule: Rule,
        severity: Severity,
        (section, entry, line): (&str, Option<Entry<'_>>, u32),
        what: String,
        taken: Option<String>,
    ) {
        self.findings.push(Finding {
            line: entry.map_or(line, |entry| entry.line),
            section: shortened(section),
            key: entry.map(|entry| shortened(entry.key)),
            rule,
            severity,
            what,
            taken_instead: taken,
        });
    }

    pub(super) fn warn(
        &mut self,
        rule: Rule,
        section: Section<'_>,
        entry: Entry<'_>,
        what: impl Into<String>,
        taken: Option<String>,
    ) {
        self.find(rule, Severity::Warning, (section.name(), Some(entry), 0), what.into(), taken);
    }

    pub(super) fn error(
        &mut self,
        rule: Rule,
        section: Section<'_>,
        entry: Entry<'_>,
        what: impl Into<String>,
        taken: impl Into<String>,
    ) {
        self.find(rule, Severity::Error, (section.name(), Some(entry), 0), what.into(), Some(taken.into()));
    }

    pub(super) fn warn_section(
        &mut self,
        rule: Rule,
        section: Section<'_>,
        what: impl Into<String>,
        taken: Option<String>,
    ) {
        self.find(rule, Severity::Warning, (section.name(), None, section.line()), what.into(), taken);
    }

    pub(super) fn error_section(
        &mut self,
        rule: Rule,
        section: Section<'_>,
        what: impl Into<String>,
        taken: impl Into<String>,
    ) {
        self.find(rule, Severity::Error, (section.name(), None, section.line()), what.into(), Some(taken.into()));
    }
}

/// Text of a file as it is shown in a finding.
pub(super) fn shortened(text: &str) -> String {
    const MOST: usize = 40;
    if text.chars().count() <= MOST { text.to_owned() } else { text.chars().take(MOST).chain("...".chars()).collect() }
}
