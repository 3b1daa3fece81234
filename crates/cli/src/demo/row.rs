//! One step of the demo: what was asked, what answered, what moved, what should have been seen and what was.

use serde::Serialize;

use super::expect::Expect;

/// See the [module](self).
#[derive(Clone, Debug, Default, Serialize)]
pub(super) struct Row {
    /// The part of the demo: a drive, or what the drives do together.
    pub(super) drive: &'static str,
    /// The manual's section.
    pub(super) section: &'static str,
    /// What is done.
    pub(super) step: String,
    /// The frame sent, in candump form or as the eight bytes to the drive's SDO server.
    pub(super) asked: String,
    /// The frame that answered.
    pub(super) answered: String,
    /// What the shaft did.
    pub(super) moved: String,
    /// Everything that was compared.
    pub(super) checks: Vec<Check>,
    /// Whether all of it agrees.
    pub(super) ok: bool,
}

/// One comparison.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Check {
    /// What the manual or a closed form lets expect.
    pub(super) expected: String,
    /// What was seen.
    pub(super) seen: String,
    /// Whether they agree.
    pub(super) ok: bool,
}

impl Row {
    /// A row that nothing is known against yet.
    pub(super) fn new(section: &'static str, step: impl Into<String>) -> Self {
        Self { section, step: step.into(), ok: true, ..Self::default() }
    }

    /// Adds an expectation and what was seen.
    pub(super) fn expect(&mut self, what: &str, expect: Expect, unit: &str, seen: f64) {
        self.compare(format!("{what} {}", expect.text(unit)), expect.seen(seen, unit), expect.is_met(seen));
    }

    /// Adds an expectation in words.
    pub(super) fn compare(&mut self, expected: impl AsRef<str>, seen: impl Into<String>, ok: bool) {
        self.checks.push(Check { expected: expected.as_ref().trim().into(), seen: seen.into(), ok });
        self.ok &= ok;
    }
}
