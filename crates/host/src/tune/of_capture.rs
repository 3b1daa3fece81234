//! What a capture of any instrument shows of a drive: its frequency response with coherence, one or two masses, and the speed loop where
//! the set-point was captured too. Nothing moves, and no gains are proposed: what a count of them is worth on that drive is not in
//! a capture.

use std::f64::consts::TAU;

use canopen::od::DefaultValue;
use cia402::RAD_S_PER_RPM;
use devices::{CountsPerTurn, Description};
use plot::{Figure, Poster};
use recording::{Capture, Trace};
use serde::Serialize;
use sim::machine::is_built_in;
use tune::{Mechanics, Response, Samples};
use words::failure::Failure;

use super::{ResponseRow, constant_of, motor_of};

/// Signals by the names of their quantities without their units, the best first: those of captures, and those of objects in a log of frames.
const SET_POINTS: [&str; 5] =
    ["velocity_demand", "velocity_demand_value", "target_velocity", "sent_target_velocity", "set_point"];
const CURRENTS: [&str; 6] = [
    "current_demand",
    "torque_demand",
    "torque_demand_value",
    "current",
    "current_actual_value",
    "torque_actual_value",
];
const POSITIONS: [&str; 2] = ["position", "position_actual_value"];
const SPEEDS: [&str; 2] = ["velocity", "velocity_actual_value"];

/// How the name of a position ends that is not in degrees.
const COUNTS: &str = "_counts";

/// Times between two rows that are as much longer than the others are gaps.
const GAP: f64 = 1.5;
/// How much they may differ, as a share of them, to be taken as equal; and how much to be read at equal times between two rows each, as what
/// comes by an event timer on a bus with other frames.
const EVEN: f64 = 0.1;
const UNEVEN: f64 = 0.6;
/// Rows over which it is looked which way a shaft turns.
const TURNS_OVER: usize = 20;

/// What was found in a capture. Torques and inertia are those at the shaft whose angle it has.
#[derive(Clone, Debug, Serialize)]
pub struct CaptureReport {
    /// Its node-ID.
    pub node: u8,
    /// Rows that were used: those without a gap between them.
    pub rows: usize,
    /// Time between two of them, s.
    pub period_s: f64,
    /// The quantities that were used: the current, the angle or speed, and the set-point, where there is one.
    pub quantities: Vec<String>,
    /// Frequencies at which the coherence was high enough.
    pub coherent: usize,
    /// Frequencies at which there is a response.
    pub frequencies: usize,
    /// Acceleration per current, (rad/s²)/A.
    pub gain_rad_s2_a: f64,
    /// Viscous friction over inertia, 1/s.
    pub viscous_per_s: f64,
    /// Inertia of all that turns, where the torque per ampere is known.
    pub inertia_kg_m2: Option<f64>,
    /// Viscous friction, where that is known.
    pub viscous_friction_nm_s: Option<f64>,
    /// Where the motor moves least, if the load swings.
    pub anti_resonance_hz: Option<f64>,
    /// Where it moves most.
    pub resonance_hz: Option<f64>,
    /// From the sample of the current to that of the motion.
    pub delay_ms: f64,
    /// How far the model of one or two masses is from the response: the median of the relative difference.
    pub model_off: f64,
    /// The proportional gain of the speed loop, A/(rad/s), where the set-point was captured.
    pub proportional_a_s_rad: Option<f64>,
    /// Its integral gain, A/rad.
    pub integral_a_rad: Option<f64>,
    /// What else is to be known.
    pub notes: Vec<String>,
    /// Speed per current, by ascending frequencies: what was captured and the model.
    pub response: Vec<ResponseRow>,
    /// The response and the model, as a Bode plot.
    #[serde(skip)]
    pub picture: Poster,
}

