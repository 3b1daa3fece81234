//! The result of a sweep, as `ferrodrive run --seeds --json` prints it and Python hands it out.

use std::path::Path;

use serde::Serialize;

use super::{Distribution, Failed, OfValue, Shard, Summary, Sweep};

/// The result of a sweep.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SweepReport {
    /// No run failed.
    pub ok: bool,
    /// The scenario's title.
    pub title: String,
    /// Its file.
    pub file: String,
    /// Which part of the sweep it is of; `None` if of all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shard: Option<String>,
    /// How many runs it has: the sweep, or this part.
    pub runs: u64,
    /// Runs that passed.
    pub passed: u64,
    /// Runs that did not.
    pub failed: u64,
    /// All runs were made.
    pub complete: bool,
    /// The results of the runs with each value of each parameter that is swept.
    pub values: Vec<OfValue>,
    /// How each named figure is distributed.
    pub figures: Vec<Distribution>,
    /// The first failed runs, one of each setting of the parameters before a second of any.
    pub worst: Vec<Worst>,
    /// Whether runs that differ in their seeds alone differ; `None` if there are no two such runs.
    pub seeds_differ: Option<bool>,
    /// Where they do not: why, and what would make them.
    pub note: Option<String>,
}

/// A failed run, and the command that repeats it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Worst {
    /// What failed.
    #[serde(flatten)]
    pub failed: Failed,
    /// The command.
    pub again: String,
}

impl SweepReport {
    /// The report of the runs that were added to `summary` so far; `file` is what the commands in it name.
    pub fn new(file: &Path, sweep: &Sweep, summary: &Summary) -> Self {
        let (passed, failed) = (summary.passed(), summary.failures());
        let again = |failed: &Failed| format!("ferrodrive run {} {}", file.display(), failed.point.options());
        Self {
            ok: failed == 0,
            title: sweep.title().to_owned(),
            file: file.display().to_string(),
            shard: (sweep.shard() != Shard::WHOLE).then(|| sweep.shard().to_string()),
            runs: sweep.share(),
            passed,
            failed,
            complete: passed + failed == sweep.share(),
            values: summary.of_values(sweep),
            figures: summary.distributions(sweep),
            seeds_differ: summary.seeds_differ(),
            note: summary.note(sweep),
            worst: summary.failed().map(|failed| Worst { failed: failed.clone(), again: again(failed) }).collect(),
        }
    }
}
