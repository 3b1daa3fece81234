//! A capture: what was measured of one axis for a while, over one time axis, with what belongs to it.
//!
//! It is kept in the forms that a [`Record`] has. What is not a sample (name, notes, parameters) stands in one [`Mark`] at its
//! beginning, as JSON, so that MCAP and CSV hold it alike and every reader of records reads a capture. A record that was not made as
//! one (`ferrodrive record`, a simulator's) is read as a capture without a name.

use std::collections::BTreeMap;
use std::io;

use can::Instant;
use canopen::Mux;
use serde::{Deserialize, Serialize};
use sim::Place;
use words::object::{ObjectArg, object};

use super::column::{Column, Subject, is_called, unit_of};
use super::piece::{Kind, Mark, Recorded, Severity, Target};
use super::record::Record;

/// What was measured of one axis of a node.
#[derive(Clone, Debug, PartialEq)]
pub struct Capture {
    /// What it is called; empty for none.
    pub name: String,
    /// What a person noted.
    pub notes: String,
    /// The model of the drive, by its name; empty where that is not known.
    pub model: String,
    /// Node and axis.
    pub place: Place,
    /// When the trigger came, on the time axis; `None` without one.
    pub trigger_s: Option<f64>,
    /// Times of the rows in s, ascending, from the start of the capture.
    pub time_s: Vec<f64>,
    /// What was measured, by the names of the quantities, each with as many values as there are times.
    pub traces: Vec<Trace>,
    /// The drive's parameters as they were: bytes in the order of the wire.
    pub parameters: BTreeMap<Mux, Vec<u8>>,
    /// The end of its file is missing: what is there is whole up to the last row.
    pub is_cut_off: bool,
}

/// One quantity over the times of its capture.
#[derive(Clone, Debug, PartialEq)]
pub struct Trace {
    /// Its name, with the unit in it as in all records: `velocity_rpm`.
    pub quantity: String,
    /// Its unit as people write it; empty for what has none.
    pub unit: String,
    /// One for each time of the capture; not a number where no reading belongs to the time.
    pub values: Vec<f64>,
    /// Time between two readings, in s: the median. Not a number with fewer than two.
    pub period_s: f64,
    /// How much a time between two readings deviates from the period at most, in s, gaps left out.
    pub jitter_s: f64,
    /// Where readings are missing: times between two that are one and a half periods or longer.
    pub gaps: usize,
}

/// How the mark begins that holds what is not a sample.
pub(super) const ABOUT: &str = "capture {";

/// What that mark holds. Objects are written as `6083h:00`, values as pairs of hexadecimal digits.
#[derive(Debug, Default, Serialize, Deserialize)]
#[serde(default)]
struct About {
    name: String,
    notes: String,
    model: String,
    trigger_s: Option<f64>,
    parameters: BTreeMap<String, String>,
    /// By the names of the quantities, the units that these names do not have: CSV keeps a unit in the name alone.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    units: BTreeMap<String, String>,
}

/// A gap is a distance of more than so many periods.
const GAP: f64 = 1.5;

impl Trace {
    /// A trace with these values at `time_s`, which has as many.
    pub fn new(quantity: String, unit: String, values: Vec<f64>, time_s: &[f64]) -> Self {
        let (period_s, jitter_s, gaps) = spacing(time_s.iter().zip(&values).filter(|(_, value)| value.is_finite()));
        Self { quantity, unit, values, period_s, jitter_s, gaps }
    }
}

/// Period, jitter and number of gaps of readings at these times.
fn spacing<'a>(readings: impl Iterator<Item = (&'a f64, &'a f64)>) -> (f64, f64, usize) {
    let times: Vec<f64> = readings.map(|(at, _)| *at).collect();
    let distances: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let mut sorted = distances.clone();
    sorted.sort_by(f64::total_cmp);
    let Some(period_s) = sorted.get(sorted.len() / 2).copied() else { return (f64::NAN, f64::NAN, 0) };
    let (gaps, near): (Vec<f64>, Vec<f64>) = distances.iter().partition(|distance| **distance >= GAP * period_s);
    let jitter_s = near.iter().map(|distance| (distance - period_s).abs()).fold(0.0, f64::max);
    (period_s, jitter_s, gaps.len())
}

