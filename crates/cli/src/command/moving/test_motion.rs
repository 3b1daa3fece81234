//! `ferrodrive test-motion`: a motion with its limits, again and again, with figures of merit of each run.

use std::path::{Path, PathBuf};
use std::time::Duration;

use canopen::NodeId;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use host::capture::Wanted;
use host::test_motion::{Figures, Motion, Order, Run, ShapeName, limits, run, usual_quantities};
use machine::group_move::{angle, directed, rate, turning, turns, turns_of};
use master::Drive;
use master::units::{Angle, Rpm, parse_duration};
use recording::{Capture, Kind};
use serde::Serialize;
use words::node::node;

use super::group::AxisLimitValues;
use crate::command::cycles::CycleArgs;
use crate::command::record_and_replay::capture::{
    CaptureArgs, CaptureRow, USUAL_RATE, beside_stdout, capture_file, capture_output, check_place, not_put_back,
    numbered, save,
};
use crate::command::repeat::period;
use crate::context::{Context, Restorer};
use crate::failure::Failure;
use crate::output::Report;
use console::guard::{GuardArgs, GuardReport};
use console::numbers::whole;
use plot::{Paint, Table};

/// Move a drive by a test motion, n times, with figures of each run
///
/// SHAPE is back-and-forth, ramp, sine, chirp, prbs or path, sent point by point within the limits that are stated, or
/// steps of velocity by the drive's own ramps. What is captured meanwhile gives rise, overshoot, settling and r.m.s.
/// current, as far as the sampling shows them. Afterwards the drive is without power, and its PDOs are as they were.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive test-motion 4 steps --speed 60rpm --count 3 -o step.mcap\n  \
    ferrodrive test-motion 4 sine --by 10deg --frequency 2 --velocity 90rpm")]
pub(crate) struct TestMotion {
    /// Node-ID
    #[arg(value_parser = node)]
    node: NodeId,
    /// Shape of the motion
    #[arg(value_name = "SHAPE", value_parser = shape_names())]
    shape: ShapeName,
    /// Distance, or amplitude of sine and chirp
    #[arg(long, value_name = "ANGLE", value_parser = angle, default_value = "90deg")]
    by: Angle,
    /// Speed of steps, ramp and prbs
    #[arg(long, value_name = "SPEED", value_parser = directed, default_value = "20rpm", allow_hyphen_values = true)]
    speed: Rpm,
    /// Frequency of sine, the first one of chirp, in Hz
    #[arg(long, value_name = "HZ", default_value = "1")]
    frequency: f64,
    /// Last frequency of chirp, in Hz
    #[arg(long, value_name = "HZ", default_value = "10")]
    to_frequency: f64,
    /// Periods of sine
    #[arg(long, value_name = "N", value_parser = |text: &str| whole(text, 1..=10_000_u32), default_value = "3", hide_short_help = true)]
    periods: u32,
    /// Time that steps and ramp keep their speed, of a bit of prbs, of all of chirp
    #[arg(long, value_name = "TIME", value_parser = parse_duration, default_value = "500ms")]
    time: Duration,
    /// Capture whose position is the path
    #[arg(long, value_name = "FILE", value_parser = capture_file)]
    path: Option<PathBuf>,
    /// Runs
    #[arg(long, value_name = "N", value_parser = |text: &str| whole(text, 1..=999_u32), default_value = "1")]
    count: u32,
    /// Limit of the speed (steps: of --speed)
    #[arg(long, value_name = "SPEED", value_parser = turning, default_value = "60rpm")]
    velocity: Rpm,
    /// Limit of the acceleration; steps: the drive's own ramps without it
    #[arg(long, value_name = "RATE", value_parser = rate)]
    acceleration: Option<f64>,
    /// Largest travel from the start; beyond it points are refused, steps stop
    #[arg(long, value_name = "TURNS", value_parser = turns)]
    travel: Option<f64>,
    /// Distance of the shaft from its set-point beyond which it is stopped
    #[arg(long, value_name = "ANGLE", value_parser = angle, default_value = "72deg", hide_short_help = true)]
    following_error: Angle,
    /// Period of SYNC, in which points are sent
    #[arg(long, value_name = "TIME", value_parser = period, default_value = "5ms", hide_short_help = true)]
    period: Duration,
    /// Quantities to capture meanwhile (default: of velocity, target_velocity and current those that the model has)
    #[arg(long, value_name = "QUANTITY,..", value_delimiter = ',', hide_short_help = true)]
    capture: Vec<String>,
    #[command(flatten)]
    how: CaptureArgs,
    /// Write the captures to this file, .mcap or .csv, and to NAME-2 and so on
    #[arg(long, short, value_name = "FILE", value_parser = capture_output)]
    output: Option<PathBuf>,
    #[command(flatten)]
    cycles: CycleArgs,
    #[command(flatten)]
    guard: GuardArgs,
}

