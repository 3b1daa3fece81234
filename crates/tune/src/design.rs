//! Gains from one objective, within what a drive's parameters can hold.
//!
//! Of all gains that keep the margins, those are taken with which the speed is away from its set-point by the least after a step of it and
//! after a load: the integral of the absolute error (K. J. Åström, T. Hägglund, "Advanced PID Control", 2006, 4.2; under a limit of the
//! sensitivity: 6.7). After a load that is no less than the load over the integral gain, and more where a load behind a spring swings.

use std::f64::consts::{PI, TAU};

use rustfft::num_complex::Complex;

use crate::answer::Disturbance;
use crate::controller::Loop;
use crate::mechanics::Mechanics;

/// Frequencies at which a loop is looked at, over these decades up to its highest; more of them where it turns by more than this
/// from one to the next.
const POINTS: usize = 200;
const DECADES: f64 = 5.0;
const CLOSE_RAD: f64 = 0.3;
const SMALL: f64 = 0.1;
const HALVINGS: usize = 12;
/// Largest sensitivity: the least distance of the loop from -1 is its inverse (same source, 4.6: 1.4 to 2).
const SENSITIVITY: f64 = 2.0;
/// Least factor by which the loop gain may grow.
const GAIN_MARGIN: f64 = 2.0;
/// Phase margin where the objective is a bandwidth.
const PHASE_MARGIN_DEG: f64 = 40.0;
/// Gains that are tried: so many of each, this far below and above those of the drive.
const STEPS: i32 = 40;
const SPAN: f64 = 30.0;
/// Integral times that are tried, in times of the crossover.
const INTEGRAL_TIMES: [f64; 9] = [1.4, 1.9, 2.5, 3.0, 4.0, 5.0, 7.0, 10.0, 20.0];

/// What the gains are to reach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Objective {
    /// Where the loop gain falls to one, Hz.
    Bandwidth(f64),
    /// Degrees that are left at the crossover; the least error that this allows.
    PhaseMargin(f64),
}

impl Objective {
    /// Least phase margin that goes with it.
    pub fn phase_deg(self) -> f64 {
        match self {
            Self::PhaseMargin(degrees) => degrees,
            Self::Bandwidth(_) => PHASE_MARGIN_DEG,
        }
    }

    /// How much an error counts, of one that is usual: to be as near to a bandwidth as can be comes first.
    fn weight(self, usual: f64) -> f64 {
        match self {
            Self::PhaseMargin(_) => 1.0,
            Self::Bandwidth(_) => 1e-3 / usual,
        }
    }

    /// How far from a bandwidth they are, as the logarithm of the ratio.
    fn off(self, margins: &Margins) -> f64 {
        match self {
            Self::PhaseMargin(_) => 0.0,
            Self::Bandwidth(hz) => (margins.crossover_hz / hz).ln().abs(),
        }
    }
}

/// How far a loop is from being unstable.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Margins {
    /// Where the loop gain falls to one for the last time, Hz.
    pub crossover_hz: f64,
    /// Least phase that is left where the loop gain is one; negative where it is turned beyond half a turn.
    pub phase_deg: f64,
    /// Factor by which the loop gain may grow.
    pub gain: f64,
    /// Largest sensitivity.
    pub sensitivity: f64,
    /// The closed loop is stable (Nyquist).
    pub is_stable: bool,
}

/// Gains, and what they give.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Proposal {
    /// Times what the drive has.
    pub proportional: f64,
    /// Times what the drive has.
    pub integral: f64,
    /// Time constant of the filter of the speed.
    pub filter_s: f64,
    /// What they give.
    pub margins: Margins,
    /// The bandwidth of the objective is not reached: a margin that has to be kept, or the highest crossover, ends before.
    pub is_limited: bool,
}

/// The loop gain of a speed loop.
fn open_loop(mechanics: &Mechanics, around: &Loop) -> impl Fn(f64) -> Complex<f64> {
    move |omega| mechanics.response(omega) * around.controller(omega) * around.feedback(omega)
}

/// Margins of a speed loop around a shaft. `highest_hz` is where it ends: half of the rate at which it is computed.
pub fn margins(mechanics: &Mechanics, around: &Loop, highest_hz: f64) -> Margins {
    margins_of(open_loop(mechanics, around), highest_hz)
}

