//! The whole of it: measured, found, proposed, tried on the twin; and then on the drive. As the rows that programs read.

use std::ops::RangeInclusive;
use std::path::PathBuf;
use std::time::Duration;

use devices::Description;
use master::Drive;
use master::cyclic::CyclicOptions;
use plot::{Colour, Figure, Panel, Poster, Style, Trace};
use serde::Serialize;
use tune::{Margins, Mechanics, Objective, Unusable};
use words::counted;
use words::failure::{Failure, both};

use crate::capture::Restorer;

use super::bench::SWINGS;
use super::measure::measure_in_time;
use super::sampled;
use super::{
    Bounds, Currents, Curves, Excursion, Found, Measurement, MoveRow, OutputLoad, Proposed, Reader, ResponseRow, Setup,
    Shaft, StepResponse, Trial, Twin, Unreachable, constant_of, loops_of, motor_of, speed_gains,
};

/// How often the load of a twin is corrected, and the relative difference at which it is right.
const CORRECTIONS: usize = 8;
const ALIKE: f64 = 3e-3;

/// Shortest and longest time between two samples: 1 ms and 4096 counts a turn show what there is to see, and a tenth of the rate is to
/// be beyond a loop's bandwidth.
const RANGE: RangeInclusive<Duration> = Duration::from_micros(500)..=Duration::from_millis(10);
/// Those that are tried, where none is given: a bus of 500 kbit/s has no room for a cycle of 1 ms, and few computers are in time for one
/// over a socket.
pub const SAMPLE_PERIODS: [Duration; 4] =
    [Duration::from_millis(1), Duration::from_millis(2), Duration::from_millis(5), Duration::from_millis(10)];

/// How often gains are made slower, and by how much.
const SLOWER: usize = 12;
const SLOWER_BY: f64 = 0.85;
/// A gain that falls to one at more than this share of what was seen would fall there later, if more had been seen.
const AT_ITS_END: f64 = 0.9;

/// The ranges of what is asked for, with their units. Beyond these is what is mistyped, or not a number.
const SPEED_RPM: RangeInclusive<f64> = 1.0..=100_000.0;
const CURRENT_A: RangeInclusive<f64> = 0.01..=10_000.0;
const TRAVEL_TURNS: RangeInclusive<f64> = 0.1..=10_000.0;
const BANDWIDTH_HZ: RangeInclusive<f64> = 0.1..=500.0;
const PHASE_MARGIN_DEG: RangeInclusive<f64> = 10.0..=80.0;
const TORQUE_CONSTANT_NM_A: RangeInclusive<f64> = 1e-4..=1e3;

/// What is asked for.
#[derive(Clone, Debug)]
pub struct Request {
    /// What the speed loop is to reach.
    pub objective: Objective,
    /// The gain of the position loop too.
    pub with_position: bool,
    /// Time from one sample to the next; `None`: the first of [`SAMPLE_PERIODS`] that drive, bus and program keep up with.
    pub period: Option<Duration>,
    /// What the motion keeps to.
    pub bounds: Bounds,
    /// How late the program may be, and what guards the drive.
    pub cyclic: CyclicOptions,
    /// Torque per ampere, N m/A, where the motor is not the model's own.
    pub torque_constant_nm_a: Option<f64>,
    /// Where the way back is kept while the drive is measured; `None` on a bus that ends with the program.
    pub journal: Option<PathBuf>,
    /// Hears what to do about a journal that stays.
    pub on_kept: fn(&str),
    /// Write the proposed values to the drive, and try them there.
    pub apply: bool,
    /// Longest time for that transaction.
    pub within: Duration,
}

impl Request {
    /// The periods that are tried, and what the motion keeps to.
    fn in_cycles(&self) -> (&[Duration], Bounds, CyclicOptions) {
        let periods = self.period.as_ref().map_or(&SAMPLE_PERIODS[..], std::slice::from_ref);
        (periods, self.bounds, self.cyclic)
    }

