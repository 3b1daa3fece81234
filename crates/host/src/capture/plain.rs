//! A capture in plain values, for other languages.

use recording::Capture;
use serde::Serialize;

use super::measurand::Way;

/// A capture in plain values, as Python and the page have it.
#[derive(Debug, Serialize)]
pub struct Captured {
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
        let traces = capture.traces.iter().zip(ways).map(|(trace, way)| CapturedTrace {
            quantity: trace.quantity.clone(),
            unit: trace.unit.clone(),
            by: way.to_string(),
            values: trace.values.iter().map(|value| known(*value)).collect(),
            period_s: known(trace.period_s),
            jitter_s: known(trace.jitter_s),
            gaps: trace.gaps,
        });
        let objects = capture.parameters.iter().map(|(object, bytes)| (object.to_string(), bytes.clone()));
        let (model, trigger_s, time_s) = (capture.model.clone(), capture.trigger_s, capture.time_s.clone());
        Self { model, trigger_s, time_s, traces: traces.collect(), objects: objects.collect() }
    }
}

fn known(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}
