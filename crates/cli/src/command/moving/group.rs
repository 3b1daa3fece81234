//! `ferrodrive group`: several axes as one motion.

use std::path::{Path, PathBuf};
use std::time::Duration;

use canopen::NodeId;
use cia402::ModeOfOperation;
use machine::file::{CyclePlan, GROUP_PERIOD, GroupPlan};
use master::Drive;
use master::group::{AxisLimits, AxisSetup, Group, GroupError, Phase, StopCause};
use master::units::{Along, Angle, Ramp, Rpm, Shown, Turns, parse_duration};
use serde::Serialize;
use words::mode::mode;
use words::node::node;

use crate::command::cycles::{CycleArgs, refuse_too_full};
use crate::command::repeat::period;
use crate::context::Context;
use crate::failure::Failure;
use crate::global::{Global, some_time};
use crate::output::{Format, Report};
use crate::session;
use console::command::motion::speed;
use console::guard::{Guard, GuardArgs, GuardReport};
use plot::Paint;
use plot::Table;

/// How long the shafts may take to come to their last set-points before it is looked where they are.
const SETTLING: Duration = Duration::from_millis(500);

/// How often a person is shown how far the move has come.
const PROGRESS_PERIOD: Duration = Duration::from_millis(200);

/// Move several axes as one
///
/// All start with one SYNC and end together, on paths limited in speed, acceleration and jerk. When one drive faults,
/// is lost or lags, all come to rest. Afterwards the drives have no power.
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
    /// Highest acceleration of each axis: 120rpm/s, 12.6rad/s2
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
    match text.split_once('=') {
        Some((number, position)) => Ok(Word::Target(node(number)?, angle(position)?)),
        None if Path::new(text).extension().is_some_and(|ending| ending.eq_ignore_ascii_case("toml")) => {
            Ok(Word::File(text.into()))
        }
        None => Err("expected a machine file, FILE.toml, or NODE=POSITION, e.g. 1=90deg".into()),
    }
}

/// An angle with its unit: a group is spoken of in degrees, and a number alone would be counts of the drive.
pub(super) fn angle(text: &str) -> Result<Angle, String> {
    let angle = text.parse().map_err(|error| format!("{error}"))?;
    if text.ends_with(|c: char| c.is_ascii_digit() || c == '.') {
        return Err(format!(
            "'{text}' has no unit: expected an angle, e.g. {text}deg, 0.5turn or 1.57rad, or counts of the drive: {text}counts"
        ));
    }
    Ok(angle)
}

/// A speed of the shaft: a group plans in turns.
pub(super) fn turning(text: &str) -> Result<Rpm, String> {
    match speed(text)? {
        Along::Turning(rpm) => Ok(rpm),
        Along::Metres(_) => {
            Err("expected a speed of rotation, e.g. 60rpm: the axes of a group are moved in turns".into())
        }
    }
}