/// A loop over its frequencies, closer where `1 + L` or `L` turns: at a resonance it does so within a hertz. From each to the next as
/// long as that is asked for; whether the end was reached.
fn walk(
    open: impl Fn(f64) -> Complex<f64>,
    highest_hz: f64,
    mut step: impl FnMut((f64, Complex<f64>), (f64, Complex<f64>)) -> bool,
) -> bool {
    let at = |hz: f64| (hz, open(TAU * hz));
    let mut last = at(lowest_hz(highest_hz));
    for n in 1..POINTS {
        let mut ahead = [at(highest_hz * 10f64.powf(DECADES * (n as f64 / (POINTS - 1) as f64 - 1.0))); HALVINGS + 1];
        let mut left = 1;
        while left > 0 {
            let next = ahead[left - 1];
            // Far below a gain of one its phase says nothing.
            let is_small = last.1.norm().max(next.1.norm()) < SMALL;
            let turns = ((1.0 + next.1) / (1.0 + last.1)).arg().abs() > CLOSE_RAD
                || !is_small && (next.1 / last.1).arg().abs() > CLOSE_RAD;
            if turns && left <= HALVINGS {
                ahead[left] = at((last.0 * next.0).sqrt());
                left += 1;
            } else if step(last, next) {
                (last, left) = (next, left - 1);
            } else {
                return false;
            }
        }
    }
    true
}

fn lowest_hz(highest_hz: f64) -> f64 {
    highest_hz * 10f64.powf(-DECADES)
}

fn margins_of(open: impl Fn(f64) -> Complex<f64>, highest_hz: f64) -> Margins {
    margins_while(open, highest_hz, |_| true)
}

/// Nyquist's criterion for an open loop with integrators and no unstable poles: with the frequency `1 + L` turns on from where the
/// integrators hold it, a quarter turn back for each, to 1, and not once more around 0. A loop whose margins are not to be had any
/// more is left, as one that is not stable.
fn margins_while(
    open: impl Fn(f64) -> Complex<f64>,
    highest_hz: f64,
    are_wanted: impl Fn(&Margins) -> bool,
) -> Margins {
    let mut margins =
        Margins { crossover_hz: 0.0, phase_deg: 180.0, gain: f64::INFINITY, sensitivity: 0.0, is_stable: false };
    // Integrators turn it back by up to half a turn and more: it comes from there.
    let back = |first: f64| if first > 0.0 { first - TAU } else { first };
    let first = open(TAU * lowest_hz(highest_hz));
    let (mut turned, mut phase, mut end) = (back((1.0 + first).arg()), back(first.arg()), first);
    let has_ended = walk(open, highest_hz, |(last_hz, before), (hz, now)| {
        turned += ((1.0 + now) / (1.0 + before)).arg();
        margins.sensitivity = margins.sensitivity.max(1.0 / (1.0 + now).norm());
        let turn = (now / before).arg();
        if (before.norm() - 1.0) * (now.norm() - 1.0) < 0.0 {
            // Between the two the logarithm of the gain is nearly straight.
            let share = before.norm().ln() / (before.norm() / now.norm()).ln();
            margins.crossover_hz = last_hz * (hz / last_hz).powf(share);
            let left = PI + phase + share * turn;
            // Ahead of the current, half a turn is as far away on the other side.
            margins.phase_deg = margins.phase_deg.min(left.min(TAU - left).to_degrees());
        }
        phase += turn;
        // Through the negative real axis.
        if before.im * now.im < 0.0 && now.re < 0.0 && now.norm() < 1.0 {
            margins.gain = margins.gain.min(2.0 / (now.norm() + before.norm()));
        }
        end = now;
        are_wanted(&margins)
    });
    // What is left to 1 beyond the last frequency is small: the loop gain is.
    margins.is_stable = has_ended && turned.abs() < PI / 2.0 && end.norm() < 1.0;
    margins
}

impl Margins {
    fn keeps(&self, phase_deg: f64) -> bool {
        self.is_stable && self.can_keep(phase_deg)
    }

    /// So far: with each further frequency they grow less.
    fn can_keep(&self, phase_deg: f64) -> bool {
        self.phase_deg >= phase_deg && self.gain >= GAIN_MARGIN && self.sensitivity <= SENSITIVITY
    }
}

