//! Figures of merit of a response, with what the sampling can show: no figure without the readings to see it in.
//!
//! In: times in s and values, as a capture has them. Out: rise, overshoot and settling of a step; following error, r.m.s. current and
//! its heat of any motion. Pure.
//!
//! A step is judged from its demand: it is at rest, at `from`, before the time at which the demand changes, and settles at `to`. The rise
//! is the time from 10 % to 90 % of the step; the overshoot is the greatest excess over `to` as a fraction of the step; it has settled
//! when it stays within 2 % of the step around `to`, counted from the change of the demand.

use serde::Serialize;

/// Least readings between 10 % and 90 % of a step, without which nothing is said of its rise.
const FEWEST_IN_RISE: usize = 10;
/// Least readings beyond the end of a step, without which nothing is said of its overshoot.
const FEWEST_IN_PEAK: usize = 5;
/// Settled: within this fraction of the step.
const BAND: f64 = 0.02;

/// A figure with its uncertainty, or why there is none.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Figure {
    /// What it is, plus or minus what the sampling leaves open.
    Is {
        /// The value.
        value: f64,
        /// Its uncertainty.
        grid: f64,
    },
    /// Why it cannot be said.
    Unknown {
        /// A sentence.
        why: String,
    },
}

/// Figures of a step.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Step {
    /// Where it begins, in the unit of the values.
    pub from: f64,
    /// Where it ends.
    pub to: f64,
    /// From 10 % to 90 % of the step, in s.
    pub rise_s: Figure,
    /// The greatest excess over the end, as a fraction of the step.
    pub overshoot: Figure,
    /// From the change of the demand until it stays within 2 %, in s.
    pub settling_s: Figure,
}

/// How far an actual value was from its demand.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Following {
    /// The greatest distance, in the unit of the values.
    pub most: f64,
    /// Root of the mean of its square, over the time.
    pub rms: f64,
}

/// What a current does.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Heating {
    /// Root of the mean of its square over the time, in A.
    pub rms_a: f64,
    /// Integral of its square over the time, in A²·s: times the resistance of the winding, its heat in J.
    pub a2s: f64,
}

/// Figures of a step from `from` to `to` whose demand changed at `at_s`; times ascend.
///
/// # Errors
/// A sentence: it is not a step, or there are too few readings for any figure.
pub fn step(points: &[(f64, f64)], at_s: f64, from: f64, to: f64) -> Result<Step, String> {
    let way = to - from;
    if !way.is_finite() || way == 0.0 {
        return Err(format!("from {from} to {to} is not a step"));
    }
    let part = |value: f64| (value - from) / way;
    let after: Vec<(f64, f64)> =
        points.iter().filter(|(at, _)| *at >= at_s).map(|(at, value)| (*at, part(*value))).collect();
    if after.len() < 2 {
        return Err(format!("{} readings follow the change of the demand, expected 2 or more", after.len()));
    }
    let widest = after.windows(2).map(|pair| pair[1].0 - pair[0].0).fold(0.0, f64::max);
    let (low, high) = (passing(&after, 0.1), passing(&after, 0.9));
    let rise_s = match low.zip(high) {
        None => unknown(format!("it does not reach 90 % of the step: {:.0} %", 100.0 * most(&after))),
        Some((low, high)) => {
            let inside = after.iter().filter(|(at, _)| *at >= low && *at <= high).count();
            match inside {
                FEWEST_IN_RISE.. => Figure::Is { value: high - low, grid: widest },
                few => unknown(format!("{few} readings lie in the rise, {FEWEST_IN_RISE} are needed: capture faster")),
            }
        }
    };
    Ok(Step { from, to, rise_s, overshoot: overshoot(&after), settling_s: settling(&after, at_s, widest) })
}

fn unknown(why: String) -> Figure {
    Figure::Unknown { why }
}

fn most(parts: &[(f64, f64)]) -> f64 {
    parts.iter().map(|(_, part)| *part).fold(f64::NEG_INFINITY, f64::max)
}

/// When the line through the readings first comes to a level from below.
fn passing(parts: &[(f64, f64)], level: f64) -> Option<f64> {
    if parts.first()?.1 >= level {
        return Some(parts[0].0);
    }
    let pair = parts.windows(2).find(|pair| pair[0].1 < level && pair[1].1 >= level)?;
    let ((t0, v0), (t1, v1)) = (pair[0], pair[1]);
    Some(t0 + (t1 - t0) * (level - v0) / (v1 - v0))
}

