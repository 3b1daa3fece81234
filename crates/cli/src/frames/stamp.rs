//! The time before each line: as it came, since the first line, since the line before, or of day.

use std::time::Duration;

use can::Instant;
use canopen::time_stamp::civil_date;
use clap::ValueEnum;
use transport::WallClock;

/// How times are shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum TimeForm {
    /// Seconds since the command began; with a log, as recorded
    #[default]
    Stamp,
    /// Seconds since the first line shown
    Relative,
    /// Seconds since the previous line
    Delta,
    /// Date and time of day, UTC
    Absolute,
}

/// Turns times into text, line by line.
#[derive(Clone, Debug, Default)]
pub(crate) struct Stamps {
    form: TimeForm,
    first: Option<Instant>,
    before: Option<Instant>,
    /// Unix time of the time axis's zero.
    unix_zero: Duration,
}

const SECONDS_A_DAY: u64 = 24 * 3600;

impl Stamps {
    /// Times in a form. `unix_zero` is the Unix time of a live bus's zero, and zero for a log, whose stamps are Unix times.
    pub(crate) fn new(form: TimeForm, unix_zero: Duration) -> Self {
        Self { form, unix_zero, ..Self::default() }
    }

    /// The text for the next line.
    pub(crate) fn text(&mut self, at: Instant) -> String {
        let first = *self.first.get_or_insert(at);
        let before = self.before.replace(at).unwrap_or(at);
        match self.form {
            TimeForm::Stamp => format!("({:.6})", at.as_secs_f64()),
            TimeForm::Relative => format!("({})", signed(at, first)),
            TimeForm::Delta => format!("({}{})", if at < before { "" } else { "+" }, signed(at, before)),
            TimeForm::Absolute => absolute(Duration::from_nanos((at + self.unix_zero).as_nanos())),
        }
    }
}

/// Seconds from one time to another: the lines of a log need not be in order.
fn signed(at: Instant, from: Instant) -> String {
    let sign = if at < from { "-" } else { "" };
    format!("{sign}{:.6}", (at.max(from) - at.min(from)).as_secs_f64())
}

/// Date and time of day, UTC.
pub(crate) fn absolute(unix: Duration) -> String {
    let (days, seconds) = (unix.as_secs() / SECONDS_A_DAY, unix.as_secs() % SECONDS_A_DAY);
    let (year, month, day) = civil_date(days);
    let (hours, minutes, seconds) = (seconds / 3600, seconds / 60 % 60, seconds % 60);
    format!("{year}-{month:02}-{day:02} {hours:02}:{minutes:02}:{seconds:02}.{:06}", unix.subsec_micros())
}

/// Now, to the minute, for a page that is kept.
pub(crate) fn to_the_minute() -> String {
    let clock = WallClock::start();
    let now = clock.unix_zero() + Duration::from_nanos(clock.now().as_nanos());
    format!("{} UTC", absolute(now).get(..16).unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_written_in_each_form() {
        let times = [1_000_000_000_250_000, 1_000_000_001_500_000, 1_000_000_001_000_000].map(Instant::from_micros);
        let shown = |form| {
            let mut stamps = Stamps::new(form, Duration::ZERO);
            times.map(|at| stamps.text(at))
        };
        assert_eq!(shown(TimeForm::Relative), ["(0.000000)", "(1.250000)", "(0.750000)"]);
        assert_eq!(shown(TimeForm::Delta), ["(+0.000000)", "(+1.250000)", "(-0.500000)"]);
        assert_eq!(shown(TimeForm::Stamp)[0], "(1000000000.250000)");
        // The Unix time 1000000000 was 2001-09-09 01:46:40 UTC.
        assert_eq!(shown(TimeForm::Absolute)[0], "2001-09-09 01:46:40.250000");
    }
}