    /// Whether a measurement can be made so.
    ///
    /// # Errors
    /// What is out of range, and what is not.
    pub fn check(&self) -> Result<(), Failure> {
        if let Some(period) = self.period.filter(|period| !RANGE.contains(period)) {
            let what = format!("expected a period from {:?} to {:?}, got {period:?}", RANGE.start(), RANGE.end());
            return Err(Failure::usage(what).next("1 ms suits a bus of 1 Mbit/s, e.g. --period 1ms"));
        }
        let Bounds { speed_rpm, current_a, travel_turns } = self.bounds;
        let objective = match self.objective {
            Objective::Bandwidth(hz) => ("bandwidth", "Hz", hz, BANDWIDTH_HZ),
            Objective::PhaseMargin(degrees) => ("phase margin", "degrees", degrees, PHASE_MARGIN_DEG),
        };
        let constant = self.torque_constant_nm_a;
        let constant = constant.map(|constant| ("torque constant", "N·m/A", constant, TORQUE_CONSTANT_NM_A));
        let bounds = [
            ("speed", "r/min", speed_rpm, SPEED_RPM),
            ("current", "A", current_a, CURRENT_A),
            ("travel", "turns", travel_turns, TRAVEL_TURNS),
        ];
        for (what, unit, value, range) in bounds.into_iter().chain([objective]).chain(constant) {
            if !range.contains(&value) {
                let (least, most) = (range.start(), range.end());
                return Err(Failure::usage(format!("expected a {what} from {least} to {most} {unit}, got {value}"))
                    .next("nothing was moved"));
            }
        }
        Ok(())
    }
}

/// What was found and is proposed. Torques and inertia are those at the motor's shaft.
#[derive(Debug, Serialize)]
pub struct TuneReport {
    /// Its node-ID.
    pub node: u8,
    /// Its model.
    pub model: &'static str,
    /// Inertia of all that turns.
    pub inertia_kg_m2: f64,
    /// Dry friction.
    pub dry_friction_nm: f64,
    /// Viscous friction.
    pub viscous_friction_nm_s: f64,
    /// What pushes the shaft in one direction; positive against positive motion.
    pub load_nm: f64,
    /// Torque per ampere with which these were computed.
    pub torque_constant_nm_a: f64,
    /// Where the motor moves least, if the load swings.
    pub anti_resonance_hz: Option<f64>,
    /// Where it moves most.
    pub resonance_hz: Option<f64>,
    /// What comes late in the speed loop, its filter apart.
    pub loop_delay_ms: f64,
    /// Frequencies at which the coherence was high enough.
    pub coherent: usize,
    /// Frequencies at which it was measured.
    pub frequencies: usize,
    /// How far the model of one or two masses is from what was measured: the median of the relative difference.
    pub model_off: f64,
    /// How far the measured response of the twin is from that of the drive, likewise.
    pub twin_off: f64,
    /// Time from one sample to the next; `None` of a joint, whose readings take as long as they take.
    pub period_ms: Option<f64>,
    /// The share of the drive's gains with which it was measured: below 1 where its speed loop swings by itself.
    pub gain_share: f64,
    /// The most current that was asked for.
    pub peak_a: f64,
    /// The farthest that the shaft was from where it had stood.
    pub travel_turns: f64,
    /// Proposed values.
    pub gains: Vec<GainRow>,
    /// Margins of the speed loop with the drive's gains.
    pub before: MarginRow,
    /// Margins of the speed loop with those that are proposed.
    pub after: MarginRow,
    /// Margins of the position loop, if it was asked for.
    pub position: Option<MarginRow>,
    /// A step of the set-point and a load on the twin: integral of the absolute error, r/min s, before and after.
    pub twin_error: [f64; 2],
    /// A move on the twin by its own ramps, before and after, where the position loop was asked for.
    pub twin_move: Option<[MoveRow; 2]>,
    /// The same of a step on the drive, once the values were tried there. Both without what swings fast at a steady speed, where the error
    /// was larger after than before: when the drive read its positions decides nothing.
    pub drive_error: Option<[f64; 2]>,
    /// The move on the drive.
    pub drive_move: Option<[MoveRow; 2]>,
    /// The drive has the proposed values.
    pub applied: bool,
    /// What else is to be known.
    pub notes: Vec<String>,
    /// Speed per current demand, by ascending frequencies; empty for a drive that is measured by SDO, which is too slow for it.
    pub response: Vec<ResponseRow>,
    /// What else of it is drawn.
    #[serde(skip)]
    pub curves: Curves,
    /// Bode plot, and the trials.
    #[serde(skip)]
    pub picture: Poster,
}

