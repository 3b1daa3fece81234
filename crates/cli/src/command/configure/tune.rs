//! `ferrodrive tune`: gains for a drive's loops, from a measurement; ramps and currents of a stepper, from its load.

use std::io::{IsTerminal, stdin};
use std::path::{Path, PathBuf};
use std::time::Duration;

use canopen::NodeId;
use host::network::params::journal::default_path;
use host::tune::{Bounds, CaptureReport, MoveRow, RampReport, RampRequest, Request, TuneReport};
use machine::group_move::turns;
use master::decode::Decoder;
use master::units::{Amperes, Rpm, parse_duration};
use recording::Capture;
use words::node::node;

use super::params::journal::note_kept;
use crate::command::cycles::CycleArgs;
use crate::command::record_and_replay::plot::{read_record, svg_path, write_svg};
use crate::command::repeat::period;
use crate::context::{Context, Restorer};
use crate::failure::{Failure, refuse_missing_folder};
use crate::output::Report;
use console::guard::{Guard, GuardArgs};
use plot::{Paint, Table};

/// The speed of a stepper, where none is named, r/min.
const STEPPER_RPM: f64 = 600.0;
const UNCHANGED: &str = "nothing of the drive has changed; --apply writes the proposed values";

/// Which loops gains are found for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum WhichLoop {
    /// The speed loop
    Speed,
    /// The speed loop, and the position loop around it
    Position,
}

/// Find gains for a drive's loops, or ramps for a stepper
///
/// Of a servo by CiA 402 `loops` of its machine file say which objects its maker has for them.
/// A stepper without an encoder has no loops, and shows no lost step: what it needs is computed from the load that --load-inertia,
/// --load-friction and --load-torque name, with a margin, and tried on its twin. It is not turned. Any other drive is measured, and
/// its gains are tried on its twin, then on the drive:
///
/// The shaft turns to and fro at steady speeds, and then at one speed with an excitation on top that grows to a share of
/// --current; that of a joint, whose loops are not seen from outside, is turned round by its own ramps instead. The motion stops where it
/// reaches --current or --travel. Afterwards the drive has the parameters that it had, unless --apply is given. Keep an emergency stop within reach, and the load free to turn.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive tune 4\n  \
    ferrodrive tune 4 --bandwidth 20 --loop position -o tune.svg\n  \
    ferrodrive --bus can0 tune 4 --speed 60rpm --current 8A --apply\n  \
    ferrodrive tune 4 --capture run.mcap --torque-constant 0.9\n  \
    ferrodrive tune 2 --speed 600rpm --load-inertia 3e-5 --load-friction 0.05")]
