//! A capture in plain values, for other languages.

use recording::Capture;
use serde::Serialize;

use super::measurand::Way;

/// A capture in plain values, as Python and the page have it.
#[derive(Debug, Serialize)]
pub struct Captured {
    name: String,
    notes: String,
    node: u8,
    model: String,
    trigger_s: Option<f64>,
    time_s: Vec<f64>,
    traces: Vec<CapturedTrace>,
    /// Objects as `6083h:00` and their bytes in the order of the wire.
    objects: Vec<(String, Vec<u8>)>,
}

#[derive(Debug, Serialize)]
struct CapturedTrace {
    quantity: String,
    unit: String,
    by: String,
    /// `None` where no reading belongs to the time.
    values: Vec<Option<f64>>,
    period_s: Option<f64>,
    jitter_s: Option<f64>,
    gaps: usize,
}

impl Captured {
    /// A capture whose quantities came these ways.
    pub fn of(capture: &Capture, ways: &[Way]) -> Self {
        Self::by(capture, ways.iter().map(ToString::to_string))
    }

    /// One that was read from a file, which does not say by what its quantities came.
    pub fn of_file(capture: &Capture) -> Self {
        Self::by(capture, std::iter::repeat("file".to_owned()))
    }

    fn by(capture: &Capture, ways: impl Iterator<Item = String>) -> Self {
        let traces = capture.traces.iter().zip(ways).map(|(trace, by)| CapturedTrace {
            quantity: trace.quantity.clone(),
            unit: trace.unit.clone(),
            by,
            values: trace.values.iter().map(|value| known(*value)).collect(),
            period_s: known(trace.period_s),
            jitter_s: known(trace.jitter_s),
            gaps: trace.gaps,
        });
        let objects = capture.parameters.iter().map(|(object, bytes)| (object.to_string(), bytes.clone()));
        Self {
            name: capture.name.clone(),
            notes: capture.notes.clone(),
            node: capture.place.node,
            model: capture.model.clone(),
            trigger_s: capture.trigger_s,
            time_s: capture.time_s.clone(),
            traces: traces.collect(),
            objects: objects.collect(),
        }
    }
}

fn known(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}
