//! The demo's table, for people and for programs.

use serde::Serialize;

use super::bench::Finished;
use super::row::Row;
use crate::failure::{Failure, FailureBody};
use crate::output::Report;
use crate::paint::Paint;
use crate::table::Table;

/// What the demo found.
#[derive(Debug, Serialize)]
pub(crate) struct DemoReport {
    /// True if nothing differed.
    ok: bool,
    /// Why not.
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<FailureBody>,
    /// Steps with something to compare, and how many were as expected.
    steps: usize,
    passed: usize,
    /// Virtual time passed, s.
    virtual_s: f64,
    /// Time it took here, s.
    pub(crate) took_s: f64,
    /// Where the picture is.
    pub(crate) svg: String,
    /// The same figures for each part.
    drives: Vec<PartReport>,
    /// All steps, each with the part that it belongs to.
    rows: Vec<Row>,
}

/// What a part of it found.
#[derive(Debug, Serialize)]
pub(super) struct PartReport {
    /// The drive, or what the drives do together.
    drive: &'static str,
    steps: usize,
    passed: usize,
    virtual_s: f64,
    #[serde(skip)]
    rows: Vec<Row>,
}

impl PartReport {
    pub(super) fn new(drive: &'static str, finished: Finished) -> Self {
        let Finished { mut rows, end, .. } = finished;
        rows.iter_mut().for_each(|row| row.drive = drive);
        let compared = || rows.iter().filter(|row| !row.checks.is_empty());
        let (steps, passed) = (compared().count(), compared().filter(|row| row.ok).count());
        Self { drive, steps, passed, virtual_s: end.as_secs_f64(), rows }
    }

    fn ok(&self) -> bool {
        self.passed == self.steps
    }
}

impl DemoReport {
    pub(super) fn new(mut drives: Vec<PartReport>) -> Self {
        let rows = drives.iter_mut().flat_map(|part| std::mem::take(&mut part.rows)).collect();
        let sum = |count: fn(&PartReport) -> usize| drives.iter().map(count).sum();
        let ok = drives.iter().all(PartReport::ok);
        Self {
            ok,
            error: (!ok).then(|| (&differs()).into()),
            steps: sum(|part| part.steps),
            passed: sum(|part| part.passed),
            virtual_s: drives.iter().map(|part| part.virtual_s).sum(),
            took_s: 0.0,
            svg: String::new(),
            drives,
            rows,
        }
    }

    /// Why the demo failed, if it did.
    pub(crate) fn failure(&self) -> Option<Failure> {
        (!self.ok).then(differs)
    }
}

fn differs() -> Failure {
    let failure = Failure::new("the drives did not do everything as their manuals say");
    Failure { kind: "differs", ..failure.next("look for DIFFERS in the table, or for \"ok\":false in the rows") }
}

const OK_COLUMN: usize = 7;

/// The steps of one part.
fn table<'a>(rows: impl Iterator<Item = &'a Row>, paint: Paint) -> String {
    let mut table = Table::new(&["", "step", "asked", "answered", "moved", "expected", "seen", "ok"]);
    let mut section = "";
    for row in rows {
        let number = if row.section == section { "" } else { row.section };
        section = row.section;
        if row.checks.is_empty() {
            // Nobody answers a frame of this kind.
            table.row([number, &row.step, &row.asked]);
        }
        for (place, check) in row.checks.iter().enumerate() {
            let first = |text: &str| if place == 0 { text.to_owned() } else { String::new() };
            let ok = if check.ok { "ok" } else { "DIFFERS" };
            let what = [first(number), first(&row.step), first(&row.asked), first(&row.answered), first(&row.moved)];
            table.row(what.into_iter().chain([check.expected.clone(), check.seen.clone(), ok.into()]));
        }
    }
    table.text(paint, |_, column, cell| {
        (column == OK_COLUMN).then(|| if cell == "ok" { paint.good(cell) } else { paint.bad(cell) })
    })
}

impl Report for DemoReport {
    fn text(&self, paint: Paint) -> String {
        let colour = |ok: bool, text: String| if ok { paint.good(&text) } else { paint.bad(&text) };
        let mut text = String::new();
        for part in &self.drives {
            let rows = self.rows.iter().filter(|row| row.drive == part.drive);
            text.push_str(&format!("{}\n\n{}\n\n", paint.strong(part.drive), table(rows, paint)));
        }
        let width = self.drives.iter().map(|part| part.drive.chars().count()).max().unwrap_or(0);
        for part in &self.drives {
            let count = format!("{:3} of {:3} steps as expected", part.passed, part.steps);
            let name = part.drive;
            text.push_str(&format!("{name:width$}  {}; {:.1} s\n", colour(part.ok(), count), part.virtual_s));
        }
        let verdict = format!("{} of {} steps as the manuals say", self.passed, self.steps);
        let verdict = colour(self.ok, verdict);
        text + &format!(
            "\n{verdict}; {:.1} s of drive time in {:.2} s; the motion is drawn in {}",
            self.virtual_s, self.took_s, self.svg
        )
    }
}

#[cfg(test)]
mod tests {
    use can::Instant;
    use sim::recorder::Recorder;

    use super::*;
    use crate::demo::set_points::SetPoints;

    fn part(rows: Vec<Row>) -> PartReport {
        let recorder = Recorder::new(std::time::Duration::from_millis(1), []);
        let (sections, events, starts, cuts) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let (set_points, end) = (SetPoints::default(), Instant::from_secs(2));
        PartReport::new("a drive", Finished { rows, recorder, sections, events, set_points, starts, cuts, end })
    }

    fn row(step: &str, ok: bool) -> Row {
        let mut row = Row::new("4.1", step);
        row.compare("1", if ok { "1" } else { "2" }, ok);
        row
    }

    #[test]
    fn one_difference_fails_the_whole_and_is_shown() {
        let report =
            DemoReport::new(vec![part(vec![row("one", true)]), part(vec![row("two", true), row("three", false)])]);
        assert!(!report.ok);
        assert_eq!((report.steps, report.passed), (3, 2));
        let text = report.text(Paint::OFF);
        assert!(text.contains("DIFFERS") && text.contains("2 of 3 steps as the manuals say"), "{text}");
    }

    #[test]
    fn a_row_without_anything_to_compare_is_shown_and_not_counted() {
        let report = DemoReport::new(vec![part(vec![row("one", true), Row::new("4.1", "NMT start")])]);
        assert!(report.ok && report.steps == 1);
        assert!(report.text(Paint::OFF).contains("NMT start"));
    }
}
