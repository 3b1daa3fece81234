//! `ferrodrive group`: several axes as one motion.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use canopen::NodeId;
use cia402::ModeOfOperation;
use host::group_follow::{GroupFollow, PlannedFollow, RecordedPath};
use machine::file::GroupPlan;
use machine::group_move::{GroupMove, GroupRun, PULLING_LOAD, PlannedMove, angle, hold, rate, target, turning};
use master::Drive;
use master::cyclic::CyclicState;
use master::group::{AxisLimits, AxisSetup, Group, GroupError, Phase, StopCause};
use master::units::{Along, Angle, Rpm, Shown, parse_duration};
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
/// All start with one SYNC, to positions (move) or along a recorded path (follow), within limits of speed and acceleration.
/// When one drive faults, is lost or lags, all come to rest. Afterwards the drives have no power: a load that pulls (an arm,
/// a slope) moves a motor without power, unless a brake holds it; --hold keeps them powered and holding.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    ferrodrive group move 1=90deg 4=0.5turn --within 3s           # default limits\n  \
    ferrodrive group move examples/machine.toml 1=90deg 2=-45deg  # its [[group]]\n  \
    ferrodrive --bus can0 group move machine.toml --relative 1=10deg --hold\n  \
    ferrodrive --bus can0 group follow machine.toml path.csv --approach")]
pub(crate) struct GroupCommand {
    #[command(subcommand)]
    what: GroupAction,
}

#[derive(Debug, clap::Subcommand)]
enum GroupAction {
    Move(Move),
    Follow(Follow),
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
    /// Machine file, and the positions of the nodes: 1=90deg 4=0.5turn 3=20mm 2=-3000counts
    #[arg(value_name = "FILE.toml|NODE=POSITION", required = true, value_parser = word)]
    words: Vec<Argument>,
    /// Duration of the move (default: the shortest within the limits)
    #[arg(long, value_name = "TIME", value_parser = parse_duration)]
    within: Option<Duration>,
    #[command(flatten)]
    options: GroupOptions,
}

/// Move axes along a recorded path, in its time
///
/// The path is CSV: its first line names the columns, t_s and the position of each axis by its node (t_s,1.angle_deg,2.angle_deg),
/// in s and in degrees, radians or counts of the drive; a record or a capture with positions is one too. It is led through its points
/// by a cubic spline at rest at both ends, a set-point for each cycle. All set-points are held to the limits before anything moves.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive group follow path.csv --approach\n  \
    ferrodrive --bus can0 group follow machine.toml path.csv --hold")]
struct Follow {
    /// Machine file, and the path
    #[arg(value_name = "FILE.toml|PATH.csv", required = true, value_parser = followed)]
    files: Vec<PathBuf>,
    /// Lead axes that stand elsewhere to the first point before, by a move within the limits
    #[arg(long, conflicts_with = "relative")]
    approach: bool,
    #[command(flatten)]
    options: GroupOptions,
}

/// What every motion of a group takes.
#[derive(Debug, clap::Args)]
struct GroupOptions {
    /// Name of the [[group]] of the file (default: the one that has the nodes)
    #[arg(long, value_name = "NAME")]
    group: Option<String>,
    /// Positions count from where each axis is
    #[arg(long)]
    relative: bool,
    /// Highest speed of each axis; this and the next three lower a limit of the file, and do not raise it
    #[arg(long, value_name = "SPEED", value_parser = turning)]
    velocity: Option<Rpm>,
    /// Highest acceleration of each axis: 120rpm/s, 720deg/s2, 12.6rad/s2
    #[arg(long, value_name = "RATE", value_parser = rate)]
    acceleration: Option<f64>,
    /// Time in which the acceleration of a move reaches its highest value, which limits the jerk
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
    /// Keep the axes powered and holding at the end: for TIME, or until standard input ends or Ctrl-C
    #[arg(long, value_name = "TIME", value_parser = some_time)]
    hold: Option<Option<Duration>>,
    #[command(flatten)]
    cycles: CycleArgs,
    #[command(flatten)]
    guard: GuardArgs,
}

