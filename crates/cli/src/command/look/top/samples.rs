//! The last minute of what each drive measures, for the plots.

use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

use can::Instant;
use host::Snapshot;
use serde_json::{Value, json};

/// How much of the past is kept, s.
pub(super) const SPAN_S: f64 = 60.0;

/// Samples of a drive at most: the host looks at a drive up to twenty times a second.
const MOST: usize = 2_000;

/// What is plotted.
pub(super) const SIGNALS: [&str; 3] = ["speed r/min", "current A", "angle deg"];

/// One signal: times and values, oldest first.
pub(super) type Samples = VecDeque<(f64, f64)>;

/// The signals of all drives.
#[derive(Clone, Debug, Default)]
pub(super) struct Past(BTreeMap<u8, [Samples; 3]>);

impl Past {
    /// Keeps what is new in a state. Nodes that are gone are forgotten.
    pub(super) fn note(&mut self, state: &Snapshot) {
        self.0.retain(|node, _| state.node(*node).is_some());
        for (node, drive) in state.nodes.iter().filter_map(|node| Some((node.node, node.drive.as_ref()?))) {
            let kept = self.0.entry(node).or_default();
            for (samples, value) in kept.iter_mut().zip([drive.velocity_rpm, drive.current_a, drive.angle_degrees]) {
                let Some(value) = value.filter(|value| value.is_finite()) else { continue };
                // The same look is shown more than once.
                if samples.back().is_none_or(|(at, _)| *at < drive.at_s) {
                    samples.push_back((drive.at_s, value));
                }
                while samples.len() > MOST || samples.front().is_some_and(|(at, _)| *at < state.time_s - SPAN_S) {
                    samples.pop_front();
                }
            }
        }
    }

    /// A signal of a drive, with times before `now_s`.
    pub(super) fn of(&self, node: u8, signal: usize, now_s: f64) -> Vec<(f64, f64)> {
        let samples = self.0.get(&node).and_then(|signals| signals.get(signal));
        samples.into_iter().flatten().map(|(at, value)| (at - now_s, *value)).collect()
    }
}

/// An object of choice, read by SDO.
#[derive(Clone, Debug)]
pub(super) struct Plotted {
    pub(super) node: u8,
    /// As it was typed.
    pub(super) name: String,
    /// When it is read again; `None` while an answer is awaited.
    next: Option<Instant>,
    samples: Samples,
}

/// How often it is read: as often as the host looks at a drive.
const EVERY: Duration = Duration::from_millis(50);

impl Plotted {
    pub(super) fn new(node: u8, name: String) -> Self {
        Self { node, name, next: Some(Instant::ZERO), samples: Samples::new() }
    }

    /// The message that reads it, when it is time for that.
    pub(super) fn ask(&mut self, now: Instant) -> Option<Value> {
        self.next.take_if(|next| *next <= now)?;
        Some(json!({ "do": READING, "node": self.node, "objects": [self.name] }))
    }

    /// The answer to that, which came at this time.
    ///
    /// # Errors
    /// Why there is nothing to plot.
    pub(super) fn take(&mut self, answer: &Value, (now, time_s): (Instant, f64)) -> Result<(), String> {
        self.next = Some(now + EVERY);
        if let Some(error) = answer["error"]["message"].as_str() {
            return Err(error.to_owned());
        }
        let value = &answer["result"]["values"][0];
        if let Some(refused) = value["refused"].as_str() {
            return Err(refused.to_owned());
        }
        // A value and its unit or meaning.
        let text = value["text"].as_str().unwrap_or_default();
        let number = text.split_whitespace().next().and_then(|word| word.parse::<f64>().ok());
        let number = number.ok_or_else(|| format!("'{text}' is not a number"))?;
        self.samples.push_back((time_s, number));
        while self.samples.front().is_some_and(|(at, _)| *at < time_s - SPAN_S) {
            self.samples.pop_front();
        }
        Ok(())
    }

    /// Its values, with times before `now_s`.
    pub(super) fn values(&self, now_s: f64) -> Vec<(f64, f64)> {
        self.samples.iter().map(|(at, value)| (at - now_s, *value)).collect()
    }
}

/// What reads objects, as a word of a message.
pub(super) const READING: &str = "read_objects";

/// The axis that shows these values: round bounds that all are within, never narrower than a tenth.
pub(super) fn bounds(values: &[(f64, f64)]) -> [f64; 2] {
    let low = values.iter().map(|(_, value)| *value).fold(f64::INFINITY, f64::min);
    let high = values.iter().map(|(_, value)| *value).fold(f64::NEG_INFINITY, f64::max);
    if low > high {
        return [0.0, 1.0];
    }
    let span = (high - low).max(0.1);
    // One, two or five times a power of ten, at most a quarter of what is shown.
    let power = 10_f64.powf((span / 4.0).log10().floor());
    let step = [5.0, 2.0, 1.0].map(|times| times * power).into_iter().find(|step| *step <= span / 4.0).unwrap_or(power);
    [(low / step).floor() * step, (high / step).floor() * step + step]
}

#[cfg(test)]
mod tests {
    use super::*;
    use host::{DriveView, NodeView};

    fn state(time_s: f64, at_s: f64, velocity_rpm: Option<f64>) -> Snapshot {
        let drive = Some(Box::new(DriveView { at_s, velocity_rpm, ..DriveView::default() }));
        Snapshot { time_s, nodes: vec![NodeView { node: 4, drive, ..NodeView::default() }], ..Snapshot::default() }
    }

    #[test]
    fn each_look_is_kept_once_for_a_minute() {
        let mut past = Past::default();
        for (time_s, at_s, rpm) in [(0.1, 0.1, 1.0), (0.15, 0.1, 1.0), (0.2, 0.2, 2.0), (60.15, 60.15, 3.0)] {
            past.note(&state(time_s, at_s, Some(rpm)));
        }
        let kept = past.of(4, 0, 60.15);
        assert_eq!(kept.iter().map(|(_, value)| *value).collect::<Vec<_>>(), [2.0, 3.0]);
        assert!((kept[0].0 + 59.95).abs() < 1e-9 && kept[1].0 == 0.0);
        past.note(&state(60.2, 60.2, None));
        past.note(&state(60.3, 60.3, Some(f64::NAN)));
        assert_eq!(past.of(4, 0, 60.3).len(), 2, "what is not known is not a sample");
        past.note(&Snapshot { time_s: 61.0, ..Snapshot::default() });
        assert_eq!(past.of(4, 0, 61.0), []);
    }

    #[test]
    fn an_axis_has_round_bounds_around_all_values() {
        assert_eq!(bounds(&[]), [0.0, 1.0]);
        assert_eq!(bounds(&[(0.0, 0.0), (1.0, 97.0)]), [0.0, 100.0]);
        assert_eq!(bounds(&[(0.0, -60.2), (1.0, 60.0)]), [-80.0, 80.0]);
        let [low, high] = bounds(&[(0.0, 12.345)]);
        assert!(low <= 12.345 && high > 12.345 && high - low < 0.11, "{low} {high}");
    }
}