/// Counts in a turn of a model's shaft as it is delivered; `None` where its table does not say that.
fn delivered_counts(model: &Description) -> Option<f64> {
    match model.axes.first()?.units.counts_per_turn {
        CountsPerTurn::Fixed(counts) => Some(f64::from(counts)),
        CountsPerTurn::Object { object, factor } => match model.row(object)?.default {
            DefaultValue::Value(value) => Some(value as f64 * f64::from(factor)),
            _ => None,
        },
        CountsPerTurn::Table { counts, default, .. } => counts.get(default as usize).map(|counts| f64::from(*counts)),
        CountsPerTurn::Ratio { .. } => None,
    }
}

/// Torque per ampere at a model's shaft with the motor that it is delivered with; `None` where a reducer is between, or a maker says what
/// its objects are worth.
fn delivered_constant(model: &'static Description) -> Option<f64> {
    let loops = model.axes.first()?.loops.as_ref().filter(|loops| loops.demand.is_some())?;
    is_built_in(model).then(|| motor_of(model)).flatten().map(|motor| constant_of((model, loops), &motor, None))
}

/// What a capture shows of its drive. `torque_constant_nm_a` is the torque per ampere of its motor; where none is given, that of the
/// motor that `model` is delivered with is taken, and what a turn has where the capture counts. Without `model` it is the one that the
/// capture names.
///
/// # Errors
/// What it lacks, that its rows are not evenly spaced, and why nothing can be said of them.
pub fn of_capture(
    capture: &Capture,
    torque_constant_nm_a: Option<f64>,
    model: Option<&'static Description>,
) -> Result<CaptureReport, Failure> {
    let of_file = devices::model(&capture.model);
    let known = model.or(of_file);
    let counts_per_turn = known.and_then(delivered_counts);
    let failed = |reason: &dyn std::fmt::Display| {
        Failure::new(format!("nothing can be found from the capture of node {}", capture.place)).because(reason)
    };
    let signals = UsedTraces::of(capture, counts_per_turn).map_err(|reason| failed(&reason).of_kind("bad_file"))?;
    let (samples, mut notes) = signals.samples(capture).map_err(|reason| failed(&reason).of_kind("bad_file"))?;
    if let Some(counts) = counts_per_turn.filter(|_| signals.motion.0.quantity.ends_with(COUNTS)) {
        notes.push(format!("a turn is taken to have {counts} counts, as the model is delivered"));
    }
    if capture.is_cut_off {
        notes.push("the end of the file is missing: what is there was used".to_owned());
    }
    if turns_both_ways(&samples) {
        let note = "the shaft turned both ways, which shows its dry friction as inertia and viscous friction: a motion one way shows them better";
        notes.push(note.to_owned());
    }
    let response = tune::response(&samples, None).map_err(|error| failed(&error))?;
    let found = tune::identify(&response).map_err(|error| failed(&error))?;
    let own = (!samples.set_point_rad_s.is_empty()).then(|| tune::identify_loop(&response, &found, 0.0).ok()).flatten();
    if own.is_none() {
        notes.push(
            "without the set-point noise in the loop biases the response: capture velocity_demand too, or target_velocity".to_owned(),
        );
    }
    if let Some((of_file, model)) = of_file.zip(model).filter(|(of_file, model)| of_file.name != model.name) {
        notes.push(format!(
            "it was captured of a {}, and node {} is a {}",
            of_file.name, capture.place.node, model.name
        ));
    }
    let of_model = known.filter(|_| torque_constant_nm_a.is_none()).and_then(delivered_constant);
    if let Some(constant) = of_model {
        notes.push(format!("its motor is taken to have {constant:.3} N·m/A, as the model is delivered"));
    }
    let inertia_kg_m2 = torque_constant_nm_a.or(of_model).map(|constant| found.inertia_kg_m2(constant));
    if inertia_kg_m2.is_none() {
        notes.push(
            "the inertia takes the torque per ampere of its motor (--torque-constant of ferrodrive tune)".to_owned(),
        );
    }
    Ok(CaptureReport {
        node: capture.place.node,
        rows: samples.len(),
        period_s: samples.period_s,
        quantities: signals.names(),
        coherent: response.coherent().count(),
        frequencies: response.lines.len(),
        gain_rad_s2_a: found.gain,
        viscous_per_s: found.viscous_per_s,
        inertia_kg_m2,
        viscous_friction_nm_s: inertia_kg_m2.map(|inertia| inertia * found.viscous_per_s),
        anti_resonance_hz: found.elastic.map(|elastic| elastic.anti_resonance_hz),
        resonance_hz: found.elastic.map(|elastic| elastic.resonance_hz),
        delay_ms: found.delay_s * 1e3,
        model_off: found.off,
        proportional_a_s_rad: own.map(|own| own.proportional),
        integral_a_rad: own.map(|own| own.integral),
        notes,
        response: response.lines.iter().map(|line| ResponseRow::of(line, &found, None)).collect(),
        picture: picture(capture, &response, &found),
    })
}

