//! `ferrodrive group`: several axes as one motion.

use std::path::{Path, PathBuf};
use std::time::Duration;

use canopen::NodeId;
use cia402::ModeOfOperation;
use machine::group_move::{GroupMove, GroupRun, PULLING_LOAD, PlannedMove, angle, rate, target, turning};
use master::Drive;
use master::group::{AxisLimits, AxisSetup, Group, GroupError, StopCause};
use master::units::{Angle, Rpm, Shown, parse_duration};
use serde::Serialize;
use words::mode::mode;
use words::time::some_time;

use crate::command::cycles::{CycleArgs, refuse_too_full};
use crate::command::repeat::period;
use crate::context::Context;
use crate::failure::Failure;
use crate::global::Global;
use crate::output::{Format, Report};
use crate::session;
use console::guard::{Guard, GuardArgs, GuardReport};
use plot::Paint;
use plot::Table;

/// How often a person is shown how far the move has come.
const PROGRESS_PERIOD: Duration = Duration::from_millis(200);

/// Move several axes as one
///
/// All start with one SYNC and end together, on paths limited in speed, acceleration and jerk. When one drive faults,
/// is lost or lags, all come to rest. Afterwards the drives have no power: a load that pulls (an arm, a slope) moves a motor
/// without power, unless a brake holds it. `ferrodrive move` leaves one drive powered and holding.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    ferrodrive group move 1=90deg 4=0.5turn --within 3s           # default limits\n  \
    ferrodrive group move examples/machine.toml 1=90deg 2=-45deg  # its [[group]]\n  \
    ferrodrive --bus can0 group move machine.toml --relative 1=10deg 2=10deg")]
pub(crate) struct GroupCommand {
    #[command(subcommand)]
    what: GroupAction,
}

#[derive(Debug, clap::Subcommand)]
enum GroupAction {
    Move(Move),
}

/// Move axes to positions, together
///
/// With a machine file that has a [[group]], the axes that are not named stay where they are. The default limits of an
/// axis are 30 r/min and 60 (r/min)/s, reached within 100 ms, and a lag of 0.2 turns. A drive that takes no positions
/// in cycles is moved by speeds.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive group move 1=90deg 4=0.5turn --within 3s\n  \
    ferrodrive --bus can0 group move machine.toml 1=90deg 2=-45deg")]
struct Move {
    /// Machine file, and the positions of the nodes: 1=90deg 4=0.5turn 2=-3000counts
    #[arg(value_name = "FILE.toml|NODE=POSITION", required = true, value_parser = word)]
    words: Vec<Word>,
    /// Name of the [[group]] of the file (default: the one that has the nodes)
    #[arg(long, value_name = "NAME")]
    group: Option<String>,
    /// Turn by this much from the present position of each axis, instead of to a position
    #[arg(long)]
    relative: bool,
    /// Duration of the move (default: the shortest within the limits)
    #[arg(long, value_name = "TIME", value_parser = parse_duration)]
    within: Option<Duration>,
    /// Highest speed of each axis
    #[arg(long, value_name = "SPEED", value_parser = turning)]
    velocity: Option<Rpm>,
    /// Highest acceleration of each axis: 120rpm/s, 720deg/s2, 12.6rad/s2
    #[arg(long, value_name = "RATE", value_parser = rate)]
    acceleration: Option<f64>,
    /// Time in which the acceleration reaches its highest value, which limits the jerk
    #[arg(long, value_name = "TIME", value_parser = some_time)]
    rounding: Option<Duration>,
    /// Largest distance of a shaft from its set-point, beyond which all axes are stopped
    #[arg(long, value_name = "ANGLE", value_parser = angle)]
    following_error: Option<Angle>,
    /// Period of SYNC (default: the file's, or 5ms)
    #[arg(long, value_name = "TIME", value_parser = period)]
    period: Option<Duration>,
    /// Mode of operation of each axis (default: the file's, or the first of csp, ip, csv, pv that its model has)
    #[arg(long, value_name = "MODE", value_parser = mode)]
    mode: Option<ModeOfOperation>,
    #[command(flatten)]
    cycles: CycleArgs,
    #[command(flatten)]
    guard: GuardArgs,
}

/// A machine file, or where an axis is to go.
#[derive(Clone, Debug)]
enum Word {
    File(PathBuf),
    Target(NodeId, Angle),
}

fn word(text: &str) -> Result<Word, String> {
    match text.contains('=') {
        true => target(text).map(|(node, angle)| Word::Target(node, angle)),
        false if Path::new(text).extension().is_some_and(|ending| ending.eq_ignore_ascii_case("toml")) => {
            Ok(Word::File(text.into()))
        }
        false => Err("expected a machine file, FILE.toml, or NODE=POSITION, e.g. 1=90deg".into()),
    }
}