/// The highest reading beyond the end; its neighbours bound what a peak between them may be higher.
fn overshoot(parts: &[(f64, f64)]) -> Figure {
    let Some(peak) = (0..parts.len()).max_by(|a, b| parts[*a].1.total_cmp(&parts[*b].1)) else {
        return unknown("there are no readings".to_owned());
    };
    let over = parts[peak].1 - 1.0;
    if over <= 0.0 {
        // What ends below the band has shown no more than that it did not come so far.
        return if over < -BAND {
            unknown(format!("it does not reach the end of the step: {:.0} %", 100.0 * parts[peak].1))
        } else {
            Figure::Is { value: 0.0, grid: BAND }
        };
    }
    let left = parts[..peak].iter().rev().take_while(|(_, part)| *part > 1.0).count();
    let right = parts[peak..].iter().take_while(|(_, part)| *part > 1.0).count();
    if left + right < FEWEST_IN_PEAK {
        let why = format!("{} readings lie beyond the end, {FEWEST_IN_PEAK} are needed: capture faster", left + right);
        return unknown(why);
    }
    let lower = |at: Option<usize>| at.and_then(|at| parts.get(at)).map_or(0.0, |(_, part)| parts[peak].1 - part);
    let grid = lower(peak.checked_sub(1)).max(lower(Some(peak + 1)));
    Figure::Is { value: over, grid }
}

fn settling(parts: &[(f64, f64)], at_s: f64, widest: f64) -> Figure {
    let outside = parts.iter().rposition(|(_, part)| (part - 1.0).abs() > BAND);
    match outside {
        None => Figure::Is { value: 0.0, grid: widest },
        Some(last) if last + 1 == parts.len() => {
            unknown(format!("it is at {:.1} % of the step at the end of the capture", 100.0 * parts[last].1))
        }
        Some(last) => {
            let ((t0, v0), (t1, v1)) = (parts[last], parts[last + 1]);
            let edge = 1.0 + BAND * (v0 - 1.0).signum();
            let into = if v1 == v0 { t1 } else { t0 + (t1 - t0) * (edge - v0) / (v1 - v0) };
            Figure::Is { value: into.clamp(t0, t1) - at_s, grid: widest }
        }
    }
}

/// How far `actual` was from `demand`, which has a value at each time; a time at which one of both is not a number does not count.
/// `None` where there is no such time.
pub fn following(time_s: &[f64], demand: &[f64], actual: &[f64]) -> Option<Following> {
    let errors = time_s.iter().zip(demand.iter().zip(actual)).map(|(at, (demand, actual))| (*at, demand - actual));
    let errors: Vec<(f64, f64)> = errors.filter(|(_, error)| error.is_finite()).collect();
    let most = errors.iter().map(|(_, error)| error.abs()).reduce(f64::max)?;
    Some(Following { most, rms: mean_square(&errors)?.sqrt() })
}

/// What a current did over its time. `None` with fewer than two readings.
pub fn heating(points: &[(f64, f64)]) -> Option<Heating> {
    let square = mean_square(points)?;
    let span_s = points.last()?.0 - points.first()?.0;
    (points.len() > 1).then(|| Heating { rms_a: square.sqrt(), a2s: square * span_s })
}

