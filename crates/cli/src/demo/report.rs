//! The demo's table, for people and for programs.

use serde::Serialize;

use super::bench::Finished;
use super::row::Row;
use crate::output::Report;
use crate::paint::Paint;
use crate::table::Table;

/// What the demo found.
#[derive(Debug, Serialize)]
pub(crate) struct DemoReport {
    /// True if nothing differed.
    pub(crate) ok: bool,
    /// Steps made, and how many were as expected.
    steps: usize,
    passed: usize,
    /// Virtual time passed, s.
    virtual_s: f64,
    /// Time it took here, s.
    pub(crate) took_s: f64,
    /// Where the picture is.
    pub(crate) svg: String,
    rows: Vec<Row>,
}

impl DemoReport {
    pub(super) fn new(finished: Finished) -> Self {
        let passed = finished.rows.iter().filter(|row| row.ok).count();
        let steps = finished.rows.len();
        let virtual_s = finished.end.as_secs_f64();
        Self { ok: passed == steps, steps, passed, virtual_s, took_s: 0.0, svg: String::new(), rows: finished.rows }
    }
}

impl Report for DemoReport {
    fn text(&self, paint: Paint) -> String {
        const OK_COLUMN: usize = 7;
        let mut table = Table::new(&["", "step", "asked", "answered", "moved", "expected", "seen", "ok"]);
        let mut section = "";
        for row in &self.rows {
            let number = if row.section == section { "" } else { row.section };
            section = row.section;
            for (place, check) in row.checks.iter().enumerate() {
                let first = |text: &str| if place == 0 { text.to_owned() } else { String::new() };
                let ok = if check.ok { "ok" } else { "DIFFERS" };
                let what =
                    [first(number), first(&row.step), first(&row.asked), first(&row.answered), first(&row.moved)];
                table.row(what.into_iter().chain([check.expected.clone(), check.seen.clone(), ok.into()]));
            }
        }
        let text = table.text(paint, |_, column, cell| {
            (column == OK_COLUMN).then(|| if cell == "ok" { paint.good(cell) } else { paint.bad(cell) })
        });
        let verdict = format!("{} of {} steps as the manual says", self.passed, self.steps);
        let verdict = if self.ok { paint.good(&verdict) } else { paint.bad(&verdict) };
        format!(
            "{text}\n\n{verdict}; {:.1} s of drive time in {:.2} s; the motion is drawn in {}",
            self.virtual_s, self.took_s, self.svg
        )
    }
}