/// The shapes by their words, each with what it is.
fn shape_names() -> impl TypedValueParser<Value = ShapeName> {
    let values = ShapeName::ALL.map(|shape| PossibleValue::new(shape.word()).help(shape.what()));
    PossibleValuesParser::new(values).try_map(|word| word.parse::<ShapeName>())
}

/// What was moved, and how.
#[derive(Debug, Serialize)]
pub(crate) struct TestMotionReport {
    node: u8,
    shape: String,
    limits: AxisLimitValues,
    guard: GuardReport,
    runs: Vec<RunRow>,
    /// What else is to be known.
    notes: Vec<String>,
}

/// One run.
#[derive(Debug, Serialize)]
struct RunRow {
    run: u32,
    #[serde(flatten)]
    figures: Figures,
    capture: CaptureRow,
}

/// Times and angles of a path, and what is to be known of it.
type RecordedPath = (Vec<(f64, f64)>, Vec<String>);

impl TestMotion {
    /// Moves, captures, and reports each run.
    pub(crate) async fn run(&self, context: &Context) -> Result<TestMotionReport, Failure> {
        let drive = context.known_drive(self.node).await?;
        let following = turns_of(&drive, self.following_error).await?.0.abs();
        let limits = limits(self.velocity, self.acceleration, following)?;
        let (path, notes) = match self.shape {
            ShapeName::Path => self.recorded(&drive)?,
            _ => Default::default(),
        };
        let motion = self.motion(&drive, path).await?;
        let names = match self.capture.is_empty() {
            true => usual_quantities(&drive).await?,
            false => self.capture.clone(),
        };
        let usual = if matches!(motion, Motion::Points { .. }) { self.period } else { USUAL_RATE };
        let wanted = self.how.wanted(context, &drive, &names, usual).await?;
        wanted.check(&motion.span())?;
        check_place(context, self.output.as_deref(), self.count)?;
        let guard = self.guard.begin(context, &drive).await?;
        let moved = self.measured(context, (&drive, &motion), &wanted).await;
        let released = guard.end(context, &drive, false).await;
        // What failed first is what there is to know.
        let runs = moved?;
        let (guard, _) = released?;
        let limits = match self.shape {
            ShapeName::Steps => AxisLimitValues::of_ramps(&limits, self.acceleration.map(|rate| rate * 60.0)),
            _ => (&limits).into(),
        };
        let shape = self.shape_name().to_owned();
        let report = TestMotionReport { node: self.node.raw(), shape, limits, guard, runs, notes };
        beside_stdout(context, self.output.as_deref(), || report.shown(Paint::OFF));
        Ok(report)
    }

