//! What can keep the showcase from running.

use std::fmt::Write;

/// Why there is nothing to see.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A virtual drive cannot be had.
    #[error(transparent)]
    Order(#[from] sim::machine::OrderError),
    /// It cannot be put on the virtual bus.
    #[error(transparent)]
    World(#[from] sim::WorldError),
    /// A line of a procedure cannot be done; in a conversation, also one that the drive does not keep to.
    #[error("{0}")]
    Line(String),
}

/// Lines shown on each side of the one in question.
const AROUND: usize = 2;

impl Error {
    /// What was wrong in a line, shown with its neighbours.
    pub(crate) fn line(name: &str, text: &str, number: usize, what: String) -> Self {
        let mut shown = format!("{name}:{number}: {what}\n");
        let lines = (1..).zip(text.lines());
        for (n, line) in lines.filter(|(n, _)| number.abs_diff(*n) <= AROUND) {
            let mark = if n == number { '*' } else { ' ' };
            let _ = writeln!(shown, "  {n:2} {mark} {line}");
        }
        Self::Line(shown.trim_end().to_owned())
    }
}