/// What came of a move.
#[derive(Debug, Serialize)]
pub(crate) struct GroupMoved {
    /// How long the path takes.
    time_s: f64,
    period_ms: f64,
    /// Cycles that the path was late for.
    missed_cycles: u64,
    axes: Vec<AxisMoved>,
}

#[derive(Debug, Serialize)]
struct AxisMoved {
    node: u8,
    mode: String,
    from_deg: f64,
    to_deg: f64,
    at_deg: f64,
    /// On the way.
    largest_following_error_deg: f64,
    limits: AxisLimitValues,
    guard: GuardReport,
}

#[derive(Debug, Serialize)]
pub(super) struct AxisLimitValues {
    /// `null` for an axis without software limits.
    range_deg: Option<[f64; 2]>,
    velocity_rpm: f64,
    /// `null` where the ramps are the drive's own.
    acceleration_rpm_s: Option<f64>,
    /// `null` where no path is followed.
    jerk_rpm_s2: Option<f64>,
    following_error_deg: Option<f64>,
}

impl AxisLimitValues {
    /// `30 r/min, 60 (r/min)/s, -90 to 90 deg`.
    pub(super) fn text(&self) -> String {
        let Self { range_deg, velocity_rpm, acceleration_rpm_s, .. } = self;
        let range = range_deg.map_or(String::new(), |[low, high]| format!(", {} to {} deg", Shown(low), Shown(high)));
        let ramp = acceleration_rpm_s.map(|rate| format!("{} (r/min)/s", Shown(rate)));
        let ramp = ramp.unwrap_or_else(|| "by the drive's own ramps".to_owned());
        format!("{} r/min, {ramp}{range}", Shown(*velocity_rpm))
    }

    /// Of a drive that keeps its own ramps, or this one in (r/min)/s, and follows no path.
    pub(super) fn of_ramps(limits: &AxisLimits, acceleration_rpm_s: Option<f64>) -> Self {
        Self { acceleration_rpm_s, jerk_rpm_s2: None, following_error_deg: None, ..limits.into() }
    }
}

impl From<&AxisLimits> for AxisLimitValues {
    fn from(limits: &AxisLimits) -> Self {
        Self {
            range_deg: limits.range_turns.as_ref().map(|range| [range.start() * 360.0, range.end() * 360.0]),
            velocity_rpm: limits.velocity_turns_s * 60.0,
            acceleration_rpm_s: Some(limits.acceleration_turns_s2 * 60.0),
            jerk_rpm_s2: Some(limits.jerk_turns_s3 * 60.0),
            following_error_deg: Some(limits.following_error_turns * 360.0),
        }
    }
}

/// Says which axes will not move evenly, as `check` says it of a file.
fn note_uneven(context: &Context, planned: &PlannedMove) {
    let cycle = planned.cycle();
    for AxisSetup { drive, mode, .. } in &planned.axes {
        let uneven = drive.axis_description().and_then(|axis| cycle.uneven(axis, Some(*mode)));
        if let Some((what, own)) = uneven {
            context.note(&format!("node {}: {what}: give --period {own:?}", drive.node().id()));
        }
    }
}

impl GroupCommand {
    /// Does what is asked for, and prints it.
    pub(crate) fn run(&self, global: &Global, format: Format) -> Result<(), Failure> {
        let GroupAction::Move(command) = &self.what;
        let report = session::run(&command.global(global)?, async |context| command.run(context).await)?;
        format.print(&report).map_err(Failure::of_stdout)
    }
}

impl Move {
    fn global(&self, global: &Global) -> Result<Global, Failure> {
        let mut files =
            self.words.iter().filter_map(|word| if let Word::File(path) = word { Some(path) } else { None });
        let Some(path) = files.next() else { return Ok(global.clone()) };
        if let Some(other) = files.next() {
            return Err(Failure::usage(format!("two machine files: {} and {}", path.display(), other.display()))
                .next("name one: the axes of a group are in one file"));
        }
        global.on_machine(path, &session::read_machine(path)?)
    }

    fn asked(&self) -> GroupMove {
        let target = |word: &Word| if let Word::Target(node, angle) = word { Some((*node, *angle)) } else { None };
        GroupMove {
            targets: self.words.iter().filter_map(target).collect(),
            relative: self.relative,
            group: self.group.clone(),
            within: self.within,
            velocity: self.velocity,
            acceleration: self.acceleration,
            rounding: self.rounding,
            following_error: self.following_error,
            period: self.period,
            mode: self.mode,
        }
    }

