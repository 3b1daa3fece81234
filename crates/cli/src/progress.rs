//! What is going on, on a terminal only.

use std::io::{self, IsTerminal};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use terminal_size::Width;

use crate::output::{has_reader, print_error};
use crate::plain::plain;

/// How often a long count is shown where standard error is a file or a pipe.
const PIPED_INTERVAL: Duration = Duration::from_secs(5);

/// One line on standard error that says what is being waited for; nothing if that is not a terminal.
#[derive(Clone, Debug)]
pub(crate) struct Progress {
    bar: ProgressBar,
    /// Not a terminal, and yet it may be read.
    piped: Option<Arc<Mutex<Lines>>>,
}

/// Lines about a long count, where standard error is a file or a pipe.
#[derive(Debug)]
struct Lines {
    /// Since the line of progress was begun.
    last: Duration,
}

impl Lines {
    /// True if there is one now; the next comes [`PIPED_INTERVAL`] later.
    fn is_due(&mut self, now: Duration) -> bool {
        let due = now.saturating_sub(self.last) >= PIPED_INTERVAL;
        if due {
            self.last = now;
        }
        due
    }
}

impl Progress {
    /// A line that shows nothing yet. `quiet` keeps it so.
    pub(crate) fn new(quiet: bool) -> Self {
        let piped = !has_reader();
        if quiet || piped {
            let lines = || Arc::new(Mutex::new(Lines { last: Duration::ZERO }));
            return Self { bar: ProgressBar::hidden(), piped: (piped && !quiet).then(lines) };
        }
        let bar = ProgressBar::new_spinner();
        if let Ok(style) = ProgressStyle::with_template("{spinner} {msg}") {
            bar.set_style(style);
        }
        Self { bar, piped: None }
    }

    /// True if it is visible.
    pub(crate) fn is_shown(&self) -> bool {
        !self.bar.is_hidden()
    }

    /// Shows `text`.
    pub(crate) fn show(&self, text: impl Into<String>) {
        self.bar.set_message(text.into());
        self.bar.tick();
    }

    /// Shows how far something is that may take long: no terminal gets a line now and then.
    pub(crate) fn count(&self, text: impl Into<String>) {
        match &self.piped {
            None => self.show(text),
            Some(lines) => {
                if lines.lock().unwrap_or_else(PoisonError::into_inner).is_due(self.bar.elapsed()) {
                    self.note(&text.into());
                }
            }
        }
    }

    /// A line on standard error that stays, terminal or not.
    pub(crate) fn note(&self, text: &str) {
        self.line(&format!("note: {}", plain(text)));
    }

    /// A line on standard error as it is, terminal or not.
    pub(crate) fn line(&self, text: &str) {
        self.bar.suspend(|| print_error(text));
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

impl host::network::Progress for Progress {
    fn show(&self, text: String) {
        Self::show(self, text);
    }

    fn count(&self, text: String) {
        Self::count(self, text);
    }

    fn note(&self, text: &str) {
        Self::note(self, text);
    }
}

/// A text on standard output that is written over by the next one; of a terminal only.
pub(crate) struct Screen {
    bar: ProgressBar,
}

impl Screen {
    /// None if standard output is not a terminal.
    pub(crate) fn on_terminal() -> Option<Self> {
        if !io::stdout().is_terminal() {
            return None;
        }
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stdout());
        bar.set_style(ProgressStyle::with_template("{msg}").ok()?);
        Some(Self { bar })
    }

    /// How many characters a line has; it may change at any time.
    pub(crate) fn width() -> usize {
        terminal_size::terminal_size().map_or(80, |(Width(width), _)| width.into())
    }

    /// Shows `text` in place of what was shown before.
    pub(crate) fn show(&self, text: &str) {
        self.bar.set_message(text.to_owned());
        self.bar.tick();
    }
}

/// What was shown last stays.
impl Drop for Screen {
    fn drop(&mut self) {
        self.bar.abandon();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_count_has_a_line_every_five_seconds_on_a_pipe_and_a_short_one_none() {
        let shown_after = |answer: Duration, count: u32| -> Vec<u64> {
            let mut lines = Lines { last: Duration::ZERO };
            let times = (1..=count).map(|number| answer * number);
            times.filter(|time| lines.is_due(*time)).map(|time| time.as_millis() as u64).collect()
        };
        // A scan whose nodes answer at once, a slow one of 127 nodes, and a drive that takes 450 ms for each of 133 objects.
        assert!(shown_after(Duration::from_millis(5), 127).is_empty());
        assert_eq!(shown_after(Duration::from_millis(200), 127), [5000, 10_000, 15_000, 20_000, 25_000]);
        let slow = shown_after(Duration::from_millis(450), 133);
        assert_eq!(slow, [5400, 10_800, 16_200, 21_600, 27_000, 32_400, 37_800, 43_200, 48_600, 54_000, 59_400]);
    }
}
