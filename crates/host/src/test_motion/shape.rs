//! Test motions as points: where the shaft is to be in each cycle, from rest to rest, within limits that are stated. Pure.
//!
//! In: a shape, the limits of the axis and the cycle. Out: positions in turns from where the shaft is, one for each cycle, of which the
//! first differences keep to the velocity and the second ones to the acceleration; or what it would need, and what fits.

use std::f64::consts::TAU;

use master::group::AxisLimits;

/// The most points of one run: what a stream keeps, less two at its end.
const MOST_POINTS: f64 = 59_998.0;

/// Bits of the register of a pseudo-random binary sequence; its polynomial x^7 + x^6 + 1 gives the longest, 127.
const REGISTER: u32 = 7;

/// A test motion. Angles are turns of the output, frequencies Hz.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// By an angle and back, each way as fast as velocity and acceleration allow, without a jump of the acceleration at its ends
    /// beyond that (a polynomial of the fifth degree).
    BackAndForth {
        /// The angle, in turns.
        by_turns: f64,
    },
    /// Velocity up at the acceleration that is allowed, kept, down, and the same backwards.
    Ramp {
        /// Velocity that is kept, in turns/s.
        velocity_turns_s: f64,
        /// For so long, in s.
        hold_s: f64,
    },
    /// Whole periods of a cosine that begins and ends at rest.
    Sine {
        /// From the middle to either end.
        amplitude_turns: f64,
        /// Periods in a second.
        hz: f64,
        /// Number of periods.
        periods: u32,
    },
    /// As [`Sine`](Self::Sine), with a frequency that rises evenly; the time is lengthened to whole periods, so that it ends at rest.
    Chirp {
        /// From the middle to either end.
        amplitude_turns: f64,
        /// Where it begins.
        from_hz: f64,
        /// Where it ends.
        to_hz: f64,
        /// At least so long.
        duration_s: f64,
    },
    /// A velocity that changes its sign by a pseudo-random binary sequence of 127 bits.
    Prbs {
        /// Velocity either way, in turns/s.
        velocity_turns_s: f64,
        /// Length of a bit.
        bit_s: f64,
    },
    /// A recorded path: time in s and position in turns.
    Path {
        /// Its points, times ascending.
        points: Vec<(f64, f64)>,
    },
}

/// The points of a shape, one for each cycle of `period_s`, relative to the beginning.
///
/// # Errors
/// In a sentence: a value that is not usable, or a limit that it would break, and what fits.
pub fn points(shape: &Shape, limits: &AxisLimits, period_s: f64) -> Result<Vec<f64>, String> {
    check_values(shape)?;
    let (velocity, acceleration) = (limits.velocity_turns_s, limits.acceleration_turns_s2);
    let made = match shape {
        Shape::BackAndForth { by_turns } => {
            // The greatest velocity of s^3 (10 - 15 s + 6 s^2) is 15/8, its greatest acceleration 10 / sqrt(3).
            let way = by_turns.abs();
            let time_s = (1.875 * way / velocity).max((10.0 / 3.0_f64.sqrt() * way / acceleration).sqrt());
            // Whole cycles, and none of them beyond the limits by rounding.
            let time_s = (time_s / period_s).ceil().max(2.0) * period_s;
            let part = |s: f64| s * s * s * (10.0 + s * (6.0 * s - 15.0));
            sampled(2.0 * time_s, period_s, |at| {
                if at <= time_s { by_turns * part(at / time_s) } else { by_turns * (1.0 - part(at / time_s - 1.0)) }
            })?
        }
        Shape::Ramp { velocity_turns_s, hold_s } => {
            let speeds = [*velocity_turns_s, -velocity_turns_s, 0.0];
            let changes = speeds.map(|speed| (speed, if speed == 0.0 { 0.0 } else { *hold_s }));
            integrated(&changes, acceleration, period_s)?
        }
        Shape::Sine { amplitude_turns, hz, periods } => {
            let time_s = f64::from(*periods) / hz;
            sampled(time_s, period_s, |at| amplitude_turns * (1.0 - (TAU * hz * at).cos()))?
        }
        Shape::Chirp { amplitude_turns, from_hz, to_hz, duration_s } => {
            let periods = (0.5 * (from_hz + to_hz) * duration_s).ceil().max(1.0);
            let time_s = 2.0 * periods / (from_hz + to_hz);
            let phase = |at: f64| TAU * (from_hz * at + 0.5 * (to_hz - from_hz) / time_s * at * at);
            sampled(time_s, period_s, |at| amplitude_turns * (1.0 - phase(at).cos()))?
        }
        Shape::Prbs { velocity_turns_s, bit_s } => {
            if 2.0 * velocity_turns_s / acceleration > *bit_s {
                return Err(format!(
                    "a change of sign takes {:.4} s at the acceleration that is allowed, and a bit {bit_s} s: give longer bits, a lower \
                     velocity or a higher acceleration",
                    2.0 * velocity_turns_s / acceleration
                ));
            }
            let bits = prbs().into_iter().map(|bit| (if bit { *velocity_turns_s } else { -velocity_turns_s }, *bit_s));
            // A bit lasts from change to change.
            let mut before = 0.0;
            let changes = bits.chain([(0.0, 0.0)]).map(|(speed, time_s)| {
                let change_s = (speed - before).abs() / acceleration;
                before = speed;
                (speed, (time_s - change_s).max(0.0))
            });
            integrated(&changes.collect::<Vec<_>>(), acceleration, period_s)?
        }
        Shape::Path { points } => {
            let (begin_s, begin) = points[0];
            let end_s = points[points.len() - 1].0;
            sampled(end_s - begin_s, period_s, |at| between(points, begin_s + at) - begin)?
        }
    };
    within(&made, limits, period_s)?;
    Ok(made)
}

