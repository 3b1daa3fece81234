//! The table of the showcase, for people and for programs.

use plot::{Paint, Table};
use serde::Serialize;

use crate::part::PartReport;
use crate::row::Row;

/// What was found, in figures and rows. As text it is a table for each part and a verdict.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// True if nothing differed.
    pub ok: bool,
    /// Steps with something to compare.
    pub steps: usize,
    /// How many of them were as expected.
    pub passed: usize,
    /// Virtual time passed, s.
    pub virtual_s: f64,
    /// Time it took here, s.
    pub took_s: f64,
    /// Where the picture is.
    pub svg: String,
    drives: Vec<PartSummary>,
    rows: Vec<Row>,
}

/// The figures of a part.
#[derive(Clone, Debug, Serialize)]
struct PartSummary {
    /// The drive, or what the drives do together.
    drive: &'static str,
    steps: usize,
    passed: usize,
    virtual_s: f64,
}

impl PartSummary {
    fn of(part: &PartReport) -> Self {
        Self { drive: part.name, steps: part.steps, passed: part.passed, virtual_s: part.virtual_s }
    }

    fn ok(&self) -> bool {
        self.passed == self.steps
    }
}

impl Report {
    /// The report of these parts; `svg` is where the picture is, `took_s` the time that all took.
    pub fn new(parts: Vec<PartReport>, svg: String, took_s: f64) -> Self {
        let drives: Vec<PartSummary> = parts.iter().map(PartSummary::of).collect();
        Self {
            ok: drives.iter().all(PartSummary::ok),
            steps: drives.iter().map(|part| part.steps).sum(),
            passed: drives.iter().map(|part| part.passed).sum(),
            virtual_s: drives.iter().map(|part| part.virtual_s).sum(),
            took_s,
            svg,
            drives,
            rows: parts.into_iter().flat_map(|part| part.rows).collect(),
        }
    }

    /// Lines for people, without a line end after the last.
    pub fn text(&self, paint: Paint) -> String {
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

const OK_COLUMN: usize = 7;

/// The steps of one part.
fn table<'a>(rows: impl Iterator<Item = &'a Row>, paint: Paint) -> String {
    let mut table = Table::new(&["", "step", "asked", "answered", "moved", "expected", "seen", "ok"]);
    let mut section = "";
    for row in rows {
        let number = if row.section == section { "" } else { &row.section };
        section = &row.section;
        if row.checks.is_empty() {
            // A frame of this kind has no answer.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::row::Check;

    fn part(rows: Vec<Row>) -> PartReport {
        let compared = rows.iter().filter(|row| !row.checks.is_empty());
        let (steps, passed) = (compared.clone().count(), compared.filter(|row| row.ok).count());
        PartReport { name: "a drive", steps, passed, virtual_s: 2.0, rows }
    }

    fn row(step: &str, ok: Option<bool>) -> Row {
        let check = |ok| Check { expected: "1".into(), seen: if ok { "1" } else { "2" }.into(), ok };
        Row {
            drive: "a drive",
            section: "4.1".into(),
            step: step.into(),
            asked: String::new(),
            answered: String::new(),
            moved: String::new(),
            checks: ok.into_iter().map(check).collect(),
            ok: ok.unwrap_or(true),
        }
    }

    fn report(parts: Vec<PartReport>) -> Report {
        Report::new(parts, "demo.svg".into(), 0.5)
    }

    #[test]
    fn one_difference_fails_the_whole_and_is_shown() {
        let second = part(vec![row("two", Some(true)), row("three", Some(false))]);
        let report = report(vec![part(vec![row("one", Some(true))]), second]);
        assert!(!report.ok);
        assert_eq!((report.steps, report.passed), (3, 2));
        let text = report.text(Paint::OFF);
        assert!(text.contains("DIFFERS") && text.contains("2 of 3 steps as the manuals say"), "{text}");
    }

    #[test]
    fn a_row_without_anything_to_compare_is_shown_and_not_counted() {
        let report = report(vec![part(vec![row("one", Some(true)), row("NMT start", None)])]);
        assert!(report.ok && report.steps == 1);
        assert!(report.text(Paint::OFF).contains("NMT start"));
    }
}
