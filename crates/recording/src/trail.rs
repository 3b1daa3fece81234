//! The last of a run, for a picture of how it came to its state: a few signals, as far back as requested, in memory.

use std::collections::VecDeque;
use std::time::Duration;

use can::Instant;
use sim::recorder::Signal;

use super::column::{Column, Subject};
use super::piece::{Mark, Recorded, Series, Severity};

/// What is kept of an axis: what a picture shows, and its faults.
const KEPT: [Signal; 8] = [
    Signal::Position,
    Signal::PositionDemand,
    Signal::Velocity,
    Signal::VelocityDemand,
    Signal::Current,
    Signal::CurrentDemand,
    Signal::Supply,
    Signal::ErrorCode,
];

/// The last seconds of a run.
#[derive(Clone, Debug)]
pub struct Trail {
    keep: Duration,
    period: Duration,
    next_at: Instant,
    times: VecDeque<Instant>,
    lines: Vec<SignalTrail>,
}

/// One signal: a value for each time, not a number where there is none.
#[derive(Clone, Debug)]
struct SignalTrail {
    column: Column,
    values: VecDeque<f64>,
}

impl Trail {
    /// A trail of the last `keep`, with a sample every `period` or as often as there is one.
    pub fn new(keep: Duration, period: Duration) -> Self {
        Self { keep, period, next_at: Instant::ZERO, times: VecDeque::new(), lines: Vec::new() }
    }

    /// The signals of an axis that it keeps.
    pub fn signals() -> impl Iterator<Item = Signal> {
        KEPT.into_iter()
    }

    /// Takes what was sampled: of each time the values, in the order of `columns`. A time before the last one takes back what
    /// came after it.
    pub fn take<'a>(&mut self, columns: &[Column], rows: impl Iterator<Item = (Instant, &'a [f64])>) {
        let places: Vec<Option<usize>> = columns.iter().map(|column| self.place_of(column)).collect();
        for (at, values) in rows {
            if self.times.back().is_some_and(|last| at <= *last) {
                self.go_back_to(at);
            }
            if at < self.next_at {
                continue;
            }
            self.next_at = at + self.period;
            self.times.push_back(at);
            let have = self.times.len();
            for (place, value) in places.iter().zip(values) {
                if let Some(line) = place.and_then(|place| self.lines.get_mut(place)) {
                    line.values.push_back(*value);
                }
            }
            // What is not sampled any more has no value now.
            self.lines.iter_mut().for_each(|line| line.values.resize(have, f64::NAN));
            self.forget();
        }
    }

    /// What it holds, as if read from a file; where an error code came or went there is a mark.
    pub fn recorded(&self) -> Recorded {
        let series: Vec<Series> = self.lines.iter().map(|line| self.series(line)).collect();
        let marks = series.iter().filter(|series| series.column.signal == Signal::ErrorCode.name()).flat_map(faults);
        Recorded { marks: marks.collect(), series, torn: false }
    }

    /// Where the signal is kept, which is made room for; `None` if it is not.
    fn place_of(&mut self, column: &Column) -> Option<usize> {
        let wanted = match column.subject {
            Subject::Axis(_) => KEPT.iter().any(|signal| signal.name() == column.signal),
            Subject::Body(_) => true,
        };
        if !wanted {
            return None;
        }
        let known = self.lines.iter().position(|line| line.column == *column);
        Some(known.unwrap_or_else(|| {
            let values = std::iter::repeat_n(f64::NAN, self.times.len()).collect();
            self.lines.push(SignalTrail { column: column.clone(), values });
            self.lines.len() - 1
        }))
    }

    fn go_back_to(&mut self, at: Instant) {
        let kept = self.times.partition_point(|time| *time < at);
        self.times.truncate(kept);
        self.lines.iter_mut().for_each(|line| line.values.truncate(kept));
        self.next_at = at;
    }

    fn forget(&mut self) {
        let Some(last) = self.times.back().copied() else { return };
        while self.times.front().is_some_and(|first| *first + self.keep < last) {
            self.times.pop_front();
            self.lines.iter_mut().for_each(|line| {
                line.values.pop_front();
            });
        }
    }

    fn series(&self, line: &SignalTrail) -> Series {
        let points = self.times.iter().zip(&line.values).map(|(at, value)| (at.as_secs_f64(), *value));
        Series { column: line.column.clone(), points: points.collect() }
    }
}

