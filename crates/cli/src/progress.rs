//! What is going on, on a terminal only.

use std::io::{self, IsTerminal, Write};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

use crate::plain::plain;

/// One line on standard error that says what is being waited for; nothing if that is no terminal.
#[derive(Clone, Debug)]
pub(crate) struct Progress {
    bar: ProgressBar,
}

impl Progress {
    /// A line that shows nothing yet. `quiet` keeps it so.
    pub(crate) fn new(quiet: bool) -> Self {
        if quiet || !io::stderr().is_terminal() {
            return Self { bar: ProgressBar::hidden() };
        }
        let bar = ProgressBar::new_spinner();
        if let Ok(style) = ProgressStyle::with_template("{spinner} {msg}") {
            bar.set_style(style);
        }
        Self { bar }
    }

    /// Shows `text`.
    pub(crate) fn show(&self, text: impl Into<String>) {
        self.bar.set_message(text.into());
        self.bar.tick();
    }

    /// A line on standard error that stays, terminal or not.
    pub(crate) fn note(&self, text: &str) {
        // Nobody may be listening any more.
        self.bar.suspend(|| drop(writeln!(io::stderr(), "note: {}", plain(text))));
    }

    /// Keeps the line moving while nothing changes.
    pub(crate) fn spin(&self) {
        self.bar.enable_steady_tick(Duration::from_millis(100));
    }

    /// Takes the line away.
    pub(crate) fn clear(&self) {
        self.bar.finish_and_clear();
    }
}