/// A machine file, or where an axis is to go.
#[derive(Clone, Debug)]
enum Argument {
    File(PathBuf),
    Target(NodeId, Along<Angle>),
}

fn word(text: &str) -> Result<Argument, String> {
    match text.contains('=') {
        true => target(text).map(|(node, angle)| Argument::Target(node, angle)),
        false if Path::new(text).extension().is_some_and(|ending| ending.eq_ignore_ascii_case("toml")) => {
            Ok(Argument::File(text.into()))
        }
        false => Err("expected a machine file, FILE.toml, or NODE=POSITION, e.g. 1=90deg".into()),
    }
}

/// The file of a machine or of a path.
fn followed(text: &str) -> Result<PathBuf, String> {
    let is_known = Path::new(text)
        .extension()
        .is_some_and(|ending| ["toml", "csv"].iter().any(|known| ending.eq_ignore_ascii_case(known)));
    is_known.then(|| text.into()).ok_or_else(|| "expected a path, NAME.csv, or a machine file, FILE.toml".to_owned())
}

/// What came of a move, or of a path.
#[derive(Debug, Serialize)]
pub(crate) struct GroupMoved {
    /// How long the path takes.
    time_s: f64,
    period_ms: f64,
    /// Cycles that the path was late for.
    missed_cycles: u64,
    /// How long the axes were held at the end; `null` without --hold.
    held_s: Option<f64>,
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
        let report = match &self.what {
            GroupAction::Move(command) => {
                let global = with_machine(global, &command.files())?;
                session::run(&global, async |context| command.run(context).await)?
            }
            GroupAction::Follow(command) => {
                let (machine, path) = command.machine_and_path()?;
                let global = with_machine(global, &machine)?;
                let follow = command.asked(RecordedPath::read(path)?);
                session::run(&global, async |context| command.run(context, &follow).await)?
            }
        };
        format.print(&report).map_err(Failure::of_stdout)
    }
}

/// The options of every command, with the machine file that this one names.
fn with_machine(global: &Global, files: &[&Path]) -> Result<Global, Failure> {
    match files {
        [] => Ok(global.clone()),
        [path] => global.on_machine(path, &session::read_machine(path)?),
        [path, other, ..] => {
            Err(Failure::usage(format!("two machine files: {} and {}", path.display(), other.display()))
                .next("name one: the axes of a group are in one file"))
        }
    }
}

/// A motion of a group that has been planned.
enum Planned<'a> {
    Move(&'a PlannedMove),
    Follow(&'a PlannedFollow),
}

impl Planned<'_> {
    /// Its axes and their cycle.
    const fn start(&self) -> &PlannedMove {
        match self {
            Self::Move(planned) => planned,
            Self::Follow(planned) => &planned.start,
        }
    }
}

impl Move {
    fn files(&self) -> Vec<&Path> {
        self.words
            .iter()
            .filter_map(|word| if let Argument::File(path) = word { Some(&**path) } else { None })
            .collect()
    }

    fn asked(&self) -> GroupMove {
        let target =
            |word: &Argument| if let Argument::Target(node, angle) = word { Some((*node, *angle)) } else { None };
        let targets = self.words.iter().filter_map(target).collect();
        GroupMove { targets, within: self.within, ..self.options.asked() }
    }

    async fn run(&self, context: &Context) -> Result<GroupMoved, Failure> {
        let asked = self.asked();
        let (nodes, plan) = asked.axes(context.machine.as_ref())?;
        let planned = asked.plan(plan, drives(context, nodes).await?).await?;
        self.options.carry_out(context, &Planned::Move(&planned)).await
    }
}