/// An object of a proposal.
#[derive(Debug, Serialize)]
pub struct GainRow {
    /// Such as `201Dh:00`.
    pub object: String,
    /// Its name.
    pub name: &'static str,
    /// What it has.
    pub before: i64,
    /// What is proposed.
    pub after: i64,
}

/// How far a loop is from being unstable.
#[derive(Debug, Serialize)]
pub struct MarginRow {
    /// Where its gain falls to one for the last time.
    pub crossover_hz: f64,
    /// Least phase where it is one.
    pub phase_deg: f64,
    /// Largest sensitivity.
    pub sensitivity: f64,
    /// Nyquist's criterion.
    pub stable: bool,
}

impl From<Margins> for MarginRow {
    fn from(margins: Margins) -> Self {
        let Margins { crossover_hz, phase_deg, sensitivity, is_stable, .. } = margins;
        Self { crossover_hz, phase_deg, sensitivity, stable: is_stable }
    }
}

/// Measures a drive, and finds gains for it. The drive has what it had in the end.
///
/// # Errors
/// What stopped it, what is not possible with this drive, and that not everything could be put back.
pub async fn find(
    (drive, restorer): (&Drive, &Restorer),
    request: &Request,
    excursion: &mut Excursion,
) -> Result<(TuneReport, Proposed), Failure> {
    request.check()?;
    let (model, loops) = loops_of(drive)?;
    let id = drive.node().id();
    let failed = |reason: &dyn std::fmt::Display| {
        Failure::new(format!("node {id}: nothing could be found")).at_node(id).because(reason)
    };
    let motor = motor_of(model).ok_or_else(|| failed(&"no motor with magnets is known for its model"))?;
    let (journal, on_kept) = (request.journal.as_deref(), request.on_kept);
    let had = Setup::begin((drive, restorer), (model, loops), &speed_gains(loops), journal, on_kept).await?;
    restorer.begin_motion(loops.demand.is_some());
    let (period, found, twin, twin_off, response) = match (loops.demand, loops.stated, motor.gear) {
        (None, Some(stated), Some(gear)) => {
            let currents = both(currents(drive, &had, request, excursion).await, had.put_back(drive).await)?;
            let mut motor = motor;
            if let Some(constant) = request.torque_constant_nm_a {
                motor.windings.flux_linkage_wb *= constant / motor.windings.torque_constant_nm_a();
            }
            let shaft = Shaft { motor: &motor, gear: &gear, stated: &stated };
            let (found, twin, off) = by_readings((model, loops), &shaft, &had, (&currents, request.bounds)).await?;
            (None, found, twin, off, Vec::new())
        }
        _ => {
            let measured = measure_in_time(drive, &had, loops, request.in_cycles(), excursion).await;
            let (period, measured) = both(measured, had.put_back(drive).await)?;
            let own = constant_of((model, loops), &motor, had.rated_constant());
            let constant = request.torque_constant_nm_a.or(loops.torque_constant_nm_a).unwrap_or(own);
            let (seen, constants) = ((&measured, &had), (&motor, constant, own));
            let how = (period, request.bounds);
            let it = sampled::find((model, loops), seen, constants, how, failed).await?;
            let (off, response) = between(&measured, &it.of_twin, &it.seems).map_err(|error| failed(&error))?;
            (Some(period), it.found, it.twin, off, response)
        }
    };
    let how = (period.or(request.period).unwrap_or(SAMPLE_PERIODS[0]), request.bounds);
    // On the twin a large current does no harm.
    let wide = (how.0, Bounds { current_a: f64::MAX, travel_turns: f64::MAX, ..how.1 });
    let objective = (request.objective, twin.disturbance(request.bounds));
    let of = |most_hz| Proposed::of(&found, &had, (model, loops), objective, most_hz, request.with_position);
    let proposed = of(found.seen_hz()).map_err(|reason| match reason {
        Unreachable::Margins { .. } => {
            failed(&reason).next("ask for less, e.g. --phase-margin 30; or stiffen the coupling of the load")
        }
        _ => failed(&reason),
    })?;
    let (proposed, calmer) = calm(proposed, of, (&twin, wide, SWINGS * request.bounds.current_a)).await?;
    let after = proposed.values();
    let trials = [twin.try_out(&[], wide).await?, twin.try_out(&after, wide).await?];
    let mut report = TuneReport {
        twin_off,
        peak_a: excursion.peak_a,
        travel_turns: excursion.travel_turns,
        period_ms: period.map(|period| period.as_secs_f64() * 1e3),
        notes: notes(&found, &proposed, request, period).into_iter().chain(calmer).collect(),
        ..rows(id.raw(), model, &found, &proposed, &trials)
    };
    report.response = response;
    if request.with_position {
        let moves = [twin.try_move(&[], how.1.speed_rpm).await?, twin.try_move(&after, how.1.speed_rpm).await?];
        if moves[1].settled_s.is_none() {
            report.notes.push("on the twin a move does not settle with the proposed gains".to_owned());
        }
        report.twin_move = Some(moves);
    }
    Ok((report, proposed))
}

