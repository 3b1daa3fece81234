//! Recorder: samples of chosen signals of drives over virtual time, for plots and CSV files.
//!
//! A recorder travels inside a [`World`](crate::World) ([`World::start_recording`](crate::World::start_recording))
//! and is taken out again with its samples. It looks at machines without touching them: a run with a
//! recorder is the same run.

use core::time::Duration;
use std::fmt::Write;

use can::Instant;

use crate::Report;
use crate::stimulus::{Place, Stimulus};

/// What can be recorded of a drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Signal {
    /// Actual position in the drive's counts.
    Position,
    /// Position demand in the drive's counts.
    PositionDemand,
    /// Motor speed in r/min.
    Velocity,
    /// Velocity demand in r/min.
    VelocityDemand,
    /// Motor current in A.
    Current,
    /// Current demand in A.
    CurrentDemand,
    /// Supply voltage in V.
    Supply,
    /// Motor temperature in °C.
    MotorTemperature,
    /// Power stage temperature in °C.
    DriverTemperature,
    /// True angle of the motor shaft in rad.
    ShaftAngle,
    /// Statusword as a number.
    Statusword,
}

impl Signal {
    /// Name with unit, as in CSV headers.
    pub fn name(self) -> &'static str {
        match self {
            Self::Position => "position_counts",
            Self::PositionDemand => "position_demand_counts",
            Self::Velocity => "velocity_rpm",
            Self::VelocityDemand => "velocity_demand_rpm",
            Self::Current => "current_a",
            Self::CurrentDemand => "current_demand_a",
            Self::Supply => "supply_v",
            Self::MotorTemperature => "motor_c",
            Self::DriverTemperature => "driver_c",
            Self::ShaftAngle => "shaft_angle_rad",
            Self::Statusword => "statusword",
        }
    }

    /// Its value in a report; not a number where the drive has none at present.
    pub fn of(self, report: &Report) -> f64 {
        let value = match self {
            Self::Position => Some(report.position as f64),
            Self::PositionDemand => report.position_demand.map(|demand| demand as f64),
            Self::Velocity => Some(report.velocity_rpm),
            Self::VelocityDemand => report.velocity_demand_rpm,
            Self::Current => Some(report.current_a),
            Self::CurrentDemand => report.current_demand_a,
            Self::Supply => Some(report.supply_v),
            Self::MotorTemperature => report.motor_c,
            Self::DriverTemperature => report.driver_c,
            Self::ShaftAngle => Some(report.shaft_angle_rad),
            Self::Statusword => report.statusword.map(f64::from),
        };
        value.unwrap_or(f64::NAN)
    }
}

/// A signal of one axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Channel {
    /// The number the drive was added under, and its axis.
    pub place: Place,
    /// Which of its signals.
    pub signal: Signal,
}

/// Samples at a fixed period, and marks where something happened.
#[derive(Clone, Debug)]
pub struct Recorder {
    channels: Vec<Channel>,
    period: Duration,
    next_at: Option<Instant>,
    times: Vec<Instant>,
    values: Vec<f64>,
    marks: Vec<(Instant, String)>,
    stimuli: Vec<(Instant, Place, Stimulus)>,
}

impl Recorder {
    /// Samples `channels` every `period` (at least 1 µs), from the moment it is put into a world.
    pub fn new(period: Duration, channels: impl IntoIterator<Item = Channel>) -> Self {
        Self {
            channels: channels.into_iter().collect(),
            period: period.max(Duration::from_micros(1)),
            next_at: None,
            times: Vec::new(),
            values: Vec::new(),
            marks: Vec::new(),
            stimuli: Vec::new(),
        }
    }

    /// What is recorded, in the order of [`samples`](Self::samples).
    pub fn channels(&self) -> &[Channel] {
        &self.channels
    }

    /// When samples were taken.
    pub fn times(&self) -> &[Instant] {
        &self.times
    }

    /// The samples of channel number `channel`, one for each time; empty if there is no such channel.
    pub fn samples(&self, channel: usize) -> impl Iterator<Item = f64> + '_ {
        let step = self.channels.len().max(1);
        let start = if channel < self.channels.len() { channel } else { self.values.len() };
        self.values.iter().skip(start).step_by(step).copied()
    }

    /// What happened when, as told by [`mark`](Self::mark).
    pub fn marks(&self) -> &[(Instant, String)] {
        &self.marks
    }

    /// What the outer world did, and when: each can be applied again, or printed.
    pub fn stimuli(&self) -> &[(Instant, Place, Stimulus)] {
        &self.stimuli
    }

    pub(crate) fn note(&mut self, at: Instant, place: Place, stimulus: &Stimulus) {
        self.stimuli.push((at, place, stimulus.clone()));
    }

    /// Notes that something happened.
    pub fn mark(&mut self, at: Instant, text: impl Into<String>) {
        self.marks.push((at, text.into()));
    }

    /// A table with a header; `t_s` first, then `4.velocity_rpm` and so on; a missing value is an empty
    /// field. The last column, `mark`, tells what happened since the line before.
    pub fn to_csv(&self) -> String {
        let mut csv = String::from("t_s");
        for Channel { place, signal } in &self.channels {
            let _ = write!(csv, ",{place}.{}", signal.name());
        }
        csv.push_str(",mark\n");
        let mut marks = self.marks.iter().peekable();
        for (row, at) in self.times.iter().enumerate() {
            let _ = write!(csv, "{at}");
            for value in &self.values[row * self.channels.len()..(row + 1) * self.channels.len()] {
                csv.push(',');
                if !value.is_nan() {
                    let _ = write!(csv, "{value}");
                }
            }
            let mut texts = Vec::new();
            while let Some((_, text)) = marks.next_if(|(marked, _)| marked <= at) {
                texts.push(text.as_str());
            }
            csv.push(',');
            csv.push_str(&quoted(&texts.join("; ")));
            csv.push('\n');
        }
        csv
    }

    pub(crate) fn start(&mut self, now: Instant) {
        self.next_at.get_or_insert(now);
    }

    /// When the next sample is due, if not after `end`.
    pub(crate) fn due_by(&self, end: Instant) -> Option<Instant> {
        self.next_at.filter(|at| *at <= end)
    }

    pub(crate) fn sample(&mut self, at: Instant, mut measure: impl FnMut(Channel) -> f64) {
        self.times.push(at);
        self.values.extend(self.channels.iter().map(|channel| measure(*channel)));
        self.next_at = Some(at + self.period);
    }
}

/// A CSV field: quoted where RFC 4180 asks for it.
fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_string() }
}