/// A mark at each change of an error code.
fn faults(series: &Series) -> Vec<Mark> {
    let mut before = 0.0;
    let mut marks = Vec::new();
    for (at_s, code) in series.points.iter().filter(|(_, code)| code.is_finite()) {
        if *code != before {
            let (severity, text) = match *code as u32 {
                0 => (Severity::Note, "no fault".to_owned()),
                code => (Severity::Fault, format!("fault {code:04X}h")),
            };
            let at = Instant::from_nanos((at_s * 1e9).round() as u64);
            let of = series.column.subject.title().into();
            marks.push(Mark { at, of, kind: "fault".into(), severity, text });
        }
        before = *code;
    }
    marks
}

#[cfg(test)]
mod tests {
    use super::*;

    fn columns(names: &[&str]) -> Vec<Column> {
        names.iter().map(|name| name.parse().unwrap()).collect()
    }

    fn fill(trail: &mut Trail, names: &[&str], ms: std::ops::Range<u64>, value: impl Fn(u64) -> f64) {
        let rows: Vec<(Instant, Vec<f64>)> =
            ms.map(|ms| (Instant::from_millis(ms), vec![value(ms); names.len()])).collect();
        trail.take(&columns(names), rows.iter().map(|(at, values)| (*at, &**values)));
    }

    fn times_and_values(trail: &Trail, name: &str) -> (f64, f64, usize, f64) {
        let recorded = trail.recorded();
        let series = recorded.series.iter().find(|series| series.column.name() == name).expect("a series");
        let (first, last) = (series.points[0], series.points[series.points.len() - 1]);
        (first.0, last.0, series.points.len(), last.1)
    }

    #[test]
    fn a_long_run_leaves_its_last_second_and_no_more() {
        let mut trail = Trail::new(Duration::from_secs(1), Duration::from_millis(10));
        fill(&mut trail, &["4.velocity_rpm", "4.statusword", "base.x_m"], 0..100_000, |ms| ms as f64);
        assert_eq!(times_and_values(&trail, "4.velocity_rpm"), (98.99, 99.99, 101, 99_990.0));
        assert_eq!(times_and_values(&trail, "base.x_m").2, 101);
        assert_eq!(trail.recorded().series.len(), 2, "a statusword is nothing to draw");
    }

    #[test]
    fn a_drive_that_comes_later_or_goes_has_no_value_meanwhile() {
        let mut trail = Trail::new(Duration::from_secs(9), Duration::from_millis(10));
        fill(&mut trail, &["4.supply_v"], 0..100, |_| 48.0);
        fill(&mut trail, &["4.supply_v", "5.supply_v"], 100..200, |_| 24.0);
        fill(&mut trail, &["5.supply_v"], 200..300, |_| 12.0);
        let recorded = trail.recorded();
        let values = |n: usize| recorded.series[n].points.iter().map(|(_, value)| *value).collect::<Vec<_>>();
        assert_eq!((values(0).len(), values(1).len()), (30, 30));
        assert_eq!((values(0)[0], values(0)[19]), (48.0, 24.0));
        assert!(values(0)[20].is_nan() && values(1)[9].is_nan());
        assert_eq!((values(1)[10], values(1)[29]), (24.0, 12.0));
    }

    #[test]
    fn a_time_before_the_last_takes_back_what_came_after_it() {
        let mut trail = Trail::new(Duration::from_secs(9), Duration::from_millis(10));
        fill(&mut trail, &["4.current_a"], 0..1000, |_| 1.0);
        fill(&mut trail, &["4.current_a"], 500..700, |_| 2.0);
        assert_eq!(times_and_values(&trail, "4.current_a"), (0.0, 0.69, 70, 2.0));
    }

    #[test]
    fn faults_are_marked_where_they_come_and_go() {
        let mut trail = Trail::new(Duration::from_secs(9), Duration::from_millis(1));
        fill(&mut trail, &["4.error_code"], 0..100, |ms| if (20..50).contains(&ms) { 2.0 } else { 0.0 });
        let marks: Vec<_> = trail.recorded().marks.iter().map(|mark| (mark.at.as_nanos(), mark.text.clone())).collect();
        assert_eq!(marks, [(20_000_000, "fault 0002h".to_owned()), (50_000_000, "no fault".to_owned())]);
    }
}