/// Gains with which the current of the twin does not swing by the encoder's counts where the shaft turns slowly: those that are proposed, or
/// slower ones. And what is to be said of that.
async fn calm(
    mut proposed: Proposed,
    of: impl Fn(f64) -> Result<Proposed, Unreachable>,
    (twin, how, most_a): (&Twin, (Duration, Bounds), f64),
) -> Result<(Proposed, Option<String>), Failure> {
    let first_a = twin.slow_ripple_a(&proposed.values(), how).await?;
    if first_a <= most_a {
        return Ok((proposed, None));
    }
    let (most_a, first_hz) = (most_a.max(twin.slow_ripple_a(&[], how).await?), proposed.after.crossover_hz);
    let mut last_a = first_a;
    for _ in 0..SLOWER {
        let Ok(next) = of(SLOWER_BY * proposed.after.crossover_hz) else { break };
        proposed = next;
        last_a = twin.slow_ripple_a(&proposed.values(), how).await?;
        if last_a <= most_a {
            break;
        }
    }
    let why = "at a slow speed, because of its encoder's resolution";
    let note = if last_a <= most_a {
        format!("faster gains ({first_hz:.0} Hz) make the current of the twin swing by {first_a:.2} A {why}")
    } else {
        format!("these gains make the current of the twin swing by {last_a:.2} A {why}: no slower ones were found")
    };
    Ok((proposed, Some(note)))
}

/// Currents that the drive shows.
async fn currents(
    drive: &Drive,
    setup: &Setup,
    request: &Request,
    excursion: &mut Excursion,
) -> Result<Currents, Failure> {
    setup.prepare(drive, 1.0).await?;
    let mut reader = Reader::of(drive, request.bounds, *excursion)?;
    reader.guard(request.cyclic.guard).await?;
    let currents = reader.measure().await;
    *excursion = reader.excursion;
    both(currents, reader.stop().await)
}