/// Gains for a speed loop whose gain falls to one below `most_hz`: where the shaft was not seen to follow, nothing is known of it.
/// `filters_s` are time constants that the drive's filter of its speed can have; each factor of the gains is one that `can_hold` takes.
/// `None` where not even the smallest gains keep the margins.
pub fn propose(
    mechanics: &Mechanics,
    around: &Loop,
    (objective, disturbance): (Objective, Disturbance),
    (most_hz, highest_hz): (f64, f64),
    filters_s: &[f64],
    can_hold: impl Fn(f64, f64) -> bool,
) -> Option<Proposal> {
    let phase_deg = objective.phase_deg();
    let weight = objective.weight(disturbance.least_error(around));
    let mut best: Option<(f64, Proposal)> = None;
    for &filter_s in filters_s {
        let with = |proportional: f64, integral: f64| Loop {
            proportional: around.proportional * proportional,
            integral,
            filter_s,
            ..*around
        };
        // The greatest first: of what is below, less has to be looked at.
        for step in (-STEPS..=STEPS).rev() {
            let proportional = SPAN.powf(f64::from(step) / f64::from(STEPS));
            let crossover = margins(mechanics, &with(proportional, 0.0), highest_hz).crossover_hz;
            for time in INTEGRAL_TIMES {
                let candidate = with(proportional, around.proportional * proportional * TAU * crossover / time);
                let integral = candidate.integral / around.integral;
                let least = best.as_ref().map_or(f64::INFINITY, |(cost, _)| *cost);
                if crossover == 0.0
                    || weight * disturbance.least_error(&candidate) >= least
                    || !can_hold(proportional, integral)
                {
                    continue;
                }
                let open = open_loop(mechanics, &candidate);
                let margins = margins_while(open, highest_hz, |margins| margins.can_keep(phase_deg));
                if !margins.keeps(phase_deg) || margins.crossover_hz > most_hz {
                    continue;
                }
                let off = objective.off(&margins);
                let cost = off + weight * disturbance.error(mechanics, &candidate);
                if cost < least {
                    let is_limited = off > 0.1;
                    best = Some((cost, Proposal { proportional, integral, filter_s, margins, is_limited }));
                }
            }
        }
    }
    best.map(|(_, proposal)| proposal)
}

/// The gain of a position loop (1/s) around a speed loop, so that this phase is left; and its margins. `late_s` is how late the
/// position is seen.
pub fn propose_position(
    mechanics: &Mechanics,
    around: &Loop,
    phase_deg: f64,
    highest_hz: f64,
    late_s: f64,
) -> Option<(f64, Margins)> {
    let speed = open_loop(mechanics, around);
    let closed = |omega: f64| {
        let forward = mechanics.response(omega) * around.controller(omega);
        forward / (1.0 + speed(omega))
    };
    let with = |gain: f64| {
        margins_while(
            |omega| gain / Complex::new(0.0, omega) * closed(omega) * Complex::from_polar(1.0, -omega * late_s),
            highest_hz,
            |margins| margins.can_keep(phase_deg),
        )
    };
    let gains = (0..=200).rev().map(|n| 10f64.powf(f64::from(n) / 50.0 - 1.0));
    gains.map(|gain| (gain, with(gain))).find(|(_, margins)| margins.keeps(phase_deg))
}

#[cfg(test)]
mod tests {
    use super::*;

    const LATE_S: f64 = 2e-3;

    fn integrator(gain: f64) -> impl Fn(f64) -> Complex<f64> {
        move |omega| gain / Complex::new(0.0, omega) * Complex::from_polar(1.0, -omega * LATE_S)
    }

    /// An integrator with a delay: the crossover is the gain, 90 degrees less the delay's are left, and it is stable up to a quarter
    /// turn in the delay.
    #[test]
    fn margins_of_an_integrator_with_a_delay_are_those_of_its_closed_form() {
        for gain in [20.0, 100.0, 300.0, 700.0, 780.0] {
            let margins = margins_of(integrator(gain), 1000.0);
            let left = 90.0 - (gain * LATE_S).to_degrees();
            assert!((margins.crossover_hz * TAU / gain - 1.0).abs() < 0.02, "{margins:?}");
            assert!((margins.phase_deg - left).abs() < 2.0, "{gain}: {margins:?}, {left}");
            assert!((margins.gain * gain * LATE_S / (PI / 2.0) - 1.0).abs() < 0.05, "{gain}: {margins:?}");
            assert!(margins.is_stable, "{gain}: {margins:?}");
        }
        for gain in [800.0, 1000.0, 3000.0] {
            let margins = margins_of(integrator(gain), 1000.0);
            let left = 90.0 - (gain * LATE_S).to_degrees();
            assert!(!margins.is_stable && (margins.phase_deg - left).abs() < 2.0, "{gain}: {margins:?}, {left}");
        }
    }