/// The mean of the square over the time, exactly for the lines between the readings; of one reading its square.
fn mean_square(points: &[(f64, f64)]) -> Option<f64> {
    let (first, last) = (points.first()?, points.last()?);
    let span_s = last.0 - first.0;
    if span_s <= 0.0 {
        return Some(first.1 * first.1);
    }
    let pieces = points.windows(2).map(|pair| {
        let ((t0, v0), (t1, v1)) = (pair[0], pair[1]);
        (t1 - t0) * (v0 * v0 + v0 * v1 + v1 * v1) / 3.0
    });
    Some(pieces.sum::<f64>() / span_s)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sampled(period_s: f64, until_s: f64, value: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
        (0..=(until_s / period_s) as u32)
            .map(|at| (f64::from(at) * period_s, value(f64::from(at) * period_s)))
            .collect()
    }

    fn is(figure: &Figure) -> (f64, f64) {
        match figure {
            Figure::Is { value, grid } => (*value, *grid),
            Figure::Unknown { why } => panic!("{why}"),
        }
    }

    fn near(figure: &Figure, expected: f64) {
        let (value, grid) = is(figure);
        assert!((value - expected).abs() <= grid, "{value} +- {grid}, expected {expected}");
    }

    /// A lag of the first order: 10 % to 90 % take ln 9 time constants, 2 % are left after ln 50.
    #[test]
    fn a_lag_of_the_first_order_has_its_closed_form() {
        const LAG_S: f64 = 0.02;
        for (from, to) in [(0.0, 60.0), (30.0, -90.0)] {
            let lag = |at: f64| if at < 0.05 { from } else { to + (from - to) * (-(at - 0.05) / LAG_S).exp() };
            let figures = step(&sampled(0.001, 0.4, lag), 0.05, from, to).unwrap();
            near(&figures.rise_s, LAG_S * 9.0_f64.ln());
            near(&figures.settling_s, LAG_S * 50.0_f64.ln());
            near(&figures.overshoot, 0.0);
            assert_eq!(is(&figures.rise_s).1, is(&figures.settling_s).1);
            assert!((is(&figures.rise_s).1 - 0.001).abs() < 1e-9, "the grid is the period");
        }
    }

    /// Of the second order, damped by z: the overshoot is exp(-pi z / sqrt(1 - z^2)).
    #[test]
    fn a_lag_of_the_second_order_overshoots_as_its_damping_says() {
        const OMEGA: f64 = 100.0;
        for damping in [0.3_f64, 0.5, 0.7] {
            let root = (1.0 - damping * damping).sqrt();
            let response = |at: f64| {
                let phase = OMEGA * root * at;
                1.0 - (-damping * OMEGA * at).exp() * (phase.cos() + damping / root * phase.sin())
            };
            let figures = step(&sampled(0.0005, 0.4, response), 0.0, 0.0, 1.0).unwrap();
            let expected = (-std::f64::consts::PI * damping / root).exp();
            let (value, grid) = is(&figures.overshoot);
            assert!(
                (value - expected).abs() <= grid.max(1e-6) && grid < 0.01,
                "{damping}: {value} +- {grid}, {expected}"
            );
            // Within 2 % for good not after the envelope is.
            let envelope = -(0.02 * root).ln() / (damping * OMEGA);
            assert!(is(&figures.settling_s).0 <= envelope + 0.0005);
        }
    }

    #[test]
    fn too_few_readings_give_no_figure_but_the_reason() {
        let lag = |at: f64| 1.0 - (-at / 0.01).exp();
        let figures = step(&sampled(0.01, 0.4, lag), 0.0, 0.0, 1.0).unwrap();
        assert!(
            matches!(&figures.rise_s, Figure::Unknown { why } if why.contains("readings lie in the rise, 10 are needed"))
        );
        let peak = [(0.0, 0.0), (0.1, 0.5), (0.2, 1.3), (0.3, 1.0), (0.4, 1.0)];
        assert!(
            matches!(&step(&peak, 0.0, 0.0, 1.0).unwrap().overshoot, Figure::Unknown { why } if why.contains("1 readings"))
        );
        // A ramp that never gets there.
        let ramp = step(&sampled(0.001, 0.1, |at| at), 0.0, 0.0, 1.0).unwrap();
        for figure in [&ramp.rise_s, &ramp.overshoot, &ramp.settling_s] {
            assert!(matches!(figure, Figure::Unknown { .. }), "{ramp:?}");
        }
        assert!(step(&peak, 0.0, 1.0, 1.0).is_err() && step(&peak, 0.0, 0.0, f64::NAN).is_err());
        assert!(step(&peak, 5.0, 0.0, 1.0).is_err());
    }

    /// The r.m.s. of a sine is its amplitude over the root of 2; the square of a ramp from 0 to 1 integrates to a third.
    #[test]
    fn currents_and_following_errors_are_those_of_the_lines_between_readings() {
        let sine = sampled(0.0001, 1.0, |at| 3.0 * (std::f64::consts::TAU * 5.0 * at).sin());
        let heat = heating(&sine).unwrap();
        assert!((heat.rms_a - 3.0 / 2.0_f64.sqrt()).abs() < 1e-4 && (heat.a2s - 4.5).abs() < 1e-3, "{heat:?}");
        assert!((heating(&[(0.0, 0.0), (1.0, 1.0)]).unwrap().a2s - 1.0 / 3.0).abs() < 1e-12);
        assert_eq!((heating(&[]), heating(&[(0.0, 1.0)])), (None, None));
        let followed = following(&[0.0, 1.0, 2.0, 3.0], &[0.0, 1.0, 2.0, f64::NAN], &[0.0, 1.5, 1.0, 7.0]).unwrap();
        assert_eq!(followed.most, 1.0);
        // (0 + 0 + 0.25)/3 and (0.25 - 0.5 + 1)/3 over two seconds.
        assert!((followed.rms - ((0.25 / 3.0 + 0.75 / 3.0) / 2.0_f64).sqrt()).abs() < 1e-12);
        assert_eq!(following(&[0.0], &[f64::NAN], &[1.0]), None);
    }
}
