//! Several scenarios in one call: a row for each, one file for a build server, one exit status.

use std::path::{Path, PathBuf};

use scenario::{Outcome, OutcomeReport, Runner, Scenario, Verdict, junit};
use serde::Serialize;
use sim::Fidelity;
use words::counted;

use super::crew::Crew;
use super::loaded::{Loaded, unbuildable, write};
use super::report::RunReport;
use crate::failure::{Failure, FailureBody};
use crate::output::{Format, Report};
use crate::progress::Progress;
use plot::Paint;
use plot::Table;

/// What came of one file; `None` while nothing has.
type Ended = Option<Result<Outcome, Failure>>;

/// Runs each of the files, `jobs` at once or as many as there are cores, and prints a row for each.
pub(super) fn run(
    files: &[PathBuf],
    seed: Option<u64>,
    (set, fidelity): (&[(String, String)], Option<Fidelity>),
    jobs: Option<u16>,
    junit_file: Option<&Path>,
    format: Format,
) -> Result<(), Failure> {
    let loaded: Vec<Result<Loaded<'_>, Failure>> = files.iter().map(|file| Loaded::read(file, set, fidelity)).collect();
    let nobodys = set.iter().find(|(name, _)| {
        let mut usable = loaded.iter().flatten();
        usable.all(|loaded| loaded.strange().any(|strange| strange == name))
    });
    if let Some((name, _)) = nobodys.filter(|_| loaded.iter().any(Result::is_ok)) {
        return Err(Failure::usage(format!("none of the {} scenarios has a parameter '{name}'", files.len()))
            .next("omit that --set; [parameters] of a scenario lists its parameters"));
    }
    let scenarios: Vec<Result<Scenario, Failure>> =
        loaded.into_iter().map(|loaded| loaded.and_then(Loaded::with_its_own)).collect();
    let crew = Crew::new(jobs);
    let progress = Progress::new(format.json);
    let mut results: Vec<Ended> = files.iter().map(|_| None).collect();
    let mut done = 0;
    crew.work(
        files.len() as u64,
        |number| {
            let scenario = scenarios[number as usize].as_ref().map_err(Clone::clone)?;
            let runner = Runner::new(scenario, seed).map_err(|bad| unbuildable(&files[number as usize], bad))?;
            Ok(runner.run())
        },
        |number, result| {
            results[number as usize] = Some(result);
            done += 1;
            progress.show(format!("{done} of {} scenarios", files.len()));
        },
    );
    progress.clear();
    let mut report = SeveralReport { ok: true, files, results: &results };
    let failure = crew.signal().map(crate::failure::ended_by).or_else(|| report.failure());
    report.ok = failure.is_none();
    if let Some(path) = junit_file {
        write(path, &report.junit())?;
    }
    format.print_judged(&report, failure)
}

/// What came of each file, in the order of the command line.
struct SeveralReport<'a> {
    /// False if the command fails.
    ok: bool,
    files: &'a [PathBuf],
    results: &'a [Ended],
}

/// What came of one file, for programs.
#[derive(Serialize)]
#[serde(untagged)]
enum FileReport<'a> {
    Ran {
        file: String,
        #[serde(flatten)]
        outcome: OutcomeReport<'a>,
    },
    Unusable {
        file: String,
        ok: bool,
        error: FailureBody,
    },
}

/// What came of all, for programs.
#[derive(Serialize)]
struct SeveralBody<'a> {
    ok: bool,
    passed: usize,
    failed: usize,
    unusable: usize,
    /// All were run.
    complete: bool,
    scenarios: Vec<FileReport<'a>>,
}