/// How many rad, rad/s or A the unit of a trace is, by how its name ends after that of its quantity.
fn worth(trace: &Trace, ending: &str, counts_per_turn: Option<f64>) -> Option<f64> {
    match (ending, trace.unit.as_str()) {
        ("_deg", _) => Some(TAU / 360.0),
        ("_rpm", _) => Some(RAD_S_PER_RPM),
        ("_a" | "_rad", _) => Some(1.0),
        ("", "mA") => Some(1e-3),
        (COUNTS, _) => counts_per_turn.map(|counts| TAU / counts),
        _ => None,
    }
}

/// The traces that are used, each with what its unit is worth.
struct UsedTraces<'a> {
    current: (&'a Trace, f64),
    motion: (&'a Trace, f64),
    is_angle: bool,
    set_point: Option<(&'a Trace, f64)>,
}

impl<'a> UsedTraces<'a> {
    fn of(capture: &'a Capture, counts_per_turn: Option<f64>) -> Result<Self, String> {
        let find = |names: &[&str]| {
            let used = |name: &&str| {
                let of = |trace: &'a Trace| {
                    Some((trace, worth(trace, trace.quantity.strip_prefix(*name)?, counts_per_turn)?))
                };
                capture.traces.iter().find_map(of)
            };
            names.iter().find_map(used)
        };
        let had = || capture.traces.iter().map(|trace| trace.quantity.as_str()).collect::<Vec<_>>().join(", ");
        let lacks = |what: &str| {
            format!("it has no {what}, only {}: ferrodrive capture NODE velocity_demand current_demand position", had())
        };
        let current = find(&CURRENTS).ok_or_else(|| lacks("current in A: current_demand_a or current_a"))?;
        let angle = find(&POSITIONS);
        let counts = || capture.traces.iter().any(|trace| trace.quantity.ends_with(COUNTS));
        let motion = angle.or_else(|| find(&SPEEDS)).ok_or_else(|| match counts() {
            true => format!(
                "its position is in counts, and how many a turn has is not known: give the model (--model NODE=MODEL), or have velocity too; it has {}",
                had()
            ),
            false => lacks("motion: position_deg or velocity_rpm"),
        })?;
        Ok(Self { current, motion, is_angle: angle.is_some(), set_point: find(&SET_POINTS) })
    }

    fn all(&self) -> impl Iterator<Item = (&'a Trace, f64)> {
        [self.current, self.motion].into_iter().chain(self.set_point)
    }

    fn names(&self) -> Vec<String> {
        self.all().map(|(trace, _)| trace.quantity.clone()).collect()
    }

    /// The longest stretch of rows that have all of them without a gap, and what was left out.
    fn samples(&self, capture: &Capture) -> Result<(Samples, Vec<String>), String> {
        let whole = |row: &usize| self.all().all(|(trace, _)| trace.values[*row].is_finite());
        let rows: Vec<usize> = (0..capture.time_s.len()).filter(whole).collect();
        let distance = |pair: &[usize]| capture.time_s[pair[1]] - capture.time_s[pair[0]];
        // Over two rows: a host that is late sends the next one early.
        let mut distances: Vec<f64> =
            rows.windows(3).map(|three| 0.5 * (distance(&three[..2]) + distance(&three[1..]))).collect();
        distances.sort_by(f64::total_cmp);
        let Some(period_s) = distances.get(distances.len() / 2).copied() else {
            return Err(format!("no three rows have all of {}: capture them at one rate", self.names().join(", ")));
        };
        let stretches = rows.chunk_by(|a, b| capture.time_s[*b] - capture.time_s[*a] < GAP * period_s);
        let used = stretches.max_by_key(|stretch| stretch.len()).unwrap_or_default();
        let off = used.windows(2).map(|pair| (distance(pair) - period_s).abs()).fold(0.0, f64::max);
        let (off_ms, period_ms) = (off * 1e3, period_s * 1e3);
        if off > UNEVEN * period_s {
            return Err(format!(
                "its rows are not evenly spaced: {period_ms:.3} ms apart, and {off_ms:.3} ms more or less; capture by SYNC, --rate 1ms"
            ));
        }
        let is_even = off <= EVEN * period_s;
        let times: Vec<f64> = used.iter().map(|row| capture.time_s[*row]).collect();
        let [first, .., last] = times[..] else { return Err("it has too few rows".to_owned()) };
        let period_s = if is_even { period_s } else { (last - first) / (times.len() - 1) as f64 };
        let mut samples = Samples { period_s, ..Samples::default() };
        let values = |(trace, worth): (&Trace, f64)| {
            let all: Vec<f64> = used.iter().map(|row| trace.values[*row] * worth).collect();
            if is_even { all } else { at_equal_times(&times, &all) }
        };
        samples.current_a = values(self.current);
        samples.position_rad = values(self.motion);
        if !self.is_angle {
            let mut angle = 0.0;
            let mut before = samples.position_rad.first().copied().unwrap_or_default();
            for value in &mut samples.position_rad {
                let speed = std::mem::replace(&mut before, *value);
                angle += 0.5 * (speed + *value) * period_s;
                *value = angle;
            }
        }
        samples.set_point_rad_s = self.set_point.map(values).unwrap_or_default();
        let left = capture.time_s.len() - used.len();
        let gaps = format!("{} of {} rows were used: the longest stretch without a gap", used.len(), used.len() + left);
        let uneven = format!(
            "its rows are {period_ms:.3} ms apart, and {off_ms:.3} ms more or less: they were read at equal times"
        );
        let notes = [(left > 0, gaps), (!is_even, uneven)].into_iter().filter(|(is_so, _)| *is_so);
        Ok((samples, notes.map(|(_, note)| note).collect()))
    }
}

/// More than a twentieth of its way is to each side.
fn turns_both_ways(samples: &Samples) -> bool {
    // Over so many rows the counts of an encoder do not matter.
    let ways = samples.position_rad.windows(TURNS_OVER).step_by(TURNS_OVER).map(|rows| rows[TURNS_OVER - 1] - rows[0]);
    let (forward, back): (Vec<f64>, Vec<f64>) = ways.partition(|way| *way > 0.0);
    let [forward, back] = [forward, back].map(|ways| ways.into_iter().sum::<f64>().abs());
    forward.min(back) > 0.05 * (forward + back)
}

/// Values on straight lines between these times, as many and equally far apart from the first to the last.
fn at_equal_times(times: &[f64], values: &[f64]) -> Vec<f64> {
    let (first, last) = (times[0], times[times.len() - 1]);
    let mut before = 0;
    let at = |row: usize| first + (last - first) * row as f64 / (times.len() - 1) as f64;
    let value = |row: usize| {
        let time = at(row);
        while before + 2 < times.len() && times[before + 1] < time {
            before += 1;
        }
        let share = (time - times[before]) / (times[before + 1] - times[before]);
        values[before] + share * (values[before + 1] - values[before])
    };
    (0..times.len()).map(value).collect()
}

fn picture(capture: &Capture, response: &Response, found: &Mechanics) -> Poster {
    let bode: Figure = tune::bode("Frequency response", response, Some(found));
    let title = if capture.name.is_empty() { format!("node {}", capture.place) } else { capture.name.clone() };
    Poster { title, subtitle: "captured, and the model".to_owned(), rows: vec![vec![bode]] }
}