fn check_values(shape: &Shape) -> Result<(), String> {
    let above = |what: &str, value: f64| {
        if value.is_finite() && value > 0.0 { Ok(()) } else { Err(format!("expected a {what} above 0, got {value}")) }
    };
    match shape {
        Shape::BackAndForth { by_turns } => above("distance", by_turns.abs()),
        Shape::Ramp { velocity_turns_s, hold_s } => {
            above("velocity", velocity_turns_s.abs())?;
            if hold_s.is_finite() && *hold_s >= 0.0 {
                Ok(())
            } else {
                Err(format!("expected a time to hold, got {hold_s} s"))
            }
        }
        Shape::Sine { amplitude_turns, hz, periods } => {
            above("amplitude", amplitude_turns.abs())?;
            above("frequency", *hz)?;
            above("number of periods", f64::from(*periods))
        }
        Shape::Chirp { amplitude_turns, from_hz, to_hz, duration_s } => {
            above("amplitude", amplitude_turns.abs())?;
            above("first frequency", *from_hz)?;
            above("last frequency", *to_hz)?;
            above("duration", *duration_s)
        }
        Shape::Prbs { velocity_turns_s, bit_s } => {
            above("velocity", *velocity_turns_s)?;
            above("bit", *bit_s)
        }
        Shape::Path { points } => {
            let is_ascending = points.windows(2).all(|pair| pair[1].0 > pair[0].0);
            let is_finite = points.iter().all(|(at, position)| at.is_finite() && position.is_finite());
            match points.len() {
                0 | 1 => Err(format!("a path of {} points leads nowhere, expected 2 or more", points.len())),
                _ if !is_finite => Err("the path has a point that is not a number".to_owned()),
                _ if !is_ascending => Err("the times of the path do not ascend".to_owned()),
                _ => Ok(()),
            }
        }
    }
}

/// Positions at the end of each cycle until `time_s` has passed.
fn sampled(time_s: f64, period_s: f64, position: impl Fn(f64) -> f64) -> Result<Vec<f64>, String> {
    let cycles = (time_s / period_s - 1e-9).ceil().max(1.0);
    if cycles > MOST_POINTS {
        return Err(format!(
            "it would take {time_s:.1} s, {cycles} cycles; at most {MOST_POINTS} are possible: make it shorter, or the cycle longer"
        ));
    }
    Ok((1..=cycles as u32).map(|cycle| position((f64::from(cycle) * period_s).min(time_s))).collect())
}

/// The way of velocities that are reached at this acceleration from the one before, and kept for a time each.
fn integrated(speeds: &[(f64, f64)], acceleration: f64, period_s: f64) -> Result<Vec<f64>, String> {
    // Begins of pieces: time, position, velocity and acceleration there.
    let mut pieces = vec![(0.0, 0.0, 0.0, 0.0)];
    let (mut at_s, mut position, mut speed) = (0.0, 0.0, 0.0);
    for (next, keep_s) in speeds {
        let change_s = (next - speed).abs() / acceleration;
        for (time_s, rate) in [(change_s, (next - speed).signum() * acceleration), (*keep_s, 0.0)] {
            if time_s > 0.0 {
                pieces.push((at_s, position, speed, rate));
                position += speed * time_s + 0.5 * rate * time_s * time_s;
                speed += rate * time_s;
                at_s += time_s;
            }
        }
        speed = *next;
    }
    sampled(at_s, period_s, |at| {
        let piece = pieces.partition_point(|(begin_s, ..)| *begin_s <= at).saturating_sub(1);
        let (begin_s, position, speed, rate) = pieces[piece];
        let since = at - begin_s;
        position + speed * since + 0.5 * rate * since * since
    })
}