/// A rate in turns/s^2.
pub(super) fn rate(text: &str) -> Result<f64, String> {
    match text.parse::<Ramp>() {
        Ok(Ramp::RpmPerSecond(rate)) if rate > 0.0 => Ok(rate / 60.0),
        Ok(_) => Err("expected a rate above 0, e.g. 120rpm/s: a change of speed does not take a fixed time".into()),
        Err(error) => Err(error.to_string()),
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

/// The axes, and where each is to go; `None` for one that stays.
struct Planned {
    axes: Vec<AxisSetup>,
    targets: Vec<Option<Turns>>,
    period: Duration,
}

impl Planned {
    /// What the bus has to carry.
    fn cycle(&self) -> CyclePlan {
        CyclePlan {
            what: "the group".to_owned(),
            period: self.period,
            nodes: self.axes.iter().map(|axis| (axis.drive.node().id(), Some(axis.mode))).collect(),
            is_base: false,
        }
    }

    /// Says which axes will not move evenly, as `check` says it of a file.
    fn note_uneven(&self, context: &Context) {
        let cycle = self.cycle();
        for AxisSetup { drive, mode, .. } in &self.axes {
            let uneven = drive.axis_description().and_then(|axis| cycle.uneven(axis, Some(*mode)));
            if let Some((what, own)) = uneven {
                context.note(&format!("node {}: {what}: give --period {own:?}", drive.node().id()));
            }
        }
    }
}

/// What was seen on the way.
struct GroupRun {
    time: Duration,
    from: Vec<f64>,
    to: Vec<f64>,
    at: Vec<f64>,
    largest_turns: Vec<f64>,
    missed_cycles: u64,
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

    fn targets(&self) -> impl Iterator<Item = (NodeId, Angle)> {
        self.words
            .iter()
            .filter_map(|word| if let Word::Target(node, angle) = word { Some((*node, *angle)) } else { None })
    }

    async fn run(&self, context: &Context) -> Result<GroupMoved, Failure> {
        let planned = self.plan(context).await?;
        let drives: Vec<_> = planned.axes.iter().map(|axis| &axis.drive).collect();
        refuse_too_full(context, &planned.cycle(), &drives).await?;
        planned.note_uneven(context);
        let mut guards = Vec::new();
        for axis in &planned.axes {
            guards.push(self.guard.begin(context, &axis.drive).await?);
        }
        let opened = Group::open(&planned.axes, planned.period, self.cycles.options()).await;
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

    /// Which axes, how far each may go, and where to: all of it before anything moves.
    async fn plan(&self, context: &Context) -> Result<Planned, Failure> {
        let targets: Vec<_> = self.targets().collect();
        if targets.is_empty() {
            return Err(
                Failure::usage("expected the axes to move").next("name each with its position: 1=90deg 4=0.5turn")
            );
        }
        for (position, (node, _)) in targets.iter().enumerate() {
            if targets[..position].iter().any(|(other, _)| other == node) {
                return Err(Failure::usage(format!("two positions for node {node}"))
                    .at_node(*node)
                    .next("name each node once, with the position where it is to end"));
            }
        }
        let plan = self.of_file(context, &targets)?;
        let nodes: Vec<_> = match plan {
            Some(plan) => plan.axes.iter().map(|axis| axis.node).collect(),
            None => targets.iter().map(|(node, _)| *node).collect(),
        };
        let period = self.period.or(plan.and_then(|plan| plan.period)).unwrap_or(GROUP_PERIOD);
        let mut planned = Planned { axes: Vec::new(), targets: Vec::new(), period };
        for (index, node) in nodes.into_iter().enumerate() {
            let drive = context.known_drive(node).await?;
            let said = plan.map(|plan| &plan.axes[index]);
            let mode = self.mode.or(said.and_then(|axis| axis.mode));
            let mode = mode.map_or_else(|| AxisSetup::best_mode(&drive).map_err(Failure::from), Ok)?;
            let limits = self.limits(&drive, said.map(|axis| &axis.limits)).await?;
            let target = targets.iter().find(|(other, _)| *other == node);
            planned.targets.push(match target {
                Some((_, angle)) => Some(turns_of(&drive, *angle).await?),
                None => None,
            });
            planned.axes.push(AxisSetup { drive, mode, limits });
        }
        Ok(planned)
    }

    /// The group of the machine file, if there is a file with groups.
    fn of_file<'a>(&self, context: &'a Context, targets: &[(NodeId, Angle)]) -> Result<Option<&'a GroupPlan>, Failure> {
        let groups = context.machine.as_ref().map_or(&[][..], |machine| &machine.groups);
        let names = || groups.iter().map(|group| group.name.as_str()).collect::<Vec<_>>().join(", ");
        let has = |group: &&GroupPlan, node: NodeId| group.axes.iter().any(|axis| axis.node == node);
        let Some(name) = &self.group else {
            let found = groups.iter().find(|group| targets.iter().all(|(node, _)| has(group, *node)));
            // Limits that the file has for an axis are not passed over because of its neighbour.
            let parted = groups.iter().any(|group| targets.iter().any(|(node, _)| has(&group, *node)));
            if found.is_none() && parted {
                return Err(Failure::bad_file("these nodes are not in one [[group]] of the machine file")
                    .next(format!("move those of one group together; its groups: {}", names())));
            }
            return Ok(found);
        };
        let Some(group) = groups.iter().find(|group| group.name == *name) else {
            let what = format!("there is no group '{name}'");
            let advice = "a group is a [[group]] of a machine file (docs/machine-file.md); give that file";
            return Err(match groups {
                [] if context.machine.is_none() => Failure::usage(what).next(advice),
                [] => Failure::bad_file(what).next(advice),
                _ => Failure::bad_file(what).next(format!("the machine file has: {}", names())),
            });
        };
        match targets.iter().find(|(node, _)| !has(&group, *node)) {
            Some((node, _)) => {
                let axes: Vec<_> = group.axes.iter().map(|axis| axis.node.to_string()).collect();
                Err(Failure::bad_file(format!("node {node} is not an axis of the group '{name}'"))
                    .at_node(*node)
                    .next(format!("move its axes, nodes {}, or add the node to its [[group]]", axes.join(", "))))
            }
            None => Ok(Some(group)),
        }
    }

    /// What an axis may do: as the command line says, else the file, else as a careful person would begin.
    async fn limits(&self, drive: &Drive, said: Option<&AxisLimits>) -> Result<AxisLimits, Failure> {
        let velocity_turns_s = self.velocity.map(|Rpm(rpm)| rpm / 60.0);
        let following = match self.following_error {
            Some(angle) => Some(turns_of(drive, angle).await?.0),
            None => None,
        };
        let (is_said, careful) = (said.is_some(), AxisLimits::careful());
        let said = said.unwrap_or(&careful);
        let acceleration_turns_s2 = self.acceleration.unwrap_or(said.acceleration_turns_s2);
        // Without a stated jerk it follows the acceleration.
        let rounding_s = careful.acceleration_turns_s2 / careful.jerk_turns_s3;
        let jerk = self.rounding.map(|time| acceleration_turns_s2 / time.as_secs_f64());
        Ok(AxisLimits {
            range_turns: said.range_turns.clone(),
            velocity_turns_s: velocity_turns_s.unwrap_or(said.velocity_turns_s),
            acceleration_turns_s2,
            jerk_turns_s3: jerk.unwrap_or(if is_said {
                said.jerk_turns_s3
            } else {
                acceleration_turns_s2 / rounding_s
            }),
            following_error_turns: following.unwrap_or(said.following_error_turns),
        })
    }

    /// Enables, moves and lets the shafts settle. What stops it is reported in the words of its drive.
    async fn carry_out(&self, context: &Context, group: &mut Group, planned: &Planned) -> Result<GroupRun, Failure> {
        match self.follow(context, group, planned).await {
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

    async fn follow(&self, context: &Context, group: &mut Group, planned: &Planned) -> Result<GroupRun, GroupError> {
        context.progress.show(format!("enabling {} axes", planned.axes.len()));
        group.enable().await?;
        let from: Vec<_> = group.points().iter().map(|point| point.position_turns).collect();
        let goal = |(from, target): (&f64, &Option<Turns>)| match target {
            Some(Turns(by)) if self.relative => from + by,
            Some(Turns(to)) => *to,
            None => *from,
        };
        let to: Vec<_> = from.iter().zip(&planned.targets).map(goal).collect();
        let goals: Vec<_> = to.iter().copied().map(Turns).collect();
        let time = group.start_move(&goals, self.within)?;
        let mut largest_turns = vec![0.0_f64; from.len()];
        let began = context.network.now();
        let mut shown = began;
        loop {
            let phase = group.cycle().await?.phase;
            let errors = group.following_errors().map(Option::unwrap_or_default);
            largest_turns.iter_mut().zip(errors).for_each(|(largest, error)| *largest = largest.max(error));
            if phase != Phase::Moving {
                break;
            }
            let now = context.network.now();
            if now - shown >= PROGRESS_PERIOD {
                shown = now;
                let (gone, whole) = ((now - began).as_secs_f64(), time.as_secs_f64());
                context.progress.show(format!("moving {} axes: {gone:.1} of {whole:.1} s", from.len()));
            }
        }
        group.rest().await?;
        let settled = context.network.now() + SETTLING;
        while context.network.now() < settled {
            group.cycle().await?;
        }
        group.rest().await?;
        let at = group.axes().iter().zip(&to).map(|(state, to)| state.position.map_or(*to, |Turns(at)| at)).collect();
        Ok(GroupRun { time, from, to, at, largest_turns, missed_cycles: group.state().missed_cycles })
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

pub(super) async fn turns_of(drive: &Drive, angle: Angle) -> Result<Turns, Failure> {
    match angle {
        Angle::Turns(turns) => Ok(Turns(turns)),
        Angle::Counts(counts) => Ok(Turns(counts as f64 / drive.counts_per_turn().await?)),
    }
}

impl GroupMoved {
    fn new(planned: &Planned, seen: GroupRun, guards: Vec<GuardReport>) -> Self {
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
        lines.join("\n")
    }
}