pub(crate) struct Tune {
    /// Node-ID
    #[arg(value_parser = node)]
    node: NodeId,
    /// Which loops
    #[arg(long = "loop", value_enum, default_value = "speed")]
    which: WhichLoop,
    /// Objective: where the gain of the speed loop falls to one, in Hz
    #[arg(long, value_name = "HZ", conflicts_with = "phase_margin")]
    bandwidth: Option<f64>,
    /// Objective: phase margin to keep, in degrees
    #[arg(long, value_name = "DEGREES", default_value_t = PHASE_MARGIN_DEG)]
    phase_margin: f64,
    /// Highest speed of the motor's shaft (default: what is usual)
    ///
    /// 120rpm, of a joint and of a stepper 600rpm, of a servo by CiA 402 what `loops` of its file says.
    #[arg(long, value_name = "SPEED")]
    speed: Option<Rpm>,
    /// Most current that the loop may ask for (default: what is usual)
    ///
    /// 15A, of a servo by CiA 402 what `loops` of its file says.
    #[arg(long, value_name = "CURRENT")]
    current: Option<Amperes>,
    /// Farthest that the motor's shaft, before a reducer, may turn from where it stands: 20turn, 90deg
    ///
    /// A number alone is turns.
    #[arg(long, value_name = "ANGLE", default_value = "40turn", value_parser = turns)]
    travel: f64,
    /// Time from one sample to the next (default: 1, 2, 5 or 10 ms)
    ///
    /// Without it the shortest in which no sample is missing: a bus of 500 kbit/s has no room for 1 ms.
    #[arg(long, value_name = "TIME", value_parser = period)]
    period: Option<Duration>,
    /// Torque per ampere of another motor than the model's own, in N·m/A
    #[arg(long, value_name = "NM_PER_A")]
    torque_constant: Option<f64>,
    /// Identify the drive from a recorded run; nothing moves
    ///
    /// Of `capture`, `test-motion` or another instrument, NAME.mcap or NAME.csv: frequency response with coherence, masses and speed
    /// loop, by velocity_demand_rpm, current_demand_a or current_a, and position_deg or velocity_rpm. Or a log of frames (candump, BLF, ..)
    /// whose PDOs have set-point, current and motion, with --model or --machine. Up to a quarter of the rate of its rows; no gains are proposed.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["apply", "bandwidth"])]
    capture: Option<PathBuf>,
    /// Of a stepper: inertia of what it turns, without its rotor, in kg·m²
    #[arg(long, value_name = "KG_M2", default_value = "0", hide_short_help = true)]
    load_inertia: f64,
    /// Of a stepper: dry friction of what it turns, in N·m
    #[arg(long, value_name = "NM", default_value = "0", hide_short_help = true)]
    load_friction: f64,
    /// Of a stepper: what pushes its shaft in one direction, such as a weight, in N·m
    #[arg(long, value_name = "NM", default_value = "0", allow_negative_numbers = true, hide_short_help = true)]
    load_torque: f64,
    /// Of a stepper: how many times the torque that is needed there is to be
    #[arg(long, value_name = "TIMES", default_value_t = MARGIN, hide_short_help = true)]
    margin: f64,
    /// Of a stepper: time in which it is to reach the speed (default: the shortest that keeps the margin)
    #[arg(long, value_name = "TIME", value_parser = parse_duration, hide_short_help = true)]
    ramp: Option<Duration>,
    /// Write the proposed values to the drive, and measure once more
    #[arg(long)]
    apply: bool,
    /// Draw response and trials to this file (-: standard output)
    #[arg(long, short, alias = "picture", value_name = "FILE.svg", value_parser = svg_path)]
    output: Option<PathBuf>,
    /// Longest time for the transaction
    #[arg(long, value_name = "TIME", default_value = "60s", value_parser = parse_duration, hide = true)]
    within: Duration,
    #[command(flatten)]
    cycles: CycleArgs,
    #[command(flatten)]
    guard: GuardArgs,
}

/// What is usual of the options that not every drive has.
const PHASE_MARGIN_DEG: f64 = 40.0;
const MARGIN: f64 = 1.5;

/// Refuses the first of these options that is given.
fn without_effect(options: &[(&str, bool)], on: &str, why: &str) -> Result<(), Failure> {
    match options.iter().find(|(_, is_given)| *is_given) {
        Some((name, _)) => Err(Failure::usage(format!("{name} has no effect on {on}")).because(why).next("omit it")),
        None => Ok(()),
    }
}

impl Tune {
    fn request(&self, journal: Option<PathBuf>, (usual_rpm, usual_a): (f64, f64)) -> Request {
        let objective =
            self.bandwidth.map_or(tune::Objective::PhaseMargin(self.phase_margin), tune::Objective::Bandwidth);
        Request {
            objective,
            with_position: self.which == WhichLoop::Position,
            period: self.period,
            bounds: Bounds {
                speed_rpm: self.speed.map_or(usual_rpm, |Rpm(rpm)| rpm.abs()),
                current_a: self.current.map_or(usual_a, |Amperes(current)| current.abs()),
                travel_turns: self.travel,
            },
            cyclic: self.cycles.options(),
            torque_constant_nm_a: self.torque_constant,
            journal,
            on_kept: note_kept,
            apply: self.apply,
            within: self.within,
        }
    }

    /// Whether what was typed is within its ranges: no bus is needed to see that.
    pub(crate) fn check(&self) -> Result<(), Failure> {
        // What is usual for a model is within them.
        let Bounds { speed_rpm, current_a, .. } = Bounds::default();
        self.request(None, (speed_rpm, current_a)).check()?;
        Ok(self.ramp_request(None).check()?)
    }

    fn ramp_request(&self, journal: Option<PathBuf>) -> RampRequest {
        RampRequest {
            load: tune::Turned {
                inertia_kg_m2: self.load_inertia,
                dry_nm: self.load_friction,
                viscous_nm_s: 0.0,
                load_nm: self.load_torque,
            },
            speed_rpm: self.speed.map_or(STEPPER_RPM, |Rpm(rpm)| rpm.abs()),
            margin: self.margin,
            ramp: self.ramp,
            journal,
            on_kept: note_kept,
            apply: self.apply,
            within: self.within,
        }
    }

