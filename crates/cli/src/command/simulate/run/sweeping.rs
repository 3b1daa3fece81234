//! A sweep over all cores: what came of its runs, added up.

use std::path::{Path, PathBuf};

use master::units::Shown;
use scenario::Outcome;
use scenario::sweep::results::RunResult;
use scenario::sweep::{Alike, OfValue, Summary, Sweep, SweepReport, Worst};
use words::document::BadFile;

use super::crew::Crew;
use super::loaded::write;
use super::results::{ResultsFile, merge_files};
use crate::failure::Failure;
use crate::output::{Format, Report, is_stdout, print_error};
use crate::progress::Progress;
use plot::Paint;
use plot::Table;

/// Values of a parameter that are shown to people.
const MOST_VALUES: usize = 40;

/// Runs between two changes of the line of progress.
const RUNS_A_LOOK: u64 = 16;

/// What is asked of a sweep.
pub(super) struct SweepOptions<'a> {
    /// Runs at once; `None` for as many as there are cores.
    pub(super) jobs: Option<u16>,
    /// Where the results go.
    pub(super) output: Option<&'a Path>,
    /// Whether it goes on with the results that are there.
    pub(super) resume: bool,
    /// The files of results that are put together instead of making runs.
    pub(super) merge: &'a [PathBuf],
    /// Where the results go for build servers.
    pub(super) junit: Option<&'a Path>,
    /// The options that make the same runs, for a command that repeats them.
    pub(super) again: String,
}

/// Makes the runs, or puts their results together, and prints what came of them.
pub(super) fn sweep(sweep: &Sweep, asked: &SweepOptions<'_>, file: &Path, format: Format) -> Result<(), Failure> {
    let mut summary = if asked.junit.is_some() { Summary::with_cases() } else { Summary::default() };
    if !asked.merge.is_empty() {
        merge_files(asked.merge, asked.output, sweep, &mut summary, &asked.again)?;
        return print(sweep, &summary, asked, file, format, None);
    }
    let mut results = None;
    let mut done = 0;
    if let Some(path) = asked.output {
        let (opened, runs) = ResultsFile::open(path, sweep, asked.resume, &mut summary)?;
        results = Some(opened);
        done = runs;
    }
    let crew = Crew::new(asked.jobs);
    make_runs(sweep, done, &crew, &mut summary, results.as_mut(), &Progress::new(format.json))?;
    print(sweep, &summary, asked, file, format, crew.signal().map(crate::failure::ended_by))
}

/// Makes the runs of this part from the `done`-th on.
fn make_runs(
    sweep: &Sweep,
    done: u64,
    crew: &Crew,
    summary: &mut Summary,
    mut results: Option<&mut ResultsFile>,
    progress: &Progress,
) -> Result<(), Failure> {
    let alike = Alike::default();
    let mut written = Ok(());
    crew.work(
        sweep.share() - done,
        |nth| {
            let number = sweep.shard().number(done + nth);
            RunResult::new(sweep, number, &made(sweep, &alike, number))
        },
        |nth, result| {
            if written.is_err() {
                return;
            }
            summary.add(sweep, &result);
            if let Some(results) = &mut results {
                written = results.append(&result.to_line());
                if written.is_err() {
                    crew.end();
                }
            }
            if (done + nth).is_multiple_of(RUNS_A_LOOK) {
                progress.show(format!("{} of {} runs, {} failed", done + nth + 1, sweep.share(), summary.failures()));
            }
        },
    );
    progress.clear();
    written?;
    results.map_or(Ok(()), ResultsFile::finish)
}

/// Prints the summary, beside results on standard output as a note, and fails with `ended` or with the runs that failed.
fn print(
    sweep: &Sweep,
    summary: &Summary,
    asked: &SweepOptions<'_>,
    file: &Path,
    format: Format,
    ended: Option<Failure>,
) -> Result<(), Failure> {
    if let Some(path) = asked.junit {
        write(path, &summary.to_junit(sweep))?;
    }
    let mut report = SweepReport::new(file, sweep, summary);
    let failure = ended.or_else(|| failure(&report));
    report.ok = failure.is_none();
    if asked.output.is_some_and(is_stdout) {
        print_error(&report.text(Paint::OFF));
        return format.ended(failure);
    }
    format.print_judged(&report, failure)
}

/// The outcome of a run; it is not repeated where nothing in it is random.
fn made(sweep: &Sweep, alike: &Alike, number: u64) -> Result<Outcome, BadFile> {
    if let Some(known) = alike.of(sweep, number) {
        return Ok(known);
    }
    let outcome = sweep.run(number)?;
    alike.keep(sweep, number, &outcome);
    Ok(outcome)
}

/// That runs failed, and how to repeat the first of them.
fn failure(report: &SweepReport) -> Option<Failure> {
    let first = report.worst.first()?;
    let what = format!("{}: {} of {} runs failed", report.title, report.failed, report.passed + report.failed);
    let because = format!("{}: {}", first.failed.asked, first.failed.seen);
    Some(Failure::new(what).of_kind("scenario").because(because).next(&first.again))
}

/// A table of what came of each value; of a parameter with many values only those with which runs failed, and no more than fit.
fn of_values(values: &[OfValue], paint: Paint) -> Option<String> {
    let mut table = Table::new(&["parameter", "value", "runs", "passed", "failed"]);
    let mut notes = Vec::new();
    for axis in values.chunk_by(|one, other| one.parameter == other.parameter) {
        let all = axis.len() <= MOST_VALUES;
        let shown: Vec<_> = axis.iter().filter(|row| all || row.failed > 0).take(MOST_VALUES).collect();
        if !all {
            let (shown, of, name) = (shown.len(), axis.len(), &axis[0].parameter);
            notes.push(format!(
                "{shown} of the {of} values of {name}: the first with which runs failed; --json has all"
            ));
        }
        for row in shown {
            let counts = [row.runs, row.passed, row.failed].map(|count| count.to_string());
            table.row([row.parameter.clone(), row.value.clone()].into_iter().chain(counts));
        }
    }
    let colour = |_, column, cell: &str| (column == 4 && cell != "0").then(|| paint.bad(cell));
    (!values.is_empty()).then(|| [table.text(paint, colour)].into_iter().chain(notes).collect::<Vec<_>>().join("\n"))
}

impl Report for SweepReport {
    fn text(&self, paint: Paint) -> String {
        let shard = self.shard.as_ref().map(|shard| format!(", shard {shard}")).unwrap_or_default();
        let mut lines = vec![paint.strong(&format!("{}{shard}", self.title))];
        lines.extend(of_values(&self.values, paint));
        if !self.figures.is_empty() {
            let mut table = Table::new(&["figure", "min", "median", "max", "lowest with", "highest with"]);
            for it in &self.figures {
                let values = [it.min, it.median, it.max].map(|value| Shown(value).to_string());
                let row = [it.name.clone()].into_iter().chain(values);
                table.row(row.chain([it.lowest.options(), it.highest.options()]));
            }
            lines.push(table.plain(paint));
        }
        for Worst { failed, again } in &self.worst {
            lines.push(format!("{} {}: {}", paint.bad("FAILED"), failed.asked, failed.seen.replace('\n', " ")));
            lines.push(format!("  again: {again}"));
        }
        lines.extend(self.note.as_ref().map(|note| format!("note: {note}")));
        let ended = if self.complete { "" } else { ", ended before the others" };
        lines.push(format!("{} of {} runs passed, {} failed{ended}", self.passed, self.runs, self.failed));
        lines.join("\n")
    }
}