/// The longest sequence of a register of seven bits: 64 ones and 63 zeros.
fn prbs() -> Vec<bool> {
    let mut register: u32 = 1;
    let length = (1 << REGISTER) - 1;
    let bits = (0..length).map(|_| {
        let bit = (register >> (REGISTER - 1) ^ register >> (REGISTER - 2)) & 1;
        register = (register << 1 | bit) & length;
        bit == 1
    });
    bits.collect()
}

/// The value of the lines between points.
fn between(points: &[(f64, f64)], at_s: f64) -> f64 {
    let right = points.partition_point(|(time, _)| *time < at_s).clamp(1, points.len() - 1);
    let ((t0, v0), (t1, v1)) = (points[right - 1], points[right]);
    v0 + (v1 - v0) * ((at_s - t0) / (t1 - t0)).clamp(0.0, 1.0)
}

/// Holds the differences to the limits, from rest to rest.
fn within(points: &[f64], limits: &AxisLimits, period_s: f64) -> Result<(), String> {
    let (mut position, mut speed, mut fastest, mut hardest) = (0.0, 0.0, 0.0_f64, 0.0_f64);
    for point in points.iter().chain(points.last()) {
        let next = (point - position) / period_s;
        (fastest, hardest) = (fastest.max(next.abs()), hardest.max((next - speed).abs() / period_s));
        (position, speed) = (*point, next);
    }
    let too_much = |what: &str, needs: f64, allowed: f64, unit: &str| {
        format!(
            "it would need {what} of {:.1} {unit}, and {:.1} {unit} are allowed: give it a smaller amplitude or more time, or raise the \
             limit",
            needs * 60.0,
            allowed * 60.0
        )
    };
    // A shape at its limit passes it by rounding.
    if fastest > limits.velocity_turns_s * (1.0 + 1e-6) {
        return Err(too_much("a velocity", fastest, limits.velocity_turns_s, "r/min"));
    }
    if hardest > limits.acceleration_turns_s2 * (1.0 + 1e-6) {
        return Err(too_much("an acceleration", hardest, limits.acceleration_turns_s2, "(r/min)/s"));
    }
    match points.iter().find(|point| !point.is_finite()) {
        Some(point) => Err(format!("it has a point that is {point}")),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_S: f64 = 0.002;

    fn limits() -> AxisLimits {
        AxisLimits { velocity_turns_s: 1.0, acceleration_turns_s2: 10.0, ..AxisLimits::careful() }
    }

    fn made(shape: &Shape) -> Vec<f64> {
        points(shape, &limits(), PERIOD_S).unwrap_or_else(|why| panic!("{shape:?}: {why}"))
    }

    fn fastest(points: &[f64]) -> f64 {
        points.windows(2).map(|pair| (pair[1] - pair[0]).abs() / PERIOD_S).fold(0.0, f64::max)
    }

    #[test]
    fn back_and_forth_takes_the_least_time_of_its_polynomial_and_ends_where_it_began() {
        // By the velocity: 15/8 of the way over it.
        let far = made(&Shape::BackAndForth { by_turns: -2.0 });
        assert!((far.len() as f64 * PERIOD_S - 2.0 * 1.875 * 2.0).abs() <= 2.0 * PERIOD_S);
        assert!(far.last().unwrap().abs() < 1e-12 && (far[far.len() / 2 - 1] + 2.0).abs() < 1e-12);
        assert!((fastest(&far) - 1.0).abs() < 1e-3);
        // By the acceleration: the root of 10/sqrt(3) of the way over it.
        let near = made(&Shape::BackAndForth { by_turns: 0.1 });
        let each_s = (10.0 / 3.0_f64.sqrt() * 0.1 / 10.0).sqrt();
        assert!((near.len() as f64 * PERIOD_S - 2.0 * each_s).abs() <= 2.0 * PERIOD_S);
    }

    #[test]
    fn a_ramp_has_the_way_of_its_trapezoid() {
        let ramp = made(&Shape::Ramp { velocity_turns_s: 0.8, hold_s: 0.5 });
        // Up in 0.08 s, kept for 0.5 s, and half of the reversal: 0.8 (0.04 + 0.5 + 0.04).
        let top = ramp.iter().copied().fold(0.0, f64::max);
        assert!((top - 0.8 * 0.58).abs() < 1e-3, "{top}");
        assert!(ramp.last().unwrap().abs() < 1e-9, "back where it began");
    }

    #[test]
    fn sine_and_chirp_begin_and_end_at_rest_within_twice_their_amplitude() {
        let sine = Shape::Sine { amplitude_turns: 0.02, hz: 2.0, periods: 3 };
        let chirp = Shape::Chirp { amplitude_turns: 0.001, from_hz: 1.0, to_hz: 12.0, duration_s: 2.0 };
        for (shape, amplitude, crossings) in [(sine, 0.02, 6), (chirp, 0.001, 26)] {
            let points = made(&shape);
            assert!(points.last().unwrap().abs() < 1e-9, "{shape:?}");
            let top = points.iter().copied().fold(0.0, f64::max);
            assert!((top / (2.0 * amplitude) - 1.0).abs() < 0.02, "{shape:?}: {top}");
            let sides: Vec<bool> = points.iter().map(|point| *point > amplitude).collect();
            assert_eq!(sides.windows(2).filter(|pair| pair[0] != pair[1]).count(), crossings, "{shape:?}");
        }
    }

    #[test]
    fn the_sequence_is_the_longest_of_its_register() {
        let bits = prbs();
        assert_eq!((bits.len(), bits.iter().filter(|bit| **bit).count()), (127, 64));
        // Its autocorrelation is two-valued: +127 at no shift, -1 at every other.
        for shift in 1..127 {
            let same = (0..127).filter(|at| bits[*at] == bits[(at + shift) % 127]).count() as i32;
            assert_eq!(same - (127 - same), -1, "{shift}");
        }
        let points = made(&Shape::Prbs { velocity_turns_s: 0.2, bit_s: 0.1 });
        assert!((points.len() as f64 * PERIOD_S - 12.7).abs() < 0.1, "{}", points.len());
        assert!((fastest(&points) - 0.2).abs() < 1e-9);
    }

    #[test]
    fn a_recorded_path_keeps_its_times() {
        let recorded: Vec<(f64, f64)> = (0..=100)
            .map(|at| f64::from(at) / 100.0)
            .map(|at| (5.0 + at, 3.0 + 0.5 * at * at * (1.0 - at).powi(2)))
            .collect();
        let points = made(&Shape::Path { points: recorded });
        assert_eq!(points.len(), 500);
        // Its highest place is in its middle: 0.5 / 16.
        assert!((points[249] - 0.031_25).abs() < 1e-5 && points[499].abs() < 1e-9);
    }

    #[test]
    fn what_breaks_a_limit_or_is_not_a_number_is_refused_with_what_fits() {
        let refused = |shape: Shape| points(&shape, &limits(), PERIOD_S).unwrap_err();
        let sine = refused(Shape::Sine { amplitude_turns: 1.0, hz: 1.0, periods: 1 });
        assert!(sine.contains("a velocity of 377.0 r/min, and 60.0 r/min are allowed"), "{sine}");
        let hard = refused(Shape::Sine { amplitude_turns: 0.02, hz: 5.0, periods: 1 });
        assert!(hard.contains("an acceleration of"), "{hard}");
        assert!(refused(Shape::Prbs { velocity_turns_s: 0.9, bit_s: 0.05 }).contains("0.1800 s at the acceleration"));
        assert!(refused(Shape::BackAndForth { by_turns: f64::NAN }).contains("got NaN"));
        assert!(refused(Shape::Sine { amplitude_turns: 1e-6, hz: 0.001, periods: 1 }).contains("at most 59998"));
        assert!(refused(Shape::Path { points: vec![(0.0, 0.0)] }).contains("leads nowhere"));
        assert!(refused(Shape::Path { points: vec![(0.0, 0.0), (1.0, f64::NAN)] }).contains("not a number"));
        assert!(refused(Shape::Path { points: vec![(0.0, 0.0), (0.0, 1.0)] }).contains("do not ascend"));
        // A path that jumps, and one that ends in motion.
        assert!(refused(Shape::Path { points: vec![(0.0, 0.0), (0.1, 1.0)] }).contains("a velocity of 600.0"));
        assert!(refused(Shape::Path { points: vec![(0.0, 0.0), (1.0, 0.5)] }).contains("an acceleration of"));
    }
}
