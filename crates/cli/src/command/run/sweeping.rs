//! A sweep over all cores: threads take the numbers of runs, and one place adds up what comes of them.

use std::ops::RangeInclusive;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError, mpsc};

use master::units::Shown;
use testbench::scenario::Scenario;
use testbench::sweep::{Summary, Sweep, SweepReport, Worst};

use crate::failure::Failure;
use crate::output::{Format, Report};
use crate::paint::Paint;
use crate::progress::Progress;
use crate::session::runtime;
use crate::signals::{Signal, asked_to_end};
use crate::table::Table;

/// Outcomes that may wait to be added: a run may be much faster than another.
const WAITING: usize = 256;

/// Runs between two changes of the line that tells the progress.
const RUNS_A_LOOK: u64 = 16;

/// Makes the runs, `jobs` at once or as many as there are cores, and prints what came of them.
pub(super) fn sweep(
    scenario: Scenario,
    seeds: RangeInclusive<u64>,
    jobs: Option<usize>,
    file: &Path,
    format: Format,
) -> Result<(), Failure> {
    let sweep = Sweep::new(scenario, seeds).map_err(|reason| Failure::usage("cannot sweep").because(reason))?;
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let jobs = jobs.unwrap_or(cores).min(usize::try_from(sweep.runs()).unwrap_or(usize::MAX));
    let signal = Arc::new(Mutex::new(None));
    let stop = Arc::new(AtomicBool::new(false));
    stop_on_signal(Arc::clone(&signal), Arc::clone(&stop));
    let summary = sum_up(&sweep, jobs, &stop, &Progress::new(format.json));
    let report = SweepReport::new(file, &sweep, &summary);
    format.print(&report).map_err(|error| Failure::new("cannot write to standard output").because(error))?;
    let ended = *signal.lock().unwrap_or_else(PoisonError::into_inner);
    match (ended, failure(&report)) {
        (Some(signal), _) => Err(Failure { told: true, ..Failure::ended_by(signal) }),
        (None, Some(failure)) if format.json => Err(Failure { told: true, ..failure }),
        (None, Some(failure)) => Err(failure),
        (None, None) => Ok(()),
    }
}

/// From here on a signal ends the sweep, with what it has.
fn stop_on_signal(heard: Arc<Mutex<Option<Signal>>>, stop: Arc<AtomicBool>) {
    std::thread::spawn(move || {
        if let Ok(runtime) = runtime() {
            let signal = runtime.block_on(asked_to_end());
            *heard.lock().unwrap_or_else(PoisonError::into_inner) = Some(signal);
            stop.store(true, Ordering::Release);
            // Who asks twice does not want to wait for the runs that are on their way.
            let signal = runtime.block_on(asked_to_end());
            std::process::exit(signal.status() as i32);
        }
    });
}

fn sum_up(sweep: &Sweep, jobs: usize, stop: &AtomicBool, progress: &Progress) -> Summary {
    let mut summary = Summary::default();
    let next = AtomicU64::new(0);
    let (outcomes, incoming) = mpsc::sync_channel(WAITING);
    std::thread::scope(|scope| {
        for _ in 0..jobs {
            let outcomes = outcomes.clone();
            let next = &next;
            scope.spawn(move || {
                while !stop.load(Ordering::Acquire) {
                    let number = next.fetch_add(1, Ordering::Relaxed);
                    if number >= sweep.runs() || outcomes.send((number, sweep.run(number))).is_err() {
                        return;
                    }
                }
            });
        }
        drop(outcomes);
        for (number, outcome) in incoming {
            summary.add(sweep, number, &outcome);
            let done = summary.passed() + summary.failures();
            if done.is_multiple_of(RUNS_A_LOOK) {
                progress.show(format!("{done} of {} runs, {} failed", sweep.runs(), summary.failures()));
            }
        }
    });
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
        let ended = if self.complete { "" } else { ", ended before the others" };
        lines.push(format!("{} of {} runs passed, {} failed{ended}", self.passed, self.runs, self.failed));
        lines.join("\n")
    }
}
