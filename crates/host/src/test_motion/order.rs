//! A test motion in plain values, with units in the names: as a command line, Python and a page give it.

use std::time::Duration;

use master::cyclic::CyclicOptions;
use master::group::AxisLimits;
use master::units::{Ramp, Rpm};
use serde::{Deserialize, Serialize};

use super::runs::{Motion, limits};
use super::shape::{Shape, points};

/// The shapes by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ShapeName {
    /// There and back, at rest at both ends.
    BackAndForth,
    /// Velocity at once, and off again, by the drive's own ramps.
    Steps,
    /// Velocity up, kept, down, and backwards.
    Ramp,
    /// Periods of a cosine.
    Sine,
    /// A cosine of rising frequency.
    Chirp,
    /// Velocity of pseudo-random sign.
    Prbs,
    /// A recorded position.
    Path,
}

impl ShapeName {
    /// All of them.
    pub const ALL: [Self; 7] =
        [Self::Steps, Self::BackAndForth, Self::Ramp, Self::Sine, Self::Chirp, Self::Prbs, Self::Path];

    /// As people and programs write it: `back-and-forth`.
    pub const fn word(self) -> &'static str {
        match self {
            Self::BackAndForth => "back-and-forth",
            Self::Steps => "steps",
            Self::Ramp => "ramp",
            Self::Sine => "sine",
            Self::Chirp => "chirp",
            Self::Prbs => "prbs",
            Self::Path => "path",
        }
    }

    /// What it is, for people.
    pub const fn what(self) -> &'static str {
        match self {
            Self::BackAndForth => "There and back, at rest at both ends",
            Self::Steps => "Velocity at once, and off again",
            Self::Ramp => "Velocity up, kept, down, and backwards",
            Self::Sine => "Periods of a cosine",
            Self::Chirp => "A cosine of rising frequency",
            Self::Prbs => "Velocity of pseudo-random sign",
            Self::Path => "The position of a capture",
        }
    }
}

impl std::str::FromStr for ShapeName {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Self::ALL.into_iter().find(|shape| shape.word() == text).ok_or_else(|| {
            let words = Self::ALL.map(Self::word);
            let (last, others) = words.split_last().map_or(("", &[][..]), |(last, others)| (*last, others));
            format!("expected a shape of {} and {last}, got {text:?}", others.join(", "))
        })
    }
}

/// What is to be moved, how often, and what it has to keep to.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Order {
    /// The shape.
    pub shape: ShapeName,
    /// Distance, or amplitude of sine and chirp.
    pub by_deg: f64,
    /// Speed of steps, ramp and prbs.
    pub speed_rpm: f64,
    /// Frequency of sine, the first one of chirp.
    pub frequency_hz: f64,
    /// Last frequency of chirp.
    pub to_frequency_hz: f64,
    /// Periods of sine.
    pub periods: u32,
    /// Time that steps and ramp keep their speed, of a bit of prbs, of all of chirp.
    pub time_s: f64,
    /// The path: times in s, and degrees.
    #[serde(default)]
    pub path: Vec<(f64, f64)>,
    /// Runs.
    pub count: u32,
    /// Limit of the speed; of steps, of their speed.
    pub velocity_rpm: f64,
    /// Limit of the acceleration; steps: the drive's own ramps without it.
    pub acceleration_rpm_s: Option<f64>,
    /// Turns from its start, beyond which points are refused and steps stop.
    pub travel_turns: Option<f64>,
    /// Distance of the shaft from its set-point beyond which it is stopped.
    pub following_error_deg: f64,
    /// Period of SYNC, in which points are sent.
    pub period_ms: f64,
}

/// Runs of one order at most.
const MOST_RUNS: u32 = 999;

impl Order {
    /// One run of a shape with what is usual of all else.
    pub const fn usual(shape: ShapeName) -> Self {
        Self {
            shape,
            by_deg: 90.0,
            speed_rpm: 20.0,
            frequency_hz: 1.0,
            to_frequency_hz: 10.0,
            periods: 3,
            time_s: 0.5,
            path: Vec::new(),
            count: 1,
            velocity_rpm: 60.0,
            acceleration_rpm_s: None,
            travel_turns: None,
            following_error_deg: 72.0,
            period_ms: 5.0,
        }
    }

    /// What its points keep to; of steps, with what the drive has for that.
    ///
    /// # Errors
    /// In a sentence: what of it makes no sense.
    pub fn limits(&self) -> Result<AxisLimits, String> {
        let acceleration_turns_s2 = self.acceleration_rpm_s.map(|rate| rate / 60.0);
        let limits = limits(Rpm(self.velocity_rpm), acceleration_turns_s2, self.following_error_deg / 360.0);
        limits.map_err(|failure| failure.what)
    }

    /// What a run sends; all runs stay within the travel that is allowed.
    ///
    /// # Errors
    /// In a sentence: a value that is not usable, or a limit that it would break, and what fits.
    pub fn motion(&self, cyclic: CyclicOptions) -> Result<Motion, String> {
        if !(1..=MOST_RUNS).contains(&self.count) {
            return Err(format!("expected 1 to {MOST_RUNS} runs, got {}", self.count));
        }
        if let Some(turns) = self.travel_turns.filter(|turns| !(turns.is_finite() && *turns > 0.0)) {
            return Err(format!("expected a travel above 0 turns, got {turns}"));
        }
        let (speed, hold) = (Rpm(self.speed_rpm), seconds("a time", self.time_s)?);
        let limits = self.limits()?;
        if self.shape == ShapeName::Steps {
            if !(speed.0.is_finite() && speed.0 != 0.0) {
                return Err(format!("expected a speed that is not 0, got {} r/min", speed.0));
            }
            if speed.0.abs() > self.velocity_rpm {
                return Err(format!("a speed of {} r/min, and {} r/min are allowed", speed.0, self.velocity_rpm));
            }
            return Ok(Motion::Steps { speed, ramp: self.acceleration_rpm_s.map(Ramp::RpmPerSecond), hold });
        }
        let period = seconds("a period", self.period_ms / 1e3)?;
        if period.is_zero() {
            return Err("expected a period above 0 ms".to_owned());
        }
        let points = points(&self.shape(), &limits, period.as_secs_f64())?;
        let motion = Motion::Points { points, limits, period, cyclic };
        self.travel_turns.map_or(Ok(()), |travel| motion.check_travel(self.count, travel))?;
        Ok(motion)
    }

    fn shape(&self) -> Shape {
        let (amplitude_turns, velocity_turns_s) = (self.by_deg / 360.0, self.speed_rpm / 60.0);
        match self.shape {
            ShapeName::BackAndForth => Shape::BackAndForth { by_turns: amplitude_turns },
            ShapeName::Steps | ShapeName::Ramp => Shape::Ramp { velocity_turns_s, hold_s: self.time_s },
            ShapeName::Sine => Shape::Sine { amplitude_turns, hz: self.frequency_hz, periods: self.periods },
            ShapeName::Chirp => Shape::Chirp {
                amplitude_turns,
                from_hz: self.frequency_hz,
                to_hz: self.to_frequency_hz,
                duration_s: self.time_s,
            },
            ShapeName::Prbs => Shape::Prbs { velocity_turns_s, bit_s: self.time_s },
            ShapeName::Path => Shape::Path { points: self.path.iter().map(|(at, deg)| (*at, deg / 360.0)).collect() },
        }
    }
}

fn seconds(what: &str, time_s: f64) -> Result<Duration, String> {
    Duration::try_from_secs_f64(time_s).map_err(|_| format!("expected {what} of 0 s or more, got {time_s} s"))
}
