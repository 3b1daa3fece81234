//! Scenarios and sweeps of them: what `ferrodrive run` does, for Python.
//!
//! A run is made without the interpreter's lock, so that threads run beside it. The result crosses the border as the
//! JSON that `ferrodrive run --json` prints; `ferrodrive/scenario.py` makes values of it.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;
use scenario::sweep;
use scenario::sweep::results::{self, RunResult};
use scenario::{Outcome, Runner, Scenario};
use words::document::BadFile;
use words::document::reader::Parameters;

use crate::failure::{bad_value, named};

/// Steps of a world between two looks at Python's signal handlers (Ctrl-C): some 10 ms.
const STEPS_A_LOOK: u32 = 4096;

/// A parameter and its value, in the words that it is put into the file's texts with.
type Setting = (String, String);

/// Runs the scenario of a file to its end; returns what `ferrodrive run --json` prints.
#[pyfunction]
pub(crate) fn run_scenario(py: Python<'_>, path: PathBuf, seed: Option<u64>, set: Vec<Setting>) -> PyResult<String> {
    let scenario = read(&path, set)?;
    let begin = || Runner::new(&scenario, seed).map_err(|bad| bad.named(path.display().to_string()));
    let outcome = made(py, begin)?.map_err(bad_value)?;
    serde_json::to_string(&outcome.to_json()).map_err(bad_value)
}

/// A scenario with seeds and values of its parameters; `ferrodrive.Sweep` is what users have.
#[pyclass(frozen, module = "ferrodrive._native")]
pub(crate) struct Sweep {
    file: PathBuf,
    sweep: sweep::Sweep,
    alike: sweep::Alike,
}

/// What came of the runs of a sweep so far.
#[pyclass(frozen, module = "ferrodrive._native")]
pub(crate) struct Summary {
    sweep: Py<Sweep>,
    summary: Mutex<sweep::Summary>,
}

#[pymethods]
impl Sweep {
    /// Every seed from `first` to `last` with every value of the file's `[sweep]`.
    #[new]
    fn new(path: PathBuf, first: u64, last: u64, set: Vec<Setting>) -> PyResult<Self> {
        let scenario = read(&path, set)?;
        let sweep = sweep::Sweep::new(scenario, first..=last).map_err(bad_value)?;
        Ok(Self { file: path, sweep, alike: sweep::Alike::default() })
    }

    /// How many runs it has.
    #[getter]
    fn runs(&self) -> u64 {
        self.sweep.runs()
    }

    /// Seed and values of the run of this number.
    fn point(&self, number: u64) -> PyResult<(u64, Vec<Setting>)> {
        self.check(number)?;
        let point = self.sweep.point(number);
        Ok((point.seed, point.values.into_iter().collect()))
    }

    /// Makes the run of this number; returns what `ferrodrive run --json` prints.
    fn run(&self, py: Python<'_>, number: u64) -> PyResult<String> {
        self.check(number)?;
        let outcome = self.made(py, number)?.map_err(bad_value)?;
        serde_json::to_string(&outcome.to_json()).map_err(bad_value)
    }

    /// The first line of a file of results.
    fn head(&self) -> String {
        results::head(&self.sweep, self.sweep.shard())
    }

    /// Makes the run of this number; returns its line in a file of results.
    fn line(&self, py: Python<'_>, number: u64) -> PyResult<String> {
        self.check(number)?;
        let outcome = self.made(py, number)?;
        Ok(RunResult::new(&self.sweep, number, &outcome).to_line())
    }
}

impl Sweep {
    /// The outcome of a run, or why it cannot be made; it is not repeated where nothing in it is random.
    fn made(&self, py: Python<'_>, number: u64) -> PyResult<Result<Outcome, BadFile>> {
        if let Some(known) = self.alike.of(&self.sweep, number) {
            return Ok(Ok(known));
        }
        let outcome = made(py, || self.sweep.runner(number))?;
        if let Ok(outcome) = &outcome {
            self.alike.keep(&self.sweep, number, outcome);
        }
        Ok(outcome)
    }

    fn check(&self, number: u64) -> PyResult<()> {
        if number < self.sweep.runs() {
            return Ok(());
        }
        Err(PyIndexError::new_err(format!(
            "the sweep has no run {number}; its runs are 0 to {}",
            self.sweep.runs() - 1
        )))
    }
}

#[pymethods]
impl Summary {
    #[new]
    fn new(sweep: Py<Sweep>) -> Self {
        Self { sweep, summary: Mutex::default() }
    }

    /// Adds what came of a run: its figures, and of a failed one what was asked first that was not so, and what was seen. The
    /// digest of a run that was made.
    #[pyo3(signature = (number, figures, failure, digest=None))]
    fn add(
        &self,
        number: u64,
        figures: Vec<(String, f64)>,
        failure: Option<(String, String)>,
        digest: Option<u64>,
    ) -> PyResult<()> {
        let sweep = self.sweep.get();
        sweep.check(number)?;
        let figures = figures.iter().map(|(name, value)| (name.as_str(), *value));
        let mut summary = self.summary.lock().unwrap_or_else(PoisonError::into_inner);
        summary.add_run(&sweep.sweep, number, figures, failure);
        if let Some(digest) = digest {
            summary.add_digest(&sweep.sweep, number, digest);
        }
        Ok(())
    }

    /// Adds what came of a run, by its line in a file of results.
    fn add_line(&self, line: &str) -> PyResult<()> {
        let sweep = self.sweep.get();
        let result: RunResult = serde_json::from_str(line).map_err(bad_value)?;
        sweep.check(result.run)?;
        if !result.is_of(&sweep.sweep) {
            let (run, seed) = (result.run, result.seed);
            return Err(bad_value(format!("it is the result of run {run}, seed {seed}, of another sweep")));
        }
        self.summary.lock().unwrap_or_else(PoisonError::into_inner).add(&sweep.sweep, &result);
        Ok(())
    }

    /// What `ferrodrive run --seeds --json` prints of these runs.
    fn report(&self) -> PyResult<String> {
        let sweep = self.sweep.get();
        let summary = self.summary.lock().unwrap_or_else(PoisonError::into_inner);
        serde_json::to_string(&sweep::SweepReport::new(&sweep.file, &sweep.sweep, &summary)).map_err(bad_value)
    }
}

/// The scenario of a file, with these values of its parameters.
fn read(path: &Path, set: Vec<Setting>) -> PyResult<Scenario> {
    let scenario = Scenario::read(path).map_err(|reason| bad_value(named(path, reason)))?;
    if set.is_empty() {
        return Ok(scenario);
    }
    let values: Parameters = set.into_iter().collect();
    scenario.with(&values).map_err(|bad| bad_value(bad.named(path.display().to_string())))
}

/// Goes through a run while other threads of Python go on; a signal whose handler raises (Ctrl-C) ends it. The inner error is that
/// it cannot begin.
fn made(
    py: Python<'_>,
    begin: impl Fn() -> Result<Runner, BadFile> + Send + Sync,
) -> PyResult<Result<Outcome, BadFile>> {
    py.detach(|| {
        let mut runner = match begin() {
            Ok(runner) => runner,
            Err(bad) => return Ok(Err(bad)),
        };
        let mut steps = 0u32;
        while runner.step() {
            steps = steps.wrapping_add(1);
            if steps.is_multiple_of(STEPS_A_LOOK) {
                Python::attach(|py| py.check_signals())?;
            }
        }
        Ok(Ok(runner.conclude()))
    })
}
