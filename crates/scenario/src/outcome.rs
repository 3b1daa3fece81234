//! The outcome of a scenario: a row for each step, line and expectation, the named figures, and a digest that
//! distinguishes the run.

use can::Instant;
use serde::Serialize;

/// The result of one run.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// The scenario's title.
    pub title: String,
    /// What decided everything random.
    pub seed: u64,
    /// The parameters and their values in this run.
    pub parameters: Vec<(String, String)>,
    /// When it ended, in virtual time.
    pub end: Instant,
    /// What was asked and seen, in the order of time; what never came is last.
    pub rows: Vec<Row>,
    /// The named figures; not a number where there was nothing to measure.
    pub figures: Vec<(String, f64)>,
    /// Hash over all frames and shaft angles: equal for equal runs.
    pub digest: u64,
    /// Whether the seed may have decided anything. If not, every other seed gives the same run.
    pub is_random: bool,
    /// The last frames on the wire, in candump format, of a run that failed.
    pub last_frames: Vec<String>,
}

/// One thing that was asked, and what was seen.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// What it is.
    pub kind: RowKind,
    /// Its name, or that of its host.
    pub name: String,
    /// What was asked, in the words of the file.
    pub asked: String,
    /// When it was done or decided; `None` if that never came.
    pub at: Option<Instant>,
    /// What was seen.
    pub seen: String,
    /// Whether it is as asked.
    pub verdict: Verdict,
    /// The line of the file.
    pub place: usize,
}

/// What a row is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum RowKind {
    /// What the outer world does.
    Step,
    /// What a host does.
    Host,
    /// What is expected.
    Expect,
}

impl RowKind {
    /// In a word.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Step => "step",
            Self::Host => "host",
            Self::Expect => "expect",
        }
    }
}

/// Whether a row is as asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// It is.
    Passed,
    /// It is not.
    Failed,
    /// It was not reached, for something before it failed.
    Skipped,
}

impl Outcome {
    /// True if everything is as asked.
    pub fn passed(&self) -> bool {
        self.rows.iter().all(|row| row.verdict == Verdict::Passed)
    }

    /// The rows that are not as asked.
    pub fn failures(&self) -> impl Iterator<Item = &Row> {
        self.rows.iter().filter(|row| row.verdict != Verdict::Passed)
    }

    /// As `ferrodrive run --json` prints it.
    pub fn to_json(&self) -> OutcomeReport<'_> {
        OutcomeReport {
            ok: self.passed(),
            title: &self.title,
            seed: self.seed,
            parameters: self.parameters.iter().map(|(name, value)| (name.as_str(), value.as_str())).collect(),
            end_s: self.end.as_nanos() as f64 / 1e9,
            rows: self.rows.iter().map(RowReport::from).collect(),
            figures: self.figures.iter().map(|(name, value)| (name.as_str(), *value)).collect(),
            digest: format!("{:016x}", self.digest),
            last_frames: &self.last_frames,
        }
    }
}

/// An outcome in JSON.
#[derive(Debug, Serialize)]
pub struct OutcomeReport<'a> {
    ok: bool,
    title: &'a str,
    seed: u64,
    parameters: std::collections::BTreeMap<&'a str, &'a str>,
    end_s: f64,
    rows: Vec<RowReport<'a>>,
    figures: std::collections::BTreeMap<&'a str, f64>,
    digest: String,
    last_frames: &'a [String],
}

#[derive(Debug, Serialize)]
struct RowReport<'a> {
    kind: RowKind,
    name: &'a str,
    asked: &'a str,
    t: Option<f64>,
    seen: &'a str,
    verdict: Verdict,
    line: usize,
}

impl<'a> From<&'a Row> for RowReport<'a> {
    fn from(row: &'a Row) -> Self {
        let t = row.at.map(|at| at.as_nanos() as f64 / 1e9);
        Self {
            kind: row.kind,
            name: &row.name,
            asked: &row.asked,
            t,
            seen: &row.seen,
            verdict: row.verdict,
            line: row.place,
        }
    }
}