/// The load with which the twin shows the currents of the drive.
///
/// # Errors
/// What stopped the twin.
pub(super) async fn by_readings(
    (model, loops): (&'static Description, &devices::Loops),
    shaft: &Shaft<'_>,
    had: &Setup,
    (currents, bounds): (&Currents, Bounds),
) -> Result<(Found, Twin, f64), Failure> {
    // Of a twin more current than of the drive does no harm.
    let wide = Bounds { current_a: f64::MAX, travel_turns: f64::MAX, ..bounds };
    let (mut load, mut best) = (OutputLoad::default(), None::<(f64, OutputLoad)>);
    for _ in 0..CORRECTIONS {
        let of_twin = twin_with((model, loops), &load, shaft, had).currents(wide).await?;
        let off = currents.off(&of_twin);
        if best.is_none_or(|(least, _)| off < least) {
            best = Some((off, load));
        }
        if off < ALIKE {
            break;
        }
        load = load.corrected((currents, &of_twin), shaft, bounds.speed_rpm);
    }
    let (off, load) = best.unwrap_or((f64::INFINITY, load));
    Ok((shaft.found(&load, had, loops, off), twin_with((model, loops), &load, shaft, had), off))
}

fn twin_with(
    (model, loops): (&'static Description, &devices::Loops),
    load: &OutputLoad,
    shaft: &Shaft<'_>,
    had: &Setup,
) -> Twin {
    let constant = shaft.motor.windings.torque_constant_nm_a();
    let mut twin = Twin::with_load((model, loops), load.words(), (shaft.motor, constant));
    twin.values = had.gains(loops);
    twin
}

/// What is found and proposed, as rows.
fn rows(node: u8, model: &Description, found: &Found, proposed: &Proposed, trials: &[Trial; 2]) -> TuneReport {
    let elastic = found.mechanics.elastic;
    TuneReport {
        node,
        model: model.name,
        inertia_kg_m2: found.inertia_kg_m2(),
        dry_friction_nm: found.dry_nm(),
        viscous_friction_nm_s: found.viscous_nm_s(),
        load_nm: found.friction.load_a * found.torque_constant_nm_a,
        torque_constant_nm_a: found.torque_constant_nm_a,
        anti_resonance_hz: elastic.map(|elastic| elastic.anti_resonance_hz),
        resonance_hz: elastic.map(|elastic| elastic.resonance_hz),
        loop_delay_ms: found.loop_delay_s() * 1e3,
        coherent: found.response.as_ref().map_or(0, |response| response.coherent().count()),
        frequencies: found.response.as_ref().map_or(0, |response| response.lines.len()),
        model_off: found.mechanics.off,
        twin_off: 0.0,
        period_ms: None,
        gain_share: found.gain_share,
        peak_a: 0.0,
        travel_turns: 0.0,
        gains: proposed.gains.iter().map(GainRow::from).collect(),
        before: proposed.before.into(),
        after: proposed.after.into(),
        position: proposed.position.map(MarginRow::from),
        twin_error: [trials[0].error(), trials[1].error()],
        twin_move: None,
        response: Vec::new(),
        curves: Curves { twin: trials.clone(), drive: None },
        drive_error: None,
        drive_move: None,
        applied: false,
        notes: Vec::new(),
        picture: picture(model.title, found, trials),
    }
}

impl From<&super::Gain> for GainRow {
    fn from(gain: &super::Gain) -> Self {
        Self { object: gain.object.to_string(), name: gain.name, before: gain.before, after: gain.after }
    }
}

/// How far the responses of drive and twin are apart where both are coherent: per current demand, as each was measured. And both, with
/// that of the model.
fn between(drive: &Measurement, twin: &Measurement, model: &Mechanics) -> Result<(f64, Vec<ResponseRow>), Unusable> {
    let response = |it: &Measurement| tune::response(&it.samples, Some(&it.excitation));
    let (drive, twin) = (response(drive)?, response(twin)?);
    let nearest = |omega: f64| {
        let off = |line: &&tune::Line| (line.omega() - omega).abs();
        twin.lines.iter().min_by(|a, b| off(a).total_cmp(&off(b))).map(|line| line.plant).unwrap_or_default()
    };
    let row = |line: &tune::Line| ResponseRow::of(line, model, Some(nearest(line.omega())));
    Ok((tune::distance(&drive, nearest), drive.lines.iter().map(row).collect()))
}

fn notes(found: &Found, proposed: &Proposed, request: &Request, period: Option<Duration>) -> Vec<String> {
    let mut notes = Vec::new();
    if let (None, Some(period)) = (request.period, period.filter(|period| *period > SAMPLE_PERIODS[0])) {
        notes.push(format!("it was sampled every {period:?}: in a shorter period samples were missing"));
    }
    if found.larger != 1.0 {
        notes.push(format!(
            "between two samples the current is not seen: inertia and gains are {:.2} times what they seem, by the twin that was sampled alike",
            found.larger
        ));
    }
    if found.filled > 0 {
        let samples = counted(found.filled, "sample");
        notes.push(format!("{samples} did not come in their cycle, and were put between their neighbours"));
    }
    if found.response.is_none() {
        notes.push(
            "its loops cannot be measured from outside: what a count of its gains is worth is assumed, and so is its reducer".into(),
        );
    }
    if found.gain_share < 1.0 {
        notes.push(format!(
            "its speed loop swings by itself: it was measured with {:.0} % of its gains",
            100.0 * found.gain_share
        ));
    }
    let (reached, seen) = (proposed.after.crossover_hz, found.seen_hz());
    if proposed.is_limited {
        notes.push(format!("the bandwidth that was asked for is not reached: it ends at {reached:.1} Hz"));
    }
    let wants_more = proposed.is_limited || matches!(request.objective, Objective::PhaseMargin(_));
    if wants_more && reached > AT_ITS_END * seen {
        let shorter =
            if period.is_some_and(|period| period > *RANGE.start()) { "; a shorter --period shows more" } else { "" };
        notes.push(format!("faster gains are not proposed: the shaft was seen to follow up to {seen:.0} Hz{shorter}"));
    }
    if request.torque_constant_nm_a.is_none() {
        notes.push(format!(
            "inertia and friction are those of a motor with {:.3} N m/A, the model's own; with another torque constant they are others",
            found.torque_constant_nm_a
        ));
    }
    notes
}

fn picture(title: &str, found: &Found, trials: &[Trial; 2]) -> Poster {
    let [before, after] = trials;
    let answer = |name: &str, of: &dyn Fn(&Trial) -> StepResponse| {
        let trace = |label: &'static str, style, answer: StepResponse| Trace {
            label: label.into(),
            style,
            points: answer.speed_rpm.iter().enumerate().map(|(n, rpm)| (n as f64 * answer.period_s, *rpm)).collect(),
        };
        let traces =
            vec![trace("before", Style::Demand, of(before)), trace("after", Style::Actual(Colour::Teal), of(after))];
        let panel = Panel {
            title: "velocity".into(),
            unit: "r/min".into(),
            height: 150.0,
            with_zero: false,
            least_span: 5.0,
            traces,
        };
        Figure {
            title: name.to_owned(),
            subtitle: "on the twin".to_owned(),
            time: "time, s".into(),
            panels: vec![panel],
            ..Figure::default()
        }
    };
    let bode = found.response.as_ref().map(|it| tune::bode("Frequency response", it, Some(&found.mechanics)));
    let answers = vec![
        answer("A step of the set-point", &|trial| trial.step.clone()),
        answer("A load", &|trial| trial.load.clone()),
    ];
    Poster {
        title: title.to_owned(),
        subtitle: "measured, and the model".to_owned(),
        rows: bode.map(|bode| vec![bode]).into_iter().chain([answers]).collect(),
    }
}