impl SeveralReport<'_> {
    fn each(&self) -> impl Iterator<Item = (&PathBuf, &Ended)> {
        self.files.iter().zip(self.results)
    }

    fn count(&self, is_meant: impl Fn(&Result<Outcome, Failure>) -> bool) -> usize {
        self.results.iter().flatten().filter(|result| is_meant(result)).count()
    }

    fn passed(&self) -> usize {
        self.count(|result| result.as_ref().is_ok_and(Outcome::passed))
    }

    fn unusable(&self) -> usize {
        self.count(Result::is_err)
    }

    fn failed(&self) -> usize {
        self.count(|result| result.as_ref().is_ok_and(|outcome| !outcome.passed()))
    }

    fn junit(&self) -> String {
        let suites = self.each().filter_map(|(file, result)| {
            Some((file.display().to_string(), result.as_ref()?.as_ref().map_err(ToString::to_string)))
        });
        junit(suites)
    }

    /// That a file cannot be used weighs more than that something is not as expected: nothing is known of it.
    fn failure(&self) -> Option<Failure> {
        let (failed, unusable) = (self.failed(), self.unusable());
        let of = counted(self.files.len(), "scenario");
        let failure = match (unusable, failed) {
            (0, 0) => return None,
            (0, _) => Failure::new(format!("{failed} of {of} failed")).of_kind("scenario"),
            (_, 0) => Failure::bad_file(format!("{unusable} of {of} cannot be used")),
            _ => Failure::bad_file(format!("{unusable} of {of} cannot be used, {failed} failed")),
        };
        let first = self.each().find_map(|(file, result)| match result.as_ref()? {
            Ok(outcome) => RunReport::new(outcome, file).failure(),
            Err(unusable) => Some(unusable.clone()),
        })?;
        let failure = first.because.iter().fold(failure, |failure, because| failure.because(because));
        Some(first.next.iter().fold(failure, |failure, next| failure.next(next)))
    }
}

impl Serialize for SeveralReport<'_> {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let scenarios = self.each().filter_map(|(file, result)| {
            let file = file.display().to_string();
            Some(match result.as_ref()? {
                Ok(outcome) => FileReport::Ran { file, outcome: outcome.to_json() },
                Err(failure) => FileReport::Unusable { file, ok: false, error: failure.into() },
            })
        });
        let (passed, failed, unusable) = (self.passed(), self.failed(), self.unusable());
        let body = SeveralBody {
            ok: self.ok,
            passed,
            failed,
            unusable,
            complete: passed + failed + unusable == self.files.len(),
            scenarios: scenarios.collect(),
        };
        body.serialize(serializer)
    }
}

impl Report for SeveralReport<'_> {
    fn text(&self, paint: Paint) -> String {
        let mut table = Table::new(&["", "scenario", "as expected", "end in s", "first that is not"]);
        for (file, result) in self.each() {
            let name = file.display().to_string();
            match result {
                None => table.row(["not run".to_owned(), name]),
                Some(Err(failure)) => {
                    let reason = failure.because.join("; ");
                    table.row(["UNUSABLE".to_owned(), name, "-".into(), "-".into(), first_line(&reason).to_owned()]);
                }
                Some(Ok(outcome)) => {
                    let as_expected = outcome.rows.iter().filter(|row| row.verdict == Verdict::Passed).count();
                    let first = outcome.failures().find(|row| row.verdict == Verdict::Failed);
                    let first =
                        first.map(|row| format!("line {}: {}: {}", row.place, row.asked, first_line(&row.seen)));
                    table.row([
                        if outcome.passed() { "ok" } else { "FAILED" }.to_owned(),
                        name,
                        format!("{as_expected} of {}", outcome.rows.len()),
                        format!("{:.3}", outcome.end.as_nanos() as f64 / 1e9),
                        first.unwrap_or_default(),
                    ]);
                }
            }
        }
        let colour = |_, column, cell: &str| match (column, cell) {
            (0, "ok") => Some(paint.good(cell)),
            (0, "FAILED" | "UNUSABLE") => Some(paint.bad(cell)),
            _ => None,
        };
        let mut last = format!("{} of {} passed", self.passed(), counted(self.files.len(), "scenario"));
        for (count, what) in [(self.failed(), "failed"), (self.unusable(), "cannot be used")] {
            if count > 0 {
                last.push_str(&format!(", {count} {what}"));
            }
        }
        format!("{}\n{last}", table.text(paint, colour))
    }
}

/// The rest is for the file alone.
fn first_line(text: &str) -> &str {
    text.lines().next().unwrap_or_default()
}
