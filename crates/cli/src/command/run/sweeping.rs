//! A sweep over all cores: what came of its runs, added up.

use std::ops::RangeInclusive;
use std::path::Path;

use master::units::Shown;
use testbench::scenario::Scenario;
use testbench::sweep::{Summary, Sweep, SweepReport, Worst};

use super::crew::Crew;
use crate::failure::Failure;
use crate::output::{Format, Report};
use crate::progress::Progress;
use plot::Paint;
use plot::Table;

/// Runs between two changes of the line that tells the progress.
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
    let report = SweepReport::new(file, &sweep, &summary);
    format.print(&report).map_err(Failure::of_stdout)?;
    match (crew.signal(), failure(&report)) {
        (Some(signal), _) => Err(Failure { told: true, ..Failure::ended_by(signal) }),
        (None, Some(failure)) if format.json => Err(Failure { told: true, ..failure }),
        (None, Some(failure)) => Err(failure),
        (None, None) => Ok(()),
    }
}

fn sum_up(sweep: &Sweep, crew: &Crew, progress: &Progress) -> Summary {
    let mut summary = Summary::default();
    crew.work(
        sweep.runs(),
        |number| sweep.run(number),
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

/// That runs failed, and how to repeat the first of them.
fn failure(report: &SweepReport) -> Option<Failure> {
    let first = report.worst.first()?;
    let what = format!("{}: {} of {} runs failed", report.title, report.failed, report.passed + report.failed);
    let because = format!("{}: {}", first.failed.asked, first.failed.seen);
    Some(Failure::new(what).of_kind("scenario").because(because).next(&first.again))
}

impl Report for SweepReport {
    fn text(&self, paint: Paint) -> String {
        let mut lines = vec![paint.strong(&self.title)];
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