    /// Two integrators with less lead than lag are unstable at any gain.
    #[test]
    fn an_integral_time_that_is_shorter_than_the_delays_is_unstable_however_small_the_gain() {
        let open = |omega: f64| {
            let s = Complex::new(0.0, omega);
            10.0 / (s * s) * (1.0 + 0.005 * s) * Complex::from_polar(1.0, -0.011 * omega)
        };
        assert!(!margins_of(open, 1000.0).is_stable);
        let more_lead = |omega: f64| {
            open(omega) * (1.0 + 0.05 * Complex::new(0.0, omega)) / (1.0 + 0.005 * Complex::new(0.0, omega))
        };
        assert!(margins_of(more_lead, 1000.0).is_stable);
    }

    /// A gain that takes the crossover far beyond where the delay has turned everything round is unstable, however sharp the resonance
    /// that the frequencies have to find on the way.
    #[test]
    fn a_sharp_resonance_is_not_passed_over() {
        let elastic =
            crate::Elastic { anti_resonance_hz: 29.1, anti_damping: 0.0046, resonance_hz: 39.07, damping: 0.0061 };
        let mechanics = Mechanics { elastic: Some(elastic), gain: 24.5, viscous_per_s: 0.3, delay_s: 1.2e-3, off: 0.0 };
        let around = |proportional: f64| Loop { proportional, integral: 20.0, filter_s: 2e-3, ..AROUND };
        for proportional in [20.0, 35.0, 70.0, 200.0] {
            assert!(!margins(&mechanics, &around(proportional), 1000.0).is_stable, "{proportional}");
        }
        let calm = margins(&mechanics, &Loop { integral: 0.5, ..around(0.1) }, 1000.0);
        assert!(calm.is_stable, "{calm:?}");
    }

    const MECHANICS: Mechanics = Mechanics { gain: 50.0, viscous_per_s: 0.2, elastic: None, delay_s: 1e-3, off: 0.0 };
    const AROUND: Loop =
        Loop { proportional: 0.5, integral: 1.0, filter_s: 1e-3, asked_late_s: 1e-3, seen_late_s: 1e-3, off: 0.0 };

    const BOTH: Disturbance = Disturbance { step_rad_s: 3.0, load_a: 2.0 };

    #[test]
    fn a_phase_margin_is_kept_and_a_greater_one_or_a_shaft_that_is_seen_less_makes_the_loop_slower() {
        let of = |degrees, most_hz| {
            propose(&MECHANICS, &AROUND, (Objective::PhaseMargin(degrees), BOTH), (most_hz, 1000.0), &[1e-3], |_, _| {
                true
            })
            .unwrap()
        };
        let (fast, slow, blind) = (of(45.0, 1000.0), of(70.0, 1000.0), of(45.0, 10.0));
        assert!(fast.margins.phase_deg >= 45.0 && slow.margins.phase_deg >= 70.0, "{fast:?} {slow:?}");
        assert!(fast.margins.crossover_hz > slow.margins.crossover_hz, "{fast:?} {slow:?}");
        assert!(fast.margins.crossover_hz > 10.0 && (5.0..=10.0).contains(&blind.margins.crossover_hz), "{blind:?}");
    }

    #[test]
    fn a_bandwidth_is_met_or_said_to_be_limited_and_gains_that_the_drive_cannot_hold_are_not_proposed() {
        let of = |hz, most: f64| {
            propose(&MECHANICS, &AROUND, (Objective::Bandwidth(hz), BOTH), (1000.0, 1000.0), &[1e-3], |kp, _| {
                kp <= most
            })
            .unwrap()
        };
        let met = of(10.0, 100.0);
        assert!((met.margins.crossover_hz / 10.0 - 1.0).abs() < 0.1 && !met.is_limited, "{met:?}");
        let limited = of(400.0, 100.0);
        assert!(limited.is_limited && limited.margins.sensitivity <= SENSITIVITY, "{limited:?}");
        assert!(of(400.0, 1.0).proportional <= 1.0);
    }

    #[test]
    fn a_position_loop_is_slower_than_the_speed_loop_inside() {
        let inner = margins(&MECHANICS, &AROUND, 1000.0);
        let (gain, outer) = propose_position(&MECHANICS, &AROUND, 60.0, 1000.0, 1e-3).unwrap();
        assert!(outer.is_stable && outer.phase_deg >= 60.0, "{outer:?}");
        assert!(gain < TAU * inner.crossover_hz, "{gain} {inner:?}");
    }
}
