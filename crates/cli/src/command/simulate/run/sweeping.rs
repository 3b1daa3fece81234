//! A sweep over all cores: what came of its runs, added up.

use std::ops::RangeInclusive;
use std::path::Path;

use master::units::Shown;
use scenario::sweep::{Alike, OfValue, Summary, Sweep, SweepReport, Worst};
use scenario::{Outcome, Scenario};
use words::document::BadFile;

use super::crew::Crew;
use crate::failure::Failure;
use crate::output::{Format, Report};
use crate::progress::Progress;
use plot::Paint;
use plot::Table;

/// Values of a parameter that are shown to people.
const MOST_VALUES: usize = 40;

/// Runs between two changes of the line of progress.
const RUNS_A_LOOK: u64 = 16;

/// Makes the runs, `jobs` at once or as many as there are cores, and prints what came of them.
pub(super) fn sweep(
    scenario: Scenario,
    seeds: RangeInclusive<u64>,
    jobs: Option<u16>,
    file: &Path,
    format: Format,
) -> Result<(), Failure> {
    let sweep = Sweep::new(scenario, seeds).map_err(|reason| {
        Failure::usage("cannot sweep").because(reason).next("give --seeds 1..1000, and fewer values to [sweep]")
    })?;
    let crew = Crew::new(jobs);
    let summary = sum_up(&sweep, &crew, &Progress::new(format.json));
    let mut report = SweepReport::new(file, &sweep, &summary);
    let failure = crew.signal().map(Failure::ended_by).or_else(|| failure(&report));
    report.ok = failure.is_none();
    format.print_judged(&report, failure)
}

fn sum_up(sweep: &Sweep, crew: &Crew, progress: &Progress) -> Summary {
    let mut summary = Summary::default();
    let alike = Alike::default();
    crew.work(
        sweep.runs(),
        |number| made(sweep, &alike, number),
        |number, outcome| {
            summary.add(sweep, number, &outcome);
            let done = summary.passed() + summary.failures();
            if done.is_multiple_of(RUNS_A_LOOK) {
                progress.show(format!("{done} of {} runs, {} failed", sweep.runs(), summary.failures()));
            }
        },
    );
    progress.clear();
    summary
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
        let mut lines = vec![paint.strong(&self.title)];
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
