//! Recorder: samples of chosen signals of drives over virtual time, for plots and CSV files.
//!
//! A recorder travels inside a [`World`](crate::World) ([`World::start_recording`](crate::World::start_recording))
//! and is taken out again with its samples. It looks at machines without touching them: a run with a
//! recorder is the same run.

use core::time::Duration;

use can::Instant;

use crate::coupling::BodyState;
use crate::stimulus::{Place, Stimulus};
use crate::{Brake, Report};

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
    /// Code of the present fault; 0 for none.
    ErrorCode,
    /// Supply switched on: 1, or 0.
    Powered,
    /// Where the rotor of a drive that does not measure it truly is, in its counts.
    RotorPosition,
    /// Digital outputs, one bit each.
    Outputs,
    /// Holding brake engaged: 1, or 0.
    Brake,
    /// Angle of the shaft behind a reducer in rad.
    OutputAngle,
    /// Torque at the shaft behind a reducer in N·m.
    OutputTorque,
}

impl Signal {
    /// All of them, in the order of a record's columns.
    pub const ALL: [Self; 18] = [
        Self::Position,
        Self::PositionDemand,
        Self::Velocity,
        Self::VelocityDemand,
        Self::Current,
        Self::CurrentDemand,
        Self::Supply,
        Self::MotorTemperature,
        Self::DriverTemperature,
        Self::ShaftAngle,
        Self::Statusword,
        Self::ErrorCode,
        Self::Powered,
        Self::RotorPosition,
        Self::Outputs,
        Self::Brake,
        Self::OutputAngle,
        Self::OutputTorque,
    ];

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
            Self::ErrorCode => "error_code",
            Self::Powered => "powered",
            Self::RotorPosition => "rotor_position_counts",
            Self::Outputs => "outputs",
            Self::Brake => "brake",
            Self::OutputAngle => "output_angle_rad",
            Self::OutputTorque => "output_torque_nm",
        }
    }

    /// Its unit as people write it; empty for what has none.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Position | Self::PositionDemand | Self::RotorPosition => "counts",
            Self::Velocity | Self::VelocityDemand => "r/min",
            Self::Current | Self::CurrentDemand => "A",
            Self::Supply => "V",
            Self::MotorTemperature | Self::DriverTemperature => "°C",
            Self::ShaftAngle | Self::OutputAngle => "rad",
            Self::OutputTorque => "N·m",
            Self::Statusword | Self::ErrorCode | Self::Powered | Self::Outputs | Self::Brake => "",
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
            Self::ErrorCode => Some(f64::from(report.error_code)),
            Self::Powered => Some(f64::from(u8::from(report.powered))),
            Self::RotorPosition => report.rotor_position.map(|position| position as f64),
            Self::Outputs => (!report.outputs.names.is_empty()).then(|| f64::from(report.outputs.bits)),
            Self::Brake => report.brake.map(|brake| f64::from(u8::from(brake == Brake::Engaged))),
            Self::OutputAngle => report.output.map(|shaft| shaft.angle_rad),
            Self::OutputTorque => report.output.map(|shaft| shaft.torque_nm),
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
    /// Machines that drives move, and how many signals each has.
    bodies: Vec<(String, usize)>,
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
            bodies: Vec::new(),
            period: period.max(Duration::from_micros(1)),
            next_at: None,
            times: Vec::new(),
            values: Vec::new(),
            marks: Vec::new(),
            stimuli: Vec::new(),
        }
    }

    /// Records these machines too: their [`signals`](crate::coupling::BodyKind::signals) stand behind the channels.
    pub fn with_bodies(mut self, states: &[BodyState]) -> Self {
        self.bodies = states.iter().map(|state| (state.name.clone(), state.kind.signals().len())).collect();
        self
    }

    /// How many values a row has.
    fn width(&self) -> usize {
        self.channels.len() + self.bodies.iter().map(|(_, signals)| signals).sum::<usize>()
    }

    /// Hands out what was recorded so far and goes on without it: a long run is recorded in pieces, in bounded memory.
    pub fn take(&mut self) -> Self {
        let empty = Self::new(self.period, self.channels.iter().copied());
        let rest = Self { next_at: self.next_at, bodies: self.bodies.clone(), ..empty };
        std::mem::replace(self, rest)
    }

    /// The values of one time after the other, each in the order of [`channels`](Self::channels), then those of the bodies.
    pub fn rows(&self) -> impl Iterator<Item = (Instant, &[f64])> + '_ {
        let width = self.width();
        self.times.iter().enumerate().map(move |(row, at)| (*at, &self.values[row * width..(row + 1) * width]))
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
        let step = self.width().max(1);
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

    pub(crate) fn start(&mut self, now: Instant) {
        self.next_at.get_or_insert(now);
    }

    /// When the next sample is due, if not after `end`.
    pub(crate) fn due_by(&self, end: Instant) -> Option<Instant> {
        self.next_at.filter(|at| *at <= end)
    }

    /// Takes the samples of `at`. `measure` gives the report of an axis, `look` the state of a body; `None` if there is none.
    pub(crate) fn sample<W>(
        &mut self,
        at: Instant,
        world: &mut W,
        measure: impl Fn(&mut W, Place) -> Option<Report>,
        look: impl Fn(&mut W, &str) -> Option<BodyState>,
    ) {
        self.times.push(at);
        // Channels of one axis mostly stand together: its report is made once for them.
        let mut measured: Option<(Place, Option<Report>)> = None;
        for Channel { place, signal } in &self.channels {
            if measured.as_ref().is_none_or(|(known, _)| known != place) {
                measured = Some((*place, measure(world, *place)));
            }
            let report = measured.as_ref().and_then(|(_, report)| report.as_ref());
            self.values.push(report.map_or(f64::NAN, |report| signal.of(report)));
        }
        for (name, signals) in &self.bodies {
            let state = look(world, name).map(|state| state.kind.signals()).unwrap_or_default();
            let values = state.into_iter().map(|(_, value)| value).chain(std::iter::repeat(f64::NAN));
            self.values.extend(values.take(*signals));
        }
        self.next_at = Some(at + self.period);
    }
}
