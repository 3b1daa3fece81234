//! The results of a sweep as a file: JSON lines, a head and then a line for each run in the order of their numbers.
//!
//! A file that was cut anywhere is the beginning of the whole one, so that a sweep goes on where it ended ([`Reader`] says how much of
//! it is whole). The parts that were made apart ([`Shard`]) give the same file as one process, to the byte ([`merge`]).

mod merge;
mod reader;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::io;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::{Shard, Sweep};
use crate::Outcome;
use words::document::BadFile;

pub use merge::{MergeError, merge};
pub use reader::Reader;

/// What the first field of a head says: what the file is, and the edition of its form.
const FORM: &str = "ferrodrive sweep 1";

/// The result of one run: a line of the file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunResult {
    /// Its number in the sweep.
    pub run: u64,
    /// What decided everything random.
    pub seed: u64,
    /// The values of the parameters that are swept.
    pub values: BTreeMap<String, Cell>,
    /// Everything was as asked.
    pub passed: bool,
    /// When it ended, in s of virtual time; `None` if its values make no sense together.
    pub end_s: Option<f64>,
    /// The named figures; `None` where there was nothing to measure.
    pub figures: BTreeMap<String, Option<f64>>,
    /// Hash over all frames and shaft angles, in hexadecimal.
    pub digest: Option<String>,
    /// Of a run that failed: what was asked first that was not so.
    pub asked: Option<String>,
    /// What was seen then.
    pub seen: Option<String>,
}

/// A value of a parameter that is swept: a number where all of its values are numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Cell {
    /// A number.
    Number(f64),
    /// A text, as the file has it.
    Text(String),
}

/// Why a file of results cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ResultsError {
    /// It cannot be read.
    #[error(transparent)]
    Read(#[from] io::Error),
    /// A line is not what is expected there.
    #[error("line {line}: {what}")]
    Line {
        /// The line, from 1 on.
        line: u64,
        /// What is wrong there.
        what: String,
        /// What to do.
        next: String,
    },
}

impl RunResult {
    /// What came of the run of this number.
    pub fn new(sweep: &Sweep, number: u64, outcome: &Result<Outcome, BadFile>) -> Self {
        let (seed, values) = key(sweep, number);
        let of_none = sweep.scenario.figure_names().map(|name| (name.to_owned(), None));
        let mut result = Self {
            run: number,
            seed,
            values,
            passed: false,
            end_s: None,
            figures: of_none.collect(),
            digest: None,
            asked: None,
            seen: None,
        };
        match outcome {
            Ok(outcome) => {
                result.passed = outcome.passed();
                result.end_s = Some(outcome.end.as_nanos() as f64 / 1e9);
                let figures = outcome.figures.iter();
                result.figures =
                    figures.map(|(name, value)| (name.clone(), value.is_finite().then_some(*value))).collect();
                result.digest = Some(format!("{:016x}", outcome.digest));
                let first = outcome.failures().next();
                (result.asked, result.seen) = first.map(|row| (row.asked.clone(), row.seen.clone())).unzip();
            }
            Err(bad) => {
                result.asked = Some("the machine and the scenario".into());
                result.seen = Some(bad.to_string());
            }
        }
        result
    }

    /// Whether it is of the run of its number in this sweep, by seed and values.
    pub fn is_of(&self, sweep: &Sweep) -> bool {
        let is_key = |(seed, values)| (self.seed, &self.values) == (seed, &values);
        self.run < sweep.runs && is_key(key(sweep, self.run))
    }

    /// Its line, with the line end.
    pub fn to_line(&self) -> String {
        line(self)
    }
}

/// Numbers, texts and maps of texts always become JSON.
fn line(value: &impl Serialize) -> String {
    serde_json::to_string(value).unwrap_or_default() + "\n"
}

/// What distinguishes a run from the others.
fn key(sweep: &Sweep, number: u64) -> (u64, BTreeMap<String, Cell>) {
    let point = sweep.point(number);
    let cell = |(name, value): (String, String)| {
        let number = sweep.numeric.contains(&name).then(|| value.parse().ok()).flatten();
        (name, number.map_or(Cell::Text(value), Cell::Number))
    };
    (point.seed, point.values.into_iter().map(cell).collect())
}

/// The first line of the file, with its line end: which sweep it is of, and the columns with their types in Arrow's words.
pub fn head(sweep: &Sweep, shard: Shard) -> String {
    line(&head_fields(sweep, shard))
}

fn head_fields(sweep: &Sweep, shard: Shard) -> Value {
    let scenario = &sweep.scenario;
    let fixed = scenario.parameters.iter().filter(|(name, _)| sweep.axes.iter().all(|axis| axis.name != **name));
    serde_json::json!({
        "form": FORM,
        "version": env!("CARGO_PKG_VERSION"),
        "title": scenario.title,
        "scenario": format!("{:016x}", scenario.text_digest()),
        "seeds": [sweep.seeds.start(), sweep.seeds.end()],
        "parameters": fixed.collect::<BTreeMap<_, _>>(),
        "fidelity": scenario.fidelity.map(|fidelity| fidelity.to_string()),
        "runs": sweep.runs,
        "shard": shard.to_string(),
        "columns": columns(sweep),
    })
}

/// The columns in their order, each with its type.
fn columns(sweep: &Sweep) -> Vec<(String, &'static str)> {
    let numeric = |name: &str| if sweep.numeric.contains(name) { "double" } else { "string" };
    let mut values: Vec<_> =
        sweep.axes.iter().map(|axis| (format!("values.{}", axis.name), numeric(&axis.name))).collect();
    values.sort();
    let mut figures: Vec<_> = sweep.scenario.figure_names().map(|name| (format!("figures.{name}"), "double")).collect();
    figures.sort();
    let fixed = |columns: &[(&str, &'static str)]| -> Vec<_> {
        columns.iter().map(|(name, kind)| ((*name).to_owned(), *kind)).collect()
    };
    [
        fixed(&[("run", "uint64"), ("seed", "uint64")]),
        values,
        fixed(&[("passed", "bool"), ("end_s", "double")]),
        figures,
        fixed(&[("digest", "string"), ("asked", "string"), ("seen", "string")]),
    ]
    .concat()
}
