//! What came of a run, for people and programs.

use serde::Serialize;

/// What came of a case.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// As the standard says.
    Pass,
    /// Not as the standard says.
    Fail,
    /// Not as the standard says, and the maker's manual states it.
    Expected,
    /// The case says nothing about this device.
    NotApplicable,
    /// It takes an option that was not given: to move a motor, or to store parameters.
    NotRun,
}

impl Outcome {
    /// As a table shows it.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::Fail => "fail",
            Self::Expected => "expected",
            Self::NotApplicable => "not applicable",
            Self::NotRun => "not run",
        }
    }
}

/// What came of one case.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct CaseResult {
    /// The case's number.
    pub id: &'static str,
    /// What was asked.
    pub title: &'static str,
    /// Where the standard says what is expected.
    pub clause: &'static str,
    /// What came of it.
    pub result: Outcome,
    /// What was seen, or why the case does not apply.
    pub why: String,
    /// Frames that show it, in candump form and in their order; the last ones where there were many.
    pub frames: Vec<String>,
}

/// How many cases ended how.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Summary {
    /// As the standard says.
    pub pass: usize,
    /// Not as the standard says.
    pub fail: usize,
    /// Not as the standard says, as the manual states.
    pub expected: usize,
    /// Nothing was said.
    pub not_applicable: usize,
    /// Nothing was asked, since an option was not given.
    pub not_run: usize,
}

/// What came of a run.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Report {
    /// No case failed, and everything was put back.
    pub ok: bool,
    /// The node-ID.
    pub node: u8,
    /// The model, or the file's name of the device.
    pub model: String,
    /// Where what was expected is from: a manual or a file.
    pub source: String,
    /// The device's numbers: 1000h, then 1018h:01 to :04, as far as it has them.
    pub identity: Vec<u32>,
    /// A case each.
    pub cases: Vec<CaseResult>,
    /// How many ended how.
    pub summary: Summary,
    /// Objects that do not have again what they had.
    pub not_restored: Vec<String>,
}

impl Report {
    /// The cases that failed.
    pub fn failures(&self) -> impl Iterator<Item = &CaseResult> {
        self.cases.iter().filter(|case| case.result == Outcome::Fail)
    }

    pub(crate) fn of(cases: &[CaseResult]) -> Summary {
        let count = |outcome| cases.iter().filter(|case| case.result == outcome).count();
        Summary {
            pass: count(Outcome::Pass),
            fail: count(Outcome::Fail),
            expected: count(Outcome::Expected),
            not_applicable: count(Outcome::NotApplicable),
            not_run: count(Outcome::NotRun),
        }
    }
}
