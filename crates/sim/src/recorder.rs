//! Recorder: samples of chosen signals of drives over virtual time, for plots and CSV files.
//!
//! A recorder travels inside a [`World`](crate::World) ([`World::start_recording`](crate::World::start_recording))
//! and is taken out again with its samples. It looks at machines without touching them: a run with a
//! recorder is the same run.

use core::time::Duration;

use can::Instant;

use crate::Report;
use crate::coupling::BodyState;
use crate::stimulus::{Place, Stimulus};

pub(crate) use self::live::LivePlace;
pub use self::live::{LiveValues, Samples, Subscription};
pub use self::signal::Signal;

mod live;
mod signal;

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

    /// What happened when, as given by [`mark`](Self::mark).
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
