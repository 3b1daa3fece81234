//! What a part of the showcase found: its rows and how many of them are as expected.

use crate::bench::Finished;
use crate::row::Row;

/// What one part found.
#[derive(Clone, Debug)]
pub struct PartReport {
    /// The drive, or what the drives do together.
    pub name: &'static str,
    /// Rows with something to compare.
    pub steps: usize,
    /// How many of them are as expected.
    pub passed: usize,
    /// Virtual time passed, s.
    pub virtual_s: f64,
    /// All rows, each with the name of the part.
    pub rows: Vec<Row>,
}

impl PartReport {
    pub(crate) fn new(name: &'static str, finished: Finished) -> Self {
        let Finished { mut rows, end, .. } = finished;
        rows.iter_mut().for_each(|row| row.drive = name);
        let compared = || rows.iter().filter(|row| !row.checks.is_empty());
        let (steps, passed) = (compared().count(), compared().filter(|row| row.ok).count());
        Self { name, steps, passed, virtual_s: end.as_secs_f64(), rows }
    }

    /// Whether everything is as expected.
    pub fn ok(&self) -> bool {
        self.passed == self.steps
    }
}

#[cfg(test)]
mod tests {
    use can::Instant;
    use sim::recorder::Recorder;

    use super::*;
    use crate::set_points::SetPoints;

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
    fn one_difference_fails_a_part() {
        let part = part(vec![row("two", true), row("three", false)]);
        assert!(!part.ok());
        assert_eq!((part.steps, part.passed, part.virtual_s), (2, 1, 2.0));
        assert!(part.rows.iter().all(|row| row.drive == "a drive"));
    }

    #[test]
    fn a_row_without_anything_to_compare_is_kept_and_not_counted() {
        let part = part(vec![row("one", true), Row::new("4.1", "NMT start")]);
        assert!(part.ok());
        assert_eq!((part.steps, part.rows.len()), (1, 2));
    }
}