    /// Measures or computes, and proposes; and writes, if that was asked for.
    pub(crate) async fn run(&self, context: &Context) -> Result<Tuned, Failure> {
        if let Some(path) = &self.output {
            refuse_missing_folder("the picture", path)?;
        }
        if let Some(path) = &self.capture {
            return self.of_capture(path, context);
        }
        let drive = context.known_drive(self.node).await?;
        let journal = (!context.is_embedded()).then(|| default_path(self.node));
        if host::tune::open_loop_of(&drive).is_some() {
            self.refuse_options_of_loops()?;
            let request = self.ramp_request(journal);
            let found = TuneResult::Ramps(host::tune::tune_ramps(&drive, &request, &context.progress).await?);
            return Ok(Tuned { found, picture: None });
        }
        let (_, loops) = host::tune::loops_of(&drive)?;
        self.refuse_options_of_steppers()?;
        let request = self.request(journal, (loops.usual_rpm, loops.usual_a));
        let guard = self.guard.begin(context, &drive).await?;
        let restorer = host::capture::Restorer::of(&drive);
        context.restore_at_end(Restorer::Capture(restorer.clone()));
        let done = host::tune::tune((&drive, &restorer), &request, &context.progress, wants_back(context)).await;
        // What could not be put back is tried once more.
        let left = context.restore().await.unwrap_or_default();
        let done = done.map_err(|failure| host::capture::with_left(failure, &left));
        let released = Guard::end(guard, context, &drive, false).await;
        let report = done?;
        released?;
        let picture = self.draw(&report.picture)?;
        Ok(Tuned { found: TuneResult::Gains(Box::new(report)), picture })
    }

    fn refuse_options_of_loops(&self) -> Result<(), Failure> {
        let given = [
            ("--output", self.output.is_some()),
            ("--loop", self.which == WhichLoop::Position),
            ("--bandwidth", self.bandwidth.is_some()),
            ("--phase-margin", self.phase_margin != PHASE_MARGIN_DEG),
            ("--current", self.current.is_some()),
            ("--travel", self.travel != Bounds::default().travel_turns),
            ("--period", self.period.is_some()),
            ("--torque-constant", self.torque_constant.is_some()),
        ];
        let why = "its ramps are computed: it is not turned, and has no loops and no frequency response";
        without_effect(&given, "a stepper without an encoder", why)
    }

    fn refuse_options_of_steppers(&self) -> Result<(), Failure> {
        let given = [
            ("--load-inertia", self.load_inertia != 0.0),
            ("--load-friction", self.load_friction != 0.0),
            ("--load-torque", self.load_torque != 0.0),
            ("--margin", self.margin != MARGIN),
            ("--ramp", self.ramp.is_some()),
        ];
        without_effect(&given, "a drive with loops", "its load is measured")
    }

    fn of_capture(&self, path: &Path, context: &Context) -> Result<Tuned, Failure> {
        let unread = |reason: String| {
            Failure::bad_file(format!("the record {} has nothing of node {}", path.display(), self.node))
                .because(reason)
        };
        let mut decoder = Decoder::knowing(context.network.models());
        context.named_models().for_each(|(node, model)| decoder.set_model(node, model));
        let recorded = read_record(path, decoder)?;
        let model = context.named_models().find(|(node, _)| *node == self.node).map(|(_, model)| model);
        let capture = Capture::of_node(&recorded, Some(self.node.raw())).map_err(unread)?;
        let report = host::tune::of_capture(&capture, self.torque_constant, model)?;
        let picture = self.draw(&report.picture)?;
        Ok(Tuned { found: TuneResult::Captured(Box::new(report)), picture })
    }

    /// Writes the picture to its file. The text of one that goes to standard output.
    fn draw(&self, picture: &plot::Poster) -> Result<Option<String>, Failure> {
        self.output.as_deref().map_or(Ok(None), |path| write_svg(path, picture.to_svg()))
    }
}

/// What was proposed, and its picture.
#[derive(Debug, serde::Serialize)]
pub(crate) struct Tuned {
    #[serde(flatten)]
    found: TuneResult,
    /// If it goes to standard output.
    #[serde(skip_serializing_if = "Option::is_none")]
    picture: Option<String>,
}

