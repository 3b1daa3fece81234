//! What a step found: how many checks passed, failed and were skipped, and why.

/// The result of one step. Counts are checks, not steps: a step that runs 300 tests counts 300.
#[derive(Debug, Default, Clone, PartialEq, Eq)]
pub(crate) struct Tally {
    pub(crate) passed: u32,
    pub(crate) failed: u32,
    pub(crate) skipped: u32,
    /// One line for the table: what failed, or why something was skipped.
    pub(crate) note: String,
    /// What failed tests printed: shown again at the end of a run, which is all that some see of it.
    pub(crate) output: Vec<String>,
}

impl Tally {
    pub(crate) fn passed() -> Self {
        Self { passed: 1, ..Self::default() }
    }

    pub(crate) fn failed(note: impl Into<String>) -> Self {
        Self { failed: 1, note: note.into(), ..Self::default() }
    }

    pub(crate) fn skipped(note: impl Into<String>) -> Self {
        Self { skipped: 1, note: note.into(), ..Self::default() }
    }

    pub(crate) fn of_check(ok: bool, note_when_failed: &str) -> Self {
        if ok { Self::passed() } else { Self::failed(note_when_failed) }
    }

    pub(crate) fn add(&mut self, other: &Self) {
        self.passed += other.passed;
        self.failed += other.failed;
        self.skipped += other.skipped;
        self.output.extend_from_slice(&other.output);
        if !other.note.is_empty() {
            if !self.note.is_empty() {
                self.note.push_str("; ");
            }
            self.note.push_str(&other.note);
        }
    }

    /// The word for the table.
    pub(crate) fn verdict(&self) -> &'static str {
        match (self.failed, self.passed) {
            (1.., _) => "FAILED",
            (0, 0) => "skipped",
            (0, _) => "passed",
        }
    }

    /// The last line of a run.
    pub(crate) fn summary(&self) -> String {
        format!("{} passed, {} failed, {} skipped", self.passed, self.failed, self.skipped)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_failure_among_passes_is_a_failed_step() {
        let mut sum = Tally::passed();
        sum.add(&Tally::failed("it broke"));
        sum.add(&Tally::skipped("no tool"));
        assert_eq!(sum.verdict(), "FAILED");
        assert_eq!(sum.note, "it broke; no tool");
        assert_eq!(sum.summary(), "1 passed, 1 failed, 1 skipped");
    }

    #[test]
    fn a_step_that_only_skipped_is_not_called_passed() {
        assert_eq!(Tally::skipped("no network").verdict(), "skipped");
    }
}
