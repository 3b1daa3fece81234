//! Readings in rows, and the trigger that cuts a capture out of them. Pure: times come with the readings.
//!
//! Readings of several TPDOs belong to one row if they come within half a period of the first of them and each quantity has one: they
//! were taken together, and travelled one after the other. The time of a row is that of its first reading's frame.

use std::collections::VecDeque;
use std::str::FromStr;
use std::time::Duration;

use can::Instant;

/// Rows that are being collected, the oldest of which are left out again while nothing has triggered.
#[derive(Clone, Debug)]
pub(super) struct Rows {
    width: usize,
    together: Duration,
    times: VecDeque<Instant>,
    /// A row after the other.
    values: VecDeque<f64>,
}

impl Rows {
    /// Of so many quantities that come with this period.
    pub(super) fn new(width: usize, period: Duration) -> Self {
        Self { width, together: period / 2, times: VecDeque::new(), values: VecDeque::new() }
    }

    /// Readings of some quantities at one time: their columns and values. True if a new row begins with them.
    pub(super) fn add(&mut self, at: Instant, readings: impl Iterator<Item = (usize, f64)> + Clone) -> bool {
        let joins = self.times.back().is_some_and(|last| {
            let row = self.values.len() - self.width;
            at - *last < self.together && readings.clone().all(|(column, _)| self.values[row + column].is_nan())
        });
        if !joins {
            self.times.push_back(at.max(self.newest()));
            self.values.resize(self.values.len() + self.width, f64::NAN);
        }
        let from = self.values.len() - self.width;
        for (column, value) in readings {
            self.values[from + column] = value;
        }
        !joins
    }

    /// How many there are.
    pub(super) fn len(&self) -> usize {
        self.times.len()
    }

    /// True before the first.
    pub(super) fn is_empty(&self) -> bool {
        self.times.is_empty()
    }

    /// Time of the last one; the begin of all before the first.
    pub(super) fn newest(&self) -> Instant {
        self.times.back().copied().unwrap_or_default()
    }

    /// Time of a row.
    pub(super) fn time(&self, number: usize) -> Instant {
        self.times[number]
    }

    /// Value of a column in a row; not a number without a reading.
    pub(super) fn value(&self, number: usize, column: usize) -> f64 {
        self.values[number * self.width + column]
    }

    /// Leaves out what is older than `from`: as much work as there are rows that go, however many stay.
    pub(super) fn forget_before(&mut self, from: Instant) {
        let keep = self.times.partition_point(|at| *at < from);
        self.times.drain(..keep);
        self.values.drain(..keep * self.width);
    }

    /// Times from the first on in s, and the values of each column.
    pub(super) fn columns(&self, begin: Instant) -> (Vec<f64>, Vec<Vec<f64>>) {
        let time_s = self.times.iter().map(|at| (*at - begin).as_secs_f64()).collect();
        let column = |column: usize| self.values.iter().skip(column).step_by(self.width).copied().collect();
        (time_s, (0..self.width).map(column).collect())
    }
}

/// When a capture begins: a quantity passes a level.
#[derive(Clone, Debug, PartialEq)]
pub struct Trigger {
    /// The quantity, as it was asked for.
    pub quantity: String,
    /// The level, in its unit.
    pub level: f64,
    /// It passes upwards, or downwards.
    pub rising: bool,
}

impl FromStr for Trigger {
    type Err = String;

    /// `velocity > 10`: it rises above 10; `velocity < 10`: it falls below.
    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || {
            format!("'{text}' is not a trigger; expected QUANTITY > NUMBER or QUANTITY < NUMBER, as in: velocity > 10")
        };
        let (at, sign) = text.char_indices().find(|(_, c)| ['<', '>'].contains(c)).ok_or_else(wrong)?;
        let (quantity, level) = (text[..at].trim(), text[at + 1..].trim());
        let level: f64 = level.parse().ok().filter(|level: &f64| level.is_finite()).ok_or_else(wrong)?;
        if quantity.is_empty() {
            Err(wrong())
        } else {
            Ok(Self { quantity: quantity.to_owned(), level, rising: sign == '>' })
        }
    }
}

/// A trigger that watches one quantity.
#[derive(Clone, Debug)]
pub(super) struct Armed {
    level: f64,
    rising: bool,
    /// On which side the last reading was; `None` before the first.
    beyond: Option<bool>,
}

impl Armed {
    /// Waits for the quantity to pass the level from now on.
    pub(super) const fn new(trigger: &Trigger) -> Self {
        Self { level: trigger.level, rising: trigger.rising, beyond: None }
    }

    /// True for the reading with which the level is passed. What is beyond it from the first on has not passed it.
    pub(super) fn passes(&mut self, value: f64) -> bool {
        if value.is_nan() {
            return false;
        }
        let beyond = if self.rising { value > self.level } else { value < self.level };
        self.beyond.replace(beyond) == Some(false) && beyond
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn us(us: u64) -> Instant {
        Instant::from_nanos(us * 1000)
    }

    #[test]
    fn readings_that_were_taken_together_are_one_row() {
        let mut rows = Rows::new(3, Duration::from_millis(1));
        let two = |a: f64, b: f64| [(0, a), (1, b)].into_iter();
        assert!(rows.add(us(1000), two(1.0, 2.0)));
        assert!(!rows.add(us(1250), [(2, 3.0)].into_iter()));
        // The next comes early, but the row has its quantity already.
        assert!(rows.add(us(1400), two(4.0, 5.0)));
        // The third one is lost, and its successor belongs to the next row.
        assert!(rows.add(us(2900), [(2, 6.0)].into_iter()));
        let (time_s, columns) = rows.columns(us(1000));
        assert_eq!(time_s, [0.0, 0.0004, 0.0019]);
        assert_eq!(columns[0][..2], [1.0, 4.0]);
        assert!(columns[0][2].is_nan() && columns[2][1].is_nan() && columns[2][2] == 6.0);
        rows.forget_before(us(1400));
        assert_eq!((rows.len(), rows.time(0)), (2, us(1400)));
    }

    #[test]
    fn a_trigger_is_an_edge_and_not_a_level() {
        let passes = |text: &str, values: &[f64]| {
            let mut armed = Armed::new(&text.parse().expect("a trigger"));
            values.iter().map(|value| armed.passes(*value)).collect::<Vec<_>>()
        };
        assert_eq!(
            passes("velocity > 10", &[5.0, 10.0, 10.5, 12.0, 9.0, 11.0]),
            [false, false, true, false, false, true]
        );
        assert_eq!(passes("velocity > 10", &[20.0, f64::NAN, 20.0]), [false; 3]);
        assert_eq!(passes("current<-1.5", &[0.0, -2.0]), [false, true]);
    }

    #[test]
    fn a_text_that_is_not_a_trigger_is_refused() {
        for text in ["", "velocity", "velocity > ", "> 10", "velocity > fast", "velocity > NaN", "velocity > inf"] {
            assert!(text.parse::<Trigger>().is_err_and(|why| why.contains("as in: velocity > 10")), "{text:?}");
        }
        let spaced: Trigger = " velocity_demand <  -3e1 ".parse().expect("a trigger");
        assert_eq!((spaced.quantity.as_str(), spaced.level, spaced.rising), ("velocity_demand", -30.0, false));
    }
}