/// What was proposed.
#[derive(Debug, serde::Serialize)]
#[serde(untagged)]
enum TuneResult {
    /// Of a drive with loops.
    Gains(Box<TuneReport>),
    /// Of a stepper without an encoder.
    Ramps(RampReport),
    /// Of a file.
    Captured(Box<CaptureReport>),
}

impl Report for Tuned {
    fn text(&self, paint: Paint) -> String {
        if let Some(picture) = &self.picture {
            return picture.trim_end().to_owned();
        }
        match &self.found {
            TuneResult::Gains(report) => report.text(paint),
            TuneResult::Ramps(report) => report.text(paint),
            TuneResult::Captured(report) => report.text(paint),
        }
    }
}

impl Report for RampReport {
    fn text(&self, paint: Paint) -> String {
        let mut lines = vec![
            format!(
                "node {} ({}), {:.0} V: inertia {} kg·m² with its rotor",
                self.node,
                self.model,
                self.supply_v,
                three_digits(self.inertia_kg_m2)
            ),
            format!(
                "at {:.0} r/min the motor gives {:.3} N·m at most, and the load takes {:.3} N·m",
                self.speed_rpm, self.pull_out_nm, self.needed_nm
            ),
            format!(
                "the load has the margin up to {:.0} r/min, and starts at {:.0} r/min at most",
                self.highest_rpm, self.start_rpm
            ),
            String::new(),
            rows(&self.values, paint),
            String::new(),
            format!(
                "least margin of torque on the ramp: {:.2} as it is, {:.2} proposed; asked for {:.2}",
                self.margin_before, self.margin_after, self.margin
            ),
        ];
        lines.extend(self.twin.iter().map(|row| format!("its twin: {row}")));
        lines.push(if self.applied {
            "the drive has the proposed values; it was not turned".to_owned()
        } else {
            UNCHANGED.to_owned()
        });
        lines.extend(self.notes.iter().map(|note| format!("note: {note}")));
        lines.join("\n")
    }
}

impl Report for CaptureReport {
    fn text(&self, _: Paint) -> String {
        let [used, period_ms] = [self.rows as f64, self.period_s * 1e3];
        let mut lines = vec![
            format!("node {}: {used:.0} rows {period_ms:.2} ms apart, by {}", self.node, self.quantities.join(", ")),
            match (self.inertia_kg_m2, self.viscous_friction_nm_s) {
                (Some(inertia), Some(viscous)) => {
                    format!(
                        "inertia {} kg·m², viscous friction {} N·m·s/rad",
                        three_digits(inertia),
                        three_digits(viscous)
                    )
                }
                _ => format!(
                    "{:.1} rad/s² for each A, viscous friction {:.3} 1/s of that inertia",
                    self.gain_rad_s2_a, self.viscous_per_s
                ),
            },
            match (self.anti_resonance_hz, self.resonance_hz) {
                (Some(anti), Some(resonance)) => format!("anti-resonance {anti:.1} Hz, resonance {resonance:.1} Hz"),
                _ => "no resonance was found".to_owned(),
            },
            format!(
                "delay {:.1} ms; coherent at {} of {} frequencies; the model is {:.0} % off",
                self.delay_ms,
                self.coherent,
                self.frequencies,
                100.0 * self.model_off
            ),
        ];
        if let (Some(proportional), Some(integral)) = (self.proportional_a_s_rad, self.integral_a_rad) {
            lines.push(format!("its speed loop: {proportional:.3} A/(rad/s), {integral:.2} A/rad"));
        }
        lines.extend(self.notes.iter().map(|note| format!("note: {note}")));
        lines.join("\n")
    }
}

/// What each object has and is to get.
fn rows(rows: &[host::tune::GainRow], paint: Paint) -> String {
    let mut table = Table::new(&["object", "name", "has", "proposed"]);
    for row in rows {
        table.row([row.object.clone(), row.name.to_owned(), row.before.to_string(), row.after.to_string()]);
    }
    table.plain(paint)
}

