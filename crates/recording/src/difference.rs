//! What one record has more than another: the same signals, one less the other.

use super::piece::{Recorded, Series};

impl Recorded {
    /// The signals that both have, at the times of this one: its values less those of `other`, of which two samples are joined by a
    /// straight line. Before the first and behind the last of these there is nothing. What happened is that of this one.
    #[must_use]
    pub fn less(&self, other: &Self) -> Self {
        let series = self.series.iter().filter_map(|one| {
            // The unit is part of a signal's name.
            let is_same = |other: &&Series| {
                other.column.subject == one.column.subject && other.column.signal == one.column.signal
            };
            let other = other.series.iter().find(is_same)?;
            Some(Series { column: one.column.clone(), points: points_less(&one.points, &other.points) })
        });
        Self { series: series.collect(), marks: self.marks.clone(), torn: self.torn || other.torn }
    }
}

fn points_less(points: &[(f64, f64)], others: &[(f64, f64)]) -> Vec<(f64, f64)> {
    // Times ascend in both: the place in `others` does too.
    let mut next = 0;
    let differences = points.iter().filter_map(|(at, value)| {
        while others.get(next).is_some_and(|(time, _)| time < at) {
            next += 1;
        }
        let (right_s, right) = *others.get(next)?;
        if right_s == *at {
            return Some((*at, value - right));
        }
        let (left_s, left) = *others.get(next.checked_sub(1)?)?;
        Some((*at, value - (left + (right - left) * (at - left_s) / (right_s - left_s))))
    });
    differences.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::read_csv;

    fn recorded(text: &str) -> Recorded {
        read_csv(text.as_bytes()).expect("a record")
    }

    /// A square of time less a line, at the times of the square: the line has a third as many samples, and others.
    #[test]
    fn a_signal_less_that_of_another_record_is_known_where_both_are() {
        let square: String =
            (0..=100).map(|n| format!("{},{},{n}\n", f64::from(n) / 100.0, f64::from(n * n) / 1e4)).collect();
        let line: String = (10..40).map(|n| f64::from(n) / 41.0).map(|t| format!("{t},{}\n", 3.0 * t + 1.0)).collect();
        let square = recorded(&format!("t_s,4.velocity_rpm,4.current_a\n{square}"));
        let line = recorded(&format!("t_s,4.velocity_rpm\n{line}"));
        let less = square.less(&line);
        assert_eq!(less.series.len(), 1, "the other one has no current");
        let points = &less.series[0].points;
        let (first_s, last_s) = (10.0 / 41.0, 39.0 / 41.0);
        assert_eq!(points.len(), (0..=100).filter(|n| (first_s..=last_s).contains(&(f64::from(*n) / 100.0))).count());
        for (at, value) in points {
            assert!((value - (at * at - (3.0 * at + 1.0))).abs() < 1e-9, "{at}: {value}");
        }
    }

    #[test]
    fn a_record_less_itself_is_nothing_and_what_is_unknown_stays_so() {
        let one = recorded("t_s,4.velocity_rpm\n0,1\n0.5,NaN\n1,7\n");
        let points = &one.less(&one).series[0].points;
        assert_eq!((points[0], points[2]), ((0.0, 0.0), (1.0, 0.0)));
        assert!(points[1].1.is_nan());
        let other = recorded("t_s,5.velocity_rpm\n0,1\n");
        assert!(one.less(&other).series.is_empty(), "another drive");
    }
}