impl Capture {
    /// A trace by the name of its quantity, with its unit or without: `velocity`.
    pub fn trace(&self, quantity: &str) -> Option<&Trace> {
        self.traces.iter().find(|trace| is_called(&trace.quantity, quantity))
    }

    /// The readings of a trace: time in s and value, without the times at which it has none.
    pub fn points<'a>(&'a self, trace: &'a Trace) -> impl Iterator<Item = (f64, f64)> + 'a {
        let all = self.time_s.iter().copied().zip(trace.values.iter().copied());
        all.filter(|(_, value)| value.is_finite())
    }

    /// The axes of which a record has values.
    pub fn places(recorded: &Recorded) -> Vec<Place> {
        let mut places = Vec::new();
        for series in &recorded.series {
            if let Subject::Axis(place) = series.column.subject
                && !places.contains(&place)
            {
                places.push(place);
            }
        }
        places
    }

    /// What a record has of a node; see [`Self::of`].
    ///
    /// # Errors
    /// Those of [`Self::of`].
    pub fn of_node(recorded: &Recorded, node: Option<u8>) -> Result<Self, String> {
        Self::of(recorded, node.map(Place::node))
    }

    /// What a record has of an axis; of its only one with `None`. Readings of all its traces at one time are one row.
    ///
    /// # Errors
    /// In a sentence: it has nothing of the axis, or of several and none was named.
    pub fn of(recorded: &Recorded, place: Option<Place>) -> Result<Self, String> {
        let places = Self::places(recorded);
        let names = || places.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
        let place = match (place, places.as_slice()) {
            (_, []) => return Err("no values of an axis are in it".into()),
            (Some(place), _) if places.contains(&place) => place,
            (Some(place), _) => return Err(format!("no values of node {place} are in it, only of: {}", names())),
            (None, [only]) => *only,
            (None, _) => return Err(format!("values of several axes are in it; name one of: {}", names())),
        };
        let of_it = || recorded.series.iter().filter(|series| series.column.subject == Subject::Axis(place));
        let with_value = |(at, value): &(f64, f64)| value.is_finite().then_some(*at);
        let mut time_s: Vec<f64> = of_it().flat_map(|series| series.points.iter().filter_map(with_value)).collect();
        time_s.sort_by(f64::total_cmp);
        time_s.dedup();
        let About { name, notes, model, trigger_s, parameters, mut units } = about(recorded)?;
        let traces = of_it().map(|series| {
            let mut values = vec![f64::NAN; time_s.len()];
            for (at, value) in series.points.iter().filter(|(_, value)| value.is_finite()) {
                if let Ok(row) = time_s.binary_search_by(|time| time.total_cmp(at)) {
                    values[row] = *value;
                }
            }
            let Column { signal, unit, .. } = &series.column;
            let unit = units.remove(signal.as_ref()).unwrap_or_else(|| unit.clone().into_owned());
            Trace::new(signal.clone().into_owned(), unit, values, &time_s)
        });
        let mut traces: Vec<Trace> = traces.collect();
        traces.sort_by(|a, b| a.quantity.cmp(&b.quantity));
        let parameters = parameters.iter().map(|(object, value)| parameter(object, value)).collect::<Result<_, _>>()?;
        let is_cut_off = recorded.torn;
        Ok(Self { name, notes, model, place, trigger_s, time_s, traces, parameters, is_cut_off })
    }

    /// Writes it as a record of this kind.
    ///
    /// # Errors
    /// What the target says.
    pub fn write(&self, kind: Kind, target: Box<dyn Target>) -> io::Result<()> {
        let columns = self.traces.iter().map(|trace| Column {
            subject: Subject::Axis(self.place),
            signal: trace.quantity.clone().into(),
            unit: trace.unit.clone().into(),
        });
        let mut record = Record::exact(kind, target, &columns.collect::<Vec<_>>())?;
        let (of, kind) = ("".into(), "".into());
        record.mark(&Mark { at: Instant::ZERO, of, kind, severity: Severity::Note, text: self.about() })?;
        let mut row = vec![f64::NAN; self.traces.len()];
        for (at, time_s) in self.time_s.iter().enumerate() {
            for (value, trace) in row.iter_mut().zip(&self.traces) {
                *value = trace.values.get(at).copied().unwrap_or(f64::NAN);
            }
            record.row(Instant::from_nanos((time_s * 1e9).round() as u64), &row)?;
        }
        record.finish()
    }