    async fn run(&self, context: &Context) -> Result<GroupMoved, Failure> {
        let asked = self.asked();
        let (nodes, plan) = asked.axes(context.machine.as_ref())?;
        let mut drives = Vec::new();
        for node in nodes {
            drives.push(context.known_drive(node).await?);
        }
        let planned = asked.plan(plan, drives).await?;
        let drives: Vec<_> = planned.axes.iter().map(|axis| &axis.drive).collect();
        refuse_too_full(context, &planned.cycle(), &drives).await?;
        note_uneven(context, &planned);
        let mut guards = Vec::new();
        for axis in &planned.axes {
            guards.push(self.guard.begin(context, &axis.drive).await?);
        }
        let opened = planned.open(self.cycles.options()).await;
        let moved = match opened {
            Ok(mut group) => {
                let moved = self.carry_out(context, &mut group, &planned).await;
                let closed = group.close().await.map_err(Failure::from);
                moved.and_then(|seen| closed.map(|()| seen))
            }
            Err(error) => Err(error.into()),
        };
        let guards = end_guards(context, guards, planned.axes.iter().map(|axis| &axis.drive)).await;
        Ok(GroupMoved::new(&planned, moved?, guards?))
    }

    /// Enables, moves and lets the shafts settle. What stops it is reported in the words of its drive.
    async fn carry_out(
        &self,
        context: &Context,
        group: &mut Group,
        planned: &PlannedMove,
    ) -> Result<GroupRun, Failure> {
        context.progress.show(format!("enabling {} axes", planned.axes.len()));
        let mut shown = Duration::ZERO;
        let progress = |gone: Duration, whole: Duration| {
            if gone >= shown + PROGRESS_PERIOD {
                shown = gone;
                let (gone, whole) = (gone.as_secs_f64(), whole.as_secs_f64());
                context.progress.show(format!("moving {} axes: {gone:.1} of {whole:.1} s", planned.axes.len()));
            }
        };
        match planned.carry_out(group, progress).await {
            Ok(seen) => Ok(seen),
            Err(error) => {
                let cause = if let GroupError::Stopped(cause) = error { Some(cause) } else { None };
                let reason = if cause.is_some() { group.explain_stop().await } else { None };
                let failure = reason.into_iter().fold(Failure::from(error), Failure::because);
                Err(match cause {
                    Some(StopCause::Axis { refusal, .. }) => self.cycles.advised(failure, refusal),
                    _ => failure,
                })
            }
        }
    }
}

/// Releases what was guarded, whatever became of the motion.
pub(in crate::command) async fn end_guards<'a>(
    context: &Context,
    guards: Vec<Guard>,
    drives: impl Iterator<Item = &'a Drive>,
) -> Result<Vec<GuardReport>, Failure> {
    let mut reports = Vec::new();
    for (guard, drive) in guards.into_iter().zip(drives) {
        reports.push(guard.end(context, drive, false).await?.0);
    }
    Ok(reports)
}

impl GroupMoved {
    fn new(planned: &PlannedMove, seen: GroupRun, guards: Vec<GuardReport>) -> Self {
        let axes = planned.axes.iter().zip(guards).enumerate().map(|(index, (axis, guard))| AxisMoved {
            node: axis.drive.node().id().raw(),
            mode: axis.mode.name().unwrap_or("manufacturer-specific").to_owned(),
            from_deg: seen.from[index] * 360.0,
            to_deg: seen.to[index] * 360.0,
            at_deg: seen.at[index] * 360.0,
            largest_following_error_deg: seen.largest_turns[index] * 360.0,
            limits: (&axis.limits).into(),
            guard,
        });
        Self {
            time_s: seen.time.as_secs_f64(),
            period_ms: planned.period.as_secs_f64() * 1e3,
            missed_cycles: seen.missed_cycles,
            axes: axes.collect(),
        }
    }
}

impl Report for GroupMoved {
    fn text(&self, paint: Paint) -> String {
        let moved = match self.axes.len() {
            1 => format!("the axis moved in {:.3} s", self.time_s),
            axes => format!("{axes} axes moved together in {:.3} s", self.time_s),
        };
        let missed = match self.missed_cycles {
            0 => String::new(),
            missed => format!(", later by {missed} missed cycles"),
        };
        let head = format!("{}{missed}; the drives are without power", paint.good(&moved));
        let mut table = Table::new(&["node", "mode", "from", "to", "at", "largest lag", "limits"]);
        for axis in &self.axes {
            let deg = |value: f64| format!("{} deg", Shown(value));
            let limits = axis.limits.text();
            let cells = [axis.from_deg, axis.to_deg, axis.at_deg, axis.largest_following_error_deg].map(deg);
            let [from, to, at, lag] = cells;
            table.row([axis.node.to_string(), axis.mode.clone(), from, to, at, lag, limits]);
        }
        let guards = self.axes.iter().map(|axis| format!("  guard   node {}: {}", axis.node, axis.guard.text));
        let mut lines = vec![head, table.plain(paint)];
        lines.extend(guards);
        lines.push(format!("  note    {PULLING_LOAD}; ferrodrive move leaves a drive holding"));
        lines.join("\n")
    }
}
