//! What was found in a description of a bus.

use canopen::NodeId;
use serde::Serialize;

/// How bad it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// Good to know.
    Note,
    /// It starts, and goes wrong in a case that the text names.
    Warning,
    /// It does not start, or does something unwanted.
    Error,
}

impl Severity {
    /// In a word.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Note => "note",
            Self::Warning => "warning",
            Self::Error => "error",
        }
    }
}

/// A line and a column of a file, counted from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub struct Place {
    /// Which line.
    pub line: usize,
    /// Which letter of it.
    pub column: usize,
}

/// One thing that was found.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// How bad it is.
    pub severity: Severity,
    /// The rule behind it, by a name that stays.
    pub rule: &'static str,
    /// Where in the file.
    pub at: Place,
    /// The node that it is about.
    pub node: Option<u8>,
    /// What was found, and its consequence.
    pub what: String,
    /// What to do.
    pub next: String,
}

/// What was found, in the order of the file.
#[derive(Clone, Debug, Default)]
pub struct Findings(Vec<Finding>);

/// So many are kept: a file of a megabyte of nonsense has more than can be read.
const MOST: usize = 500;

impl Findings {
    /// Those that were found before, to be gone on with.
    pub(super) const fn of(found: Vec<Finding>) -> Self {
        Self(found)
    }

    /// Adds one.
    pub(super) fn push(&mut self, finding: Finding) {
        if self.0.len() < MOST {
            self.0.push(finding);
        }
    }

    /// All, by their places.
    pub fn into_sorted(mut self) -> Vec<Finding> {
        self.0.sort_by_key(|finding| (finding.at, std::cmp::Reverse(finding.severity)));
        self.0
    }
}

/// Adds what is found at one place, about one node.
pub(super) struct Reporter<'a> {
    pub(super) found: &'a mut Findings,
    pub(super) rule: &'static str,
    pub(super) node: Option<NodeId>,
}

impl Reporter<'_> {
    pub(super) fn say(&mut self, severity: Severity, at: Place, what: impl Into<String>, next: impl Into<String>) {
        let node = self.node.map(NodeId::raw);
        self.found.push(Finding { severity, rule: self.rule, at, node, what: what.into(), next: next.into() });
    }
}