    fn about(&self) -> String {
        let hex = |bytes: &Vec<u8>| bytes.iter().map(|byte| format!("{byte:02X}")).collect::<String>();
        let unnamed = self.traces.iter().filter(|trace| unit_of(&trace.quantity) != trace.unit);
        let about = About {
            name: self.name.clone(),
            notes: self.notes.clone(),
            model: self.model.clone(),
            trigger_s: self.trigger_s,
            parameters: self.parameters.iter().map(|(object, value)| (object.to_string(), hex(value))).collect(),
            units: unnamed.map(|trace| (trace.quantity.clone(), trace.unit.clone())).collect(),
        };
        // Names and texts alone: nothing in it has no form in JSON.
        format!("capture {}", serde_json::to_string(&about).unwrap_or_default())
    }
}

fn about(recorded: &Recorded) -> Result<About, String> {
    let mark = recorded.marks.iter().find(|mark| mark.text.starts_with(ABOUT));
    let Some(mark) = mark else { return Ok(About::default()) };
    // In CSV other marks of the same line may stand behind it.
    let mut values = serde_json::Deserializer::from_str(&mark.text[ABOUT.len() - 1..]).into_iter();
    let about = values.next().unwrap_or_else(|| Ok(About::default()));
    about.map_err(|error| format!("its description as a capture is not readable: {error}"))
}