impl Follow {
    fn machine_and_path(&self) -> Result<(Vec<&Path>, &Path), Failure> {
        let (paths, machines): (Vec<&Path>, Vec<&Path>) = self
            .files
            .iter()
            .map(|file| &**file)
            .partition(|file| file.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("csv")));
        match paths[..] {
            [path] => Ok((machines, path)),
            [] => Err(Failure::usage("expected the path to follow").next("name its file: path.csv")),
            [one, other, ..] => {
                let what = format!("two paths: {} and {}", one.display(), other.display());
                Err(Failure::usage(what).next("name one; it has a column for each axis"))
            }
        }
    }

    fn asked(&self, path: RecordedPath) -> GroupFollow {
        GroupFollow { path, approach: self.approach, options: self.options.asked() }
    }

    async fn run(&self, context: &Context, asked: &GroupFollow) -> Result<GroupMoved, Failure> {
        let (nodes, plan): (_, Option<&GroupPlan>) = asked.axes(context.machine.as_ref())?;
        let planned = asked.plan(plan, drives(context, nodes).await?).await?;
        self.options.carry_out(context, &Planned::Follow(&planned)).await
    }
}

async fn drives(context: &Context, nodes: Vec<NodeId>) -> Result<Vec<Drive>, Failure> {
    let mut drives = Vec::new();
    for node in nodes {
        drives.push(context.known_drive(node).await?);
    }
    Ok(drives)
}

impl GroupOptions {
    fn asked(&self) -> GroupMove {
        GroupMove {
            targets: Vec::new(),
            relative: self.relative,
            group: self.group.clone(),
            within: None,
            velocity: self.velocity,
            acceleration: self.acceleration,
            rounding: self.rounding,
            following_error: self.following_error,
            period: self.period,
            mode: self.mode,
            hold: self.hold.flatten(),
        }
    }

    /// Opens the group, moves it, holds it if that is asked for, and takes its power.
    async fn carry_out(&self, context: &Context, planned: &Planned<'_>) -> Result<GroupMoved, Failure> {
        if self.hold == Some(None) && context.is_embedded() {
            return Err(Failure::usage(
                "--hold needs a time on a bus of this command's own, whose time does not pass with the clock",
            )
            .next("give one: --hold 2s"));
        }
        let start = planned.start();
        let drives: Vec<_> = start.axes.iter().map(|axis| &axis.drive).collect();
        refuse_too_full(context, &start.cycle(), &drives).await?;
        note_uneven(context, start);
        let mut guards = Vec::new();
        for axis in &start.axes {
            guards.push(self.guard.begin(context, &axis.drive).await?);
        }
        let opened = start.open(self.cycles.options()).await;
        let moved = match opened {
            Ok(mut group) => {
                let moved = self.move_and_hold(context, &mut group, planned).await;
                let power = power_taken(&group);
                match (moved, group.close().await) {
                    (Ok(seen), closed) => closed.map(|()| seen).map_err(Failure::from),
                    (Err(failure), Ok(())) => Err(power.into_iter().fold(failure, Failure::because)),
                    (Err(failure), Err(error)) => Err(failure.because(error)),
                }
            }
            Err(error) => Err(error.into()),
        };
        let guards = end_guards(context, guards, start.axes.iter().map(|axis| &axis.drive)).await;
        let (run, held) = moved?;
        Ok(GroupMoved::new(start, run, held, guards?))
    }

