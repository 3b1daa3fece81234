//! One step: what was asked, what answered, what moved, what should have been seen and what was.

use serde::Serialize;

use super::expect::Expect;

/// One step: what was asked, what answered, what moved, what should have been seen and what was.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Row {
    /// The part of it: a drive, or what the drives do together.
    pub drive: &'static str,
    /// The manual's section.
    pub section: String,
    /// What is done.
    pub step: String,
    /// The frame sent, in candump form or as the eight bytes to the drive's SDO server.
    pub asked: String,
    /// The frame that answered.
    pub answered: String,
    /// What the shaft did.
    pub moved: String,
    /// Everything that was compared.
    pub checks: Vec<Check>,
    /// Whether all of it agrees.
    pub ok: bool,
}

/// One comparison.
#[derive(Clone, Debug, Serialize)]
pub struct Check {
    /// What the manual or a closed form lets expect.
    pub expected: String,
    /// What was seen.
    pub seen: String,
    /// Whether they agree.
    pub ok: bool,
}

impl Row {
    /// A row that nothing is known against yet.
    pub(crate) fn new(section: impl Into<String>, step: impl Into<String>) -> Self {
        Self { section: section.into(), step: step.into(), ok: true, ..Self::default() }
    }

    /// Adds an expectation and what was seen.
    pub(crate) fn expect(&mut self, what: &str, expect: Expect, unit: &str, seen: f64) {
        self.compare(format!("{what} {}", expect.text(unit)), expect.seen(seen, unit), expect.is_met(seen));
    }

    /// Adds an expectation in words.
    pub(crate) fn compare(&mut self, expected: impl AsRef<str>, seen: impl Into<String>, ok: bool) {
        self.checks.push(Check { expected: expected.as_ref().trim().into(), seen: seen.into(), ok });
        self.ok &= ok;
    }
}