    const fn shape_name(&self) -> &'static str {
        self.shape.word()
    }

    /// What a run sends.
    async fn motion(&self, drive: &Drive, path: Vec<(f64, f64)>) -> Result<Motion, Failure> {
        let degrees = |turns: f64| turns * 360.0;
        let order = Order {
            shape: self.shape,
            by_deg: degrees(turns_of(drive, self.by).await?.0),
            speed_rpm: self.speed.0,
            frequency_hz: self.frequency,
            to_frequency_hz: self.to_frequency,
            periods: self.periods,
            time_s: self.time.as_secs_f64(),
            path,
            count: self.count,
            velocity_rpm: self.velocity.0,
            acceleration_rpm_s: self.acceleration.map(|rate| rate * 60.0),
            travel_turns: self.travel,
            following_error_deg: degrees(turns_of(drive, self.following_error).await?.0.abs()),
            period_ms: self.period.as_secs_f64() * 1e3,
        };
        order.motion(self.cycles.options()).map_err(|why| {
            let failure = Failure::new(format!("node {}: {} is not possible", self.node, self.shape_name()));
            failure
                .of_kind("out_of_limits")
                .at_node(self.node)
                .because(why)
                .next("nothing was moved: change the shape or a limit")
        })
    }

    /// The position of a capture, in degrees, and whether it is of another drive: its way is that of an output all the same.
    fn recorded(&self, drive: &Drive) -> Result<RecordedPath, Failure> {
        let path = self
            .path
            .as_deref()
            .ok_or_else(|| Failure::usage("path needs --path FILE").next("give a capture that has position"))?;
        let unusable = |why: String| {
            let failure = Failure::bad_file(format!("{} cannot be moved along", path.display())).because(why);
            failure.next("give a capture with position: ferrodrive capture NODE position -o FILE")
        };
        let capture = read(path).map_err(unusable)?;
        let trace = capture.trace("position_deg").ok_or_else(|| unusable("it has no position_deg".to_owned()))?;
        let model = drive.description().map_or("", |model| model.name);
        let other = capture.place.node != self.node.raw() || !capture.model.is_empty() && capture.model != model;
        let of = if capture.model.is_empty() { String::new() } else { format!(" ({})", capture.model) };
        let note = format!(
            "the path was captured of node {}{of}, and node {} ({model}) is moved along it",
            capture.place, self.node
        );
        Ok((capture.points(trace).collect(), other.then_some(note).into_iter().collect()))
    }

    /// Sets the capture up, makes the runs, and puts everything back; what moves is at rest at its end. Files are written then: a group has
    /// cycles to keep. What was captured until a failure is written too.
    async fn measured(
        &self,
        context: &Context,
        moved: (&Drive, &Motion),
        wanted: &Wanted,
    ) -> Result<Vec<RunRow>, Failure> {
        let restorer = host::capture::Restorer::of(moved.0);
        context.restore_at_end(Restorer::Capture(restorer.clone()));
        let mut runs = Vec::new();
        let begins = |run| {
            context.progress.show(format!("node {}: {}, run {run} of {}", self.node, self.shape_name(), self.count));
        };
        let moved = run(moved, (wanted, &restorer), (self.count, self.travel), &mut runs, begins).await;
        let mut runs: Vec<_> = runs.into_iter().map(|run| self.row(run)).collect();
        let left = context.restore().await.unwrap_or_default();
        let put_back = not_put_back(self.node, &left);
        let with_left = |failure: Failure| {
            left.iter().fold(failure, |failure, left| failure.because(format!("not put back: {left}")))
        };
        let put_back = put_back.map_or(Ok(()), |failure| Err(with_left(failure)));
        let saved = self.saved(&mut runs);
        // The first is what happened; the others are to be known too.
        let failures = [moved.map_err(Failure::from), put_back, saved].into_iter().filter_map(Result::err);
        match failures.reduce(Failure::because) {
            None => Ok(runs.into_iter().map(|(row, _)| row).collect()),
            Some(failure) => {
                let files = runs.iter().filter_map(|(row, _)| row.capture.file.as_deref());
                Err(files.fold(failure, |failure, file| failure.because(format!("saved: {file}"))))
            }
        }
    }

    /// Writes the captures.
    fn saved(&self, runs: &mut [(RunRow, Capture)]) -> Result<(), Failure> {
        for (row, capture) in runs {
            if let Some(path) = self.output.as_deref().map(|path| numbered(path, row.run)) {
                save(capture, &path)?;
                row.capture.file = Some(path.display().to_string());
            }
        }
        Ok(())
    }

    fn row(&self, Run { number, figures, mut capture, ways, .. }: Run) -> (RunRow, Capture) {
        capture.name = format!("{} {number}", self.shape_name());
        let row = RunRow { run: number, figures, capture: CaptureRow::new(&capture, None, &ways) };
        (row, capture)
    }
}

/// A capture from a file.
fn read(path: &Path) -> Result<Capture, String> {
    let kind = Kind::of_name(&path.to_string_lossy()).ok_or("expected NAME.mcap or NAME.csv")?;
    let bytes = std::fs::read(path).map_err(|error| error.to_string())?;
    Capture::of(&recording::read(kind, &bytes)?, None)
}

impl Report for TestMotionReport {
    fn text(&self, paint: Paint) -> String {
        // The capture is there already, and nothing else is to be in it.
        let on_stdout = self.runs.iter().any(|run| run.capture.is_on_stdout());
        if on_stdout { String::new() } else { self.shown(paint) }
    }
}

impl TestMotionReport {
    fn shown(&self, paint: Paint) -> String {
        let Self { node, shape, limits, guard, runs, notes } = self;
        let mut lines = vec![format!("node {node}: {shape}, {}", words::counted(runs.len(), "run"))];
        lines.push(format!("  limits  {}", limits.text()));
        lines.push(format!("  guard   {}", guard.text));
        let mut table = Table::new(&["run", "what", "figure", "+-"]);
        for row in runs {
            for [what, figure, grid] in row.figures.rows() {
                table.row([row.run.to_string(), what, figure, grid]);
            }
        }
        lines.push(table.plain(paint));
        lines.extend(
            runs.iter().filter_map(|row| row.figures.no_steps.as_ref().map(|why| format!("run {}: {why}", row.run))),
        );
        lines.extend(runs.iter().map(|row| row.capture.text(paint)));
        lines.extend(notes.iter().map(|note| format!("note: {note}")));
        lines.join("\n")
    }
}