/// One key of a person at a terminal: b and Enter. It is read beside what goes on: signs of life are sent, and Ctrl-C is heard.
async fn wants_back(context: &Context) -> bool {
    if !stdin().is_terminal() || !std::io::stderr().is_terminal() {
        return false;
    }
    context.progress.clear();
    context.note("the drive stands, with the new gains. Enter keeps them; b and Enter goes back");
    let (give, typed) = tokio::sync::oneshot::channel();
    std::thread::spawn(move || {
        let mut line = String::new();
        let read = stdin().read_line(&mut line);
        // The command may have ended.
        let _ = give.send(read.is_ok_and(|_| line.trim().eq_ignore_ascii_case("b")));
    });
    // An input that has ended keeps them.
    typed.await.unwrap_or(false)
}

/// A joint's inertia is a thousandth of a wheel's.
fn three_digits(value: f64) -> String {
    let decimals = (2.0 - value.abs().max(1e-12).log10().floor()).clamp(0.0, 12.0) as usize;
    format!("{value:.decimals$}")
}

/// A move on the twin or on the drive, before and after.
fn moves(whose: &str, [before, after]: &[MoveRow; 2]) -> String {
    let text = |row: &MoveRow| {
        let settled = row.settled_s.map_or("does not settle".to_owned(), |at| format!("settled after {at:.2} s"));
        format!("{:.1} degrees beyond its end, {settled}", row.overshoot_deg)
    };
    format!("a move on the {whose}: {} before; {} after", text(before), text(after))
}

impl Report for TuneReport {
    fn text(&self, paint: Paint) -> String {
        let is_measured = self.frequencies > 0;
        let mut lines = vec![format!(
            "node {} ({}): inertia {} kg·m², dry friction {} N·m, viscous {} N·m·s/rad",
            self.node,
            self.model,
            three_digits(self.inertia_kg_m2),
            three_digits(self.dry_friction_nm),
            three_digits(self.viscous_friction_nm_s)
        )];
        // Of a joint it is not known.
        if is_measured {
            lines[0].push_str(&format!(", load {:.2} N·m", self.load_nm));
        }
        lines.push(match (self.anti_resonance_hz, self.resonance_hz) {
            (Some(anti), Some(resonance)) if is_measured => {
                format!("anti-resonance {anti:.1} Hz, resonance {resonance:.1} Hz")
            }
            (Some(anti), Some(resonance)) => {
                format!("anti-resonance {anti:.1} Hz, resonance {resonance:.1} Hz, by the data of its reducer")
            }
            _ => "no resonance was found".to_owned(),
        });
        lines.push(if is_measured {
            format!(
                "delay of the speed loop {:.1} ms; coherent at {} of {} frequencies; the model is {:.0} % off, the twin {:.0} %",
                self.loop_delay_ms,
                self.coherent,
                self.frequencies,
                100.0 * self.model_off,
                100.0 * self.twin_off
            )
        } else {
            format!("the currents of its twin are {:.1} % off", 100.0 * self.twin_off)
        });
        lines.push(format!("it took {:.1} A at most, and {:.1} turns to one side", self.peak_a, self.travel_turns));
        lines.push(String::new());
        lines.push(rows(&self.gains, paint));
        let margins = |name: &str, row: &host::tune::MarginRow| {
            let state = if row.stable { "stable" } else { "NOT stable" };
            format!(
                "{name}: crossover {:.1} Hz, phase margin {:.0} degrees, sensitivity {:.1}, {state}",
                row.crossover_hz, row.phase_deg, row.sensitivity
            )
        };
        lines.push(String::new());
        lines.push(margins("speed loop, as it is ", &self.before));
        lines.push(margins("speed loop, proposed ", &self.after));
        lines.extend(self.position.iter().map(|row| margins("position loop around it", row)));
        lines.extend(self.twin_move.iter().map(|rows| moves("twin", rows)));
        lines.extend(self.drive_move.iter().map(|rows| moves("drive", rows)));
        let error = |[before, after]: [f64; 2]| format!("{before:.2} r/min s before, {after:.2} after");
        lines.push(format!("error after a step and a load, on the twin: {}", error(self.twin_error)));
        if let Some(errors) = self.drive_error {
            lines.push(format!("error after a step, on the drive: {}", error(errors)));
        }
        lines.push(match (self.applied, self.drive_error.is_some()) {
            (true, _) => {
                format!("the drive has the proposed values; they are not stored: ferrodrive save {}", self.node)
            }
            (false, true) => "the drive has its former gains".to_owned(),
            (false, false) => UNCHANGED.to_owned(),
        });
        lines.extend(self.notes.iter().map(|note| format!("note: {note}")));
        lines.join("\n")
    }
}