fn parameter(text: &str, value: &str) -> Result<(Mux, Vec<u8>), String> {
    let wrong = |what: &str| format!("its parameter {text} = '{value}' is not {what}");
    let Ok(ObjectArg::Mux(mux)) = object(text) else { return Err(wrong("of an object such as 6083h:00")) };
    let pairs = value.as_bytes().chunks(2).map(|pair| {
        let digits = std::str::from_utf8(pair).ok().filter(|pair| pair.len() == 2);
        digits.and_then(|digits| u8::from_str_radix(digits, 16).ok())
    });
    let bytes = pairs.collect::<Option<Vec<u8>>>().ok_or_else(|| wrong("pairs of hexadecimal digits"))?;
    Ok((mux, bytes))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::convert::Memory;
    use crate::{mcap_of_csv, read};

    fn capture() -> Capture {
        let time_s: Vec<f64> = (0..50).map(|row| f64::from(row) / 1e3).collect();
        let speed = time_s.iter().map(|at| 60.0 * (1.0 - (-at / 0.01).exp())).collect();
        // Every second reading only.
        let current = (0..50).map(|row| if row % 2 == 0 { f64::from(row) * 0.1 } else { f64::NAN }).collect();
        Capture {
            name: "step, 60 r/min".into(),
            notes: "cold; \"belt\" tight\nsecond line".into(),
            model: "zlac8030l".into(),
            place: Place::node(4),
            trigger_s: Some(0.012),
            traces: vec![
                Trace::new("current_a".into(), "A".into(), current, &time_s),
                // Units that their names do not have: none, and another than it ends with.
                Trace::new("motor_current".into(), "mA".into(), vec![250.0; 50], &time_s),
                Trace::new("phase_a".into(), String::new(), vec![1.0; 50], &time_s),
                Trace::new("velocity_rpm".into(), "r/min".into(), speed, &time_s),
            ],
            time_s,
            parameters: [(Mux::new(0x6083, 0), vec![0xE8, 3, 0, 0]), (Mux::new(0x1008, 0), vec![])].into(),
            is_cut_off: false,
        }
    }

    #[test]
    fn a_capture_reads_back_as_it_was_from_each_form_and_through_both() {
        let made = capture();
        for kind in [Kind::Mcap, Kind::Csv] {
            let memory = Memory::default();
            made.write(kind, Box::new(memory.clone())).unwrap();
            let recorded = read(kind, &memory.contents()).unwrap();
            // Not a number is not equal to itself.
            assert_eq!(format!("{:?}", Capture::of(&recorded, None).unwrap()), format!("{made:?}"), "{kind:?}");
            if kind == Kind::Csv {
                let mcap = mcap_of_csv(&memory.contents()).unwrap();
                let both = Capture::of(&read(Kind::Mcap, &mcap).unwrap(), None).unwrap();
                assert_eq!(format!("{both:?}"), format!("{made:?}"));
            }
        }
    }

    #[test]
    fn period_and_jitter_are_those_of_the_readings_and_a_gap_is_not_jitter() {
        let made = capture();
        let periods: Vec<f64> = made.traces.iter().map(|trace| (trace.period_s * 1e6).round()).collect();
        assert_eq!(periods, [2000.0, 1000.0, 1000.0, 1000.0]);
        // Readings of 1 ms of which one is 0.2 ms late, and two are lost.
        let time_s = [0.0, 1.0, 2.2, 3.0, 6.0, 7.0].map(|ms| ms * 1e-3);
        let trace = Trace::new("x".into(), String::new(), vec![0.0; 6], &time_s);
        let us = |s: f64| (s * 1e6).round();
        assert_eq!((us(trace.period_s), us(trace.jitter_s), trace.gaps), (1000.0, 200.0, 1));
        let one = Trace::new("x".into(), String::new(), vec![1.0, f64::NAN], &[0.0, 1.0]);
        assert!(one.period_s.is_nan() && one.jitter_s.is_nan() && one.gaps == 0);
    }

    #[test]
    fn any_record_is_a_capture_and_the_axis_is_named_where_there_are_several() {
        let csv = "t_s,4.velocity_rpm,5.2.velocity_rpm,mark\n0,1,,\n0.001,,7,\n0.002,2,,node 4: over-voltage\n";
        let recorded = read(Kind::Csv, csv.as_bytes()).unwrap();
        let four = Capture::of(&recorded, Some(Place::node(4))).unwrap();
        assert_eq!((four.name.as_str(), four.time_s.as_slice()), ("", &[0.0, 0.002][..]));
        assert_eq!(four.points(four.trace("velocity").unwrap()).collect::<Vec<_>>(), [(0.0, 1.0), (0.002, 2.0)]);
        let refused = |place| Capture::of(&recorded, place).unwrap_err();
        assert_eq!(refused(None), "values of several axes are in it; name one of: 4, 5.2");
        assert_eq!(refused(Some(Place::node(7))), "no values of node 7 are in it, only of: 4, 5.2");
    }

    #[test]
    fn a_capture_that_was_cut_off_says_so_and_keeps_its_rows() {
        let memory = Memory::default();
        capture().write(Kind::Csv, Box::new(memory.clone())).unwrap();
        let bytes = memory.contents();
        let recorded = read(Kind::Csv, &bytes[..bytes.len() - 3]).unwrap();
        let cut = Capture::of(&recorded, None).unwrap();
        assert!(cut.is_cut_off && cut.time_s.len() == 49 && cut.name == capture().name);
    }

    #[test]
    fn a_description_that_is_broken_is_refused_in_words() {
        let of = |mark: &str| {
            let csv = format!("t_s,4.velocity_rpm,mark\n0,1,{mark}\n");
            Capture::of(&read(Kind::Csv, csv.as_bytes()).unwrap(), None)
        };
        assert!(of("capture {").unwrap_err().contains("not readable"));
        let bad = of("\"capture {\"\"parameters\"\":{\"\"6083h:00\"\":\"\"E8 3\"\"}}\"").unwrap_err();
        assert_eq!(bad, "its parameter 6083h:00 = 'E8 3' is not pairs of hexadecimal digits");
        assert!(of("\"capture {\"\"name\"\":\"\"a\"\"}; node 4: fault\"").unwrap().name == "a");
    }
}
