//! What came of a run, for people: a table of what was asked, when, and what was seen.

use std::path::Path;

use master::units::Shown;
use scenario::{Outcome, Verdict};
use serde::Serialize;

use crate::failure::Failure;
use crate::output::Report;
use plot::Paint;
use plot::Table;

/// An outcome and the file that it came from.
pub(super) struct RunReport<'a> {
    outcome: &'a Outcome,
    file: &'a Path,
}

/// The column of verdicts.
const VERDICT: usize = 0;

/// So much of what was seen fits a line; `--json` has all.
const WIDEST: usize = 100;

impl<'a> RunReport<'a> {
    pub(super) fn new(outcome: &'a Outcome, file: &'a Path) -> Self {
        Self { outcome, file }
    }

    /// What is not as expected.
    pub(super) fn failure(&self) -> Option<Failure> {
        let failures: Vec<_> = self.outcome.failures().filter(|row| row.verdict == Verdict::Failed).collect();
        let first = failures.first()?;
        let what = format!("{}: {} of {} not as expected", self.outcome.title, failures.len(), self.outcome.rows.len());
        let file = self.file.display();
        let failure = Failure::new(what).of_kind("scenario").because(format!(
            "{file}:{}: {} {}: {}",
            first.place,
            first.kind.word(),
            first.asked,
            first.seen
        ));
        let parameters = self.outcome.parameters.iter().map(|(name, value)| format!(" --set {name}={value}"));
        let again = format!("ferrodrive run {file} --seed {}{}", self.outcome.seed, parameters.collect::<String>());
        Some(failure.next(format!("repeat this run with all details: {again} --json")))
    }
}

impl Serialize for RunReport<'_> {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.outcome.to_json().serialize(serializer)
    }
}

impl Report for RunReport<'_> {
    fn text(&self, paint: Paint) -> String {
        let outcome = self.outcome;
        let mut table = Table::new(&["", "t in s", "", "asked", "seen"]);
        for row in &outcome.rows {
            let verdict = match row.verdict {
                Verdict::Passed => "ok",
                Verdict::Failed => "FAILED",
                Verdict::Skipped => "skipped",
            };
            let at = row.at.map_or("-".to_owned(), |at| format!("{:.4}", at.as_nanos() as f64 / 1e9));
            let asked = if row.asked.is_empty() { row.name.clone() } else { row.asked.clone() };
            let seen = row.seen.replace('\n', " ");
            let seen = match seen.char_indices().nth(WIDEST) {
                // Failures are shown in full.
                Some((end, _)) if row.verdict == Verdict::Passed => format!("{}..", &seen[..end]),
                _ => seen,
            };
            table.row([verdict.to_owned(), at, row.kind.word().to_owned(), asked, seen]);
        }
        let colour = |_, column, cell: &str| match (column, cell) {
            (VERDICT, "ok") => Some(paint.good(cell)),
            (VERDICT, "FAILED") => Some(paint.bad(cell)),
            _ => None,
        };
        let mut lines = vec![paint.strong(&outcome.title), table.text(paint, colour)];
        lines.extend(outcome.figures.iter().map(|(name, value)| format!("{name}: {}", Shown(*value))));
        if !outcome.last_frames.is_empty() {
            lines.push("the last frames:".into());
            lines.extend(outcome.last_frames.iter().map(|frame| format!("  {frame}")));
        }
        let passed = outcome.rows.iter().filter(|row| row.verdict == Verdict::Passed).count();
        lines.push(format!(
            "{passed} of {} as expected, {:.3} s of virtual time, seed {}, digest {:016x}",
            outcome.rows.len(),
            outcome.end.as_nanos() as f64 / 1e9,
            outcome.seed,
            outcome.digest
        ));
        lines.join("\n")
    }
}
