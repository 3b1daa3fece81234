//! What a client has subscribed to.

use can::Instant;
use core::time::Duration;
use serde_json::{Map, Value};
use sim::World;
use sim::recorder::Signal;
use sim::stimulus::Place;

use super::answer::ControlError;
use crate::events::Filter;
use words::suggest::{did_you_mean, near};

/// One signal of one axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Channel {
    /// The axis.
    pub place: Place,
    /// The quantity.
    pub signal: Signal,
}

/// Values at a rate of the world's time.
#[derive(Clone, Debug, PartialEq)]
pub struct Values {
    channels: Vec<Channel>,
    every_ns: u64,
}

/// The shortest time between two samples: the longest control period of a drive here.
const SHORTEST: Duration = Duration::from_micros(100);

/// Signals that one subscription may have: each of two full robots.
const MAX_CHANNELS: usize = 512;

impl Channel {
    /// A signal by its name.
    ///
    /// # Errors
    /// There is no such signal.
    pub fn named(place: Place, name: &str) -> Result<Self, ControlError> {
        let names = || Signal::ALL.iter().map(|signal| signal.name());
        let signal = Signal::ALL.into_iter().find(|signal| signal.name() == name);
        signal.map(|signal| Self { place, signal }).ok_or_else(|| {
            let all: Vec<_> = names().collect();
            let guess = did_you_mean(&near(name, names()));
            ControlError::usage(format!("there is no signal {name:?}{guess}; expected one of {}", all.join(", ")))
        })
    }
}

impl Values {
    /// These signals, every so often.
    ///
    /// # Errors
    /// No signal, or too many, or too often.
    pub fn new(channels: Vec<Channel>, every: Duration) -> Result<Self, ControlError> {
        if channels.is_empty() || channels.len() > MAX_CHANNELS {
            let count = channels.len();
            return Err(ControlError::usage(format!("{count} signals; expected 1 to {MAX_CHANNELS} of them")));
        }
        if every < SHORTEST {
            return Err(ControlError::usage(format!("\"every\" must be {} us at least", SHORTEST.as_micros())));
        }
        Ok(Self { channels, every_ns: every.as_nanos() as u64 })
    }

    /// The axes that it is about.
    pub(super) fn places(&self) -> impl Iterator<Item = Place> + '_ {
        self.channels.iter().map(|channel| channel.place)
    }

    pub(super) const fn every_ns(&self) -> u64 {
        self.every_ns
    }

    /// `{"4":{"velocity_rpm":60.0,..},..}`; `null` where the drive has no such value at present.
    pub(super) fn sample(&self, world: &mut World) -> Value {
        let mut places = Map::new();
        let mut last = None;
        for channel in &self.channels {
            // Channels of one place stand together, and one report serves them.
            let report = match last.take() {
                Some((place, report)) if place == channel.place => report,
                _ => world.measure(channel.place),
            };
            let value = report.as_ref().map_or(f64::NAN, |report| channel.signal.of(report));
            let signals = places.entry(channel.place.to_string()).or_insert_with(|| Value::Object(Map::new()));
            if let Value::Object(signals) = signals {
                signals.insert(channel.signal.name().to_owned(), number(channel.signal, value));
            }
            last = Some((channel.place, report));
        }
        Value::Object(places)
    }
}

/// Counts and codes are whole numbers.
fn number(signal: Signal, value: f64) -> Value {
    if matches!(signal.unit(), "counts" | "") && value.fract() == 0.0 && value.abs() < 9e15 {
        return Value::from(value as i64);
    }
    Value::from(sim::json::rounded(value))
}

/// A subscription at work.
#[derive(Clone, Debug)]
pub(super) enum Subscription {
    Events(Filter),
    Values { values: Values, next: Instant },
}