    /// Enables, moves and lets the shafts settle. What stops it is reported in the words of its drive.
    async fn move_and_hold(
        &self,
        context: &Context,
        group: &mut Group,
        planned: &Planned<'_>,
    ) -> Result<(GroupRun, Option<Duration>), Failure> {
        let axes = planned.start().axes.len();
        context.progress.show(format!("enabling {axes} axes"));
        let mut shown = Duration::ZERO;
        let progress = |gone: Duration, whole: Duration| {
            if gone >= shown + PROGRESS_PERIOD {
                shown = gone;
                let (gone, whole) = (gone.as_secs_f64(), whole.as_secs_f64());
                context.progress.show(format!("moving {axes} axes: {gone:.1} of {whole:.1} s"));
            }
        };
        let moved = async {
            let run = match planned {
                Planned::Move(planned) => planned.carry_out(group, progress).await?,
                Planned::Follow(planned) => planned.carry_out(group, progress).await?,
            };
            let held = match self.hold {
                Some(time) => Some(keep(context, group, time, &format!("{axes} axes hold")).await?),
                None => None,
            };
            Ok::<_, GroupError>((run, held))
        };
        match moved.await {
            Ok(seen) => Ok(seen),
            Err(error) => {
                let cause = if let GroupError::Stopped(cause) = error { Some(cause) } else { None };
                let reason = if cause.is_some() { group.explain_stop().await } else { None };
                // What another master did needs no longer period.
                let is_late = reason.is_none();
                let failure = reason.into_iter().fold(Failure::from(error), Failure::because);
                let failure = match cause {
                    Some(StopCause::Axis { refusal, .. }) if is_late => self.cycles.advised(failure, refusal),
                    _ => failure,
                };
                let Some(time) = self.hold.filter(|_| has_others(group)) else { return Err(failure) };
                let who = format!("{}. The other axes hold", failure.what);
                Err(keep(context, group, time, &who).await.err().into_iter().fold(failure, Failure::because))
            }
        }
    }
}

/// After a drive has stopped the group the others hold on, as they were to at the end, and do not fall with it. Not where an axis was pushed
/// away: it would press on.
fn has_others(group: &Group) -> bool {
    let state = group.state();
    matches!(state.cause, Some(StopCause::Axis { .. }))
        && state.phase == Phase::Holding
        && group.axes().iter().any(|axis| axis.follows)
}

/// Of a group that is about to be closed: of which axes that takes the power; `None` where none has any.
fn power_taken(group: &Group) -> Option<String> {
    let nodes = |is_meant: fn(&CyclicState) -> bool| {
        let axes = group.drives().iter().zip(group.axes()).filter(|(_, axis)| is_meant(axis));
        axes.map(|(drive, _)| format!("node {}", drive.node().id())).collect::<Vec<_>>().join(", ")
    };
    let (powered, without) = (nodes(|axis| axis.is_live), nodes(CyclicState::is_without_power));
    let before = if without.is_empty() { String::new() } else { format!("{without} had lost its power, and ") };
    (!powered.is_empty()).then(|| format!("{before}the power of {powered} was taken at the end: {PULLING_LOAD}"))
}

/// Holds for so long, or until standard input ends; `who` does, in words.
async fn keep(context: &Context, group: &mut Group, time: Option<Duration>, who: &str) -> Result<Duration, GroupError> {
    const POWER: &str = "Ctrl-C quick-stops the drives";
    let Some(time) = time else {
        context.note(&format!("{who}; the end of standard input (Ctrl-D) takes their power, {POWER}: {PULLING_LOAD}"));
        let input = end_of_input();
        return hold(group, |_| input.load(Ordering::Relaxed)).await;
    };
    context.note(&format!("{who} for {} s, then their power is taken; {POWER}", Shown(time.as_secs_f64())));
    hold(group, |held| held >= time).await
}

/// Whether standard input has ended, as a thread finds out: a read cannot be waited for beside the cycles. The thread ends with the input
/// or with the process.
fn end_of_input() -> Arc<AtomicBool> {
    let ended = Arc::new(AtomicBool::new(false));
    let seen = Arc::clone(&ended);
    std::thread::spawn(move || {
        let _ = std::io::copy(&mut std::io::stdin().lock(), &mut std::io::sink());
        seen.store(true, Ordering::Relaxed);
    });
    ended
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
    fn new(planned: &PlannedMove, seen: GroupRun, held: Option<Duration>, guards: Vec<GuardReport>) -> Self {
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
            held_s: held.map(|time| time.as_secs_f64()),
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
        let held = self.held_s.map_or(String::new(), |time_s| format!(" and held for {time_s:.3} s"));
        let head = format!("{}{missed}{held}; the drives are without power", paint.good(&moved));
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
        lines.push(format!("  note    {PULLING_LOAD}; --hold keeps the axes holding"));
        lines.join("\n")
    }
}
