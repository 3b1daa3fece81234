//! The table at the end of a run of steps.

use std::process::ExitCode;
use std::time::Duration;

use crate::tally::Tally;

/// A step that has run: its name, how long it took, what it found.
pub(crate) type StepRow = (&'static str, Duration, Tally);

/// How many lines of what the failed tests of a step printed are shown again.
const SHOWN_AGAIN: usize = 60;

/// Shows what failed tests printed, and the table; success if nothing failed.
pub(crate) fn conclude(rows: &[StepRow], took: Duration) -> ExitCode {
    for (name, _, tally) in rows {
        tally.output.iter().take(SHOWN_AGAIN).for_each(|line| println!("{name:10} | {line}"));
    }
    println!("\n{:10} {:8} {:>8} {:>7} {:>7} {:>8}  note", "step", "result", "time", "passed", "failed", "skipped");
    for (name, took, tally) in rows {
        let Tally { passed, failed, skipped, note, .. } = tally;
        println!("{name:10} {:8} {:>8} {passed:>7} {failed:>7} {skipped:>8}  {note}", tally.verdict(), seconds(*took));
    }
    println!("{:10} {:8} {:>8}\n", "all", sum(rows).verdict(), seconds(took));
    if sum(rows).failed == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// What all steps found together.
pub(crate) fn sum(rows: &[StepRow]) -> Tally {
    let mut sum = Tally::default();
    rows.iter().for_each(|(_, _, tally)| sum.add(tally));
    sum
}

/// A time as the table shows it.
pub(crate) fn seconds(duration: Duration) -> String {
    format!("{:.1} s", duration.as_secs_f64())
}
