//! `ferrodrive velocity`, `move` and `torque`: motion in physical units.

use std::fmt;
use std::pin::pin;
use std::time::Duration;

use canopen::NodeId;
use cia402::object::QUICK_STOP_OPTION_CODE;
use cia402::{ModeOfOperation, QuickStopOption, StopRamp};
use devices::{Quantity, Ramps, Scale};
use master::drive::{Commanded, Drive, Manner, Motion, MotionReport, Note};
use master::units::{Along, Amperes, Angle, Ramp, Rpm, Shown, parse_duration};
use serde::Serialize;

use super::drive::{ShaftMotion, StateReport};
use crate::context::{Context, Holding};
use crate::failure::Failure;
use crate::guard::{Guard, GuardArgs, GuardReport};
use plot::Paint;
use words::models::is_from_file;
use words::node::node;
use words::time::some_time;

/// Turn the motor at a speed, until Ctrl-C or for a time
///
/// Enables the drive and monitors it while it turns: without --for until Ctrl-C, which stops it. --no-wait returns at
/// once and leaves the motor turning. On the command's own virtual bus, which ends with it, it returns when the speed is
/// reached.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  ferrodrive velocity 4 60rpm --for 2s\n  ferrodrive velocity 4 -360deg/s --acceleration 120rpm/s"
)]
pub struct Velocity {
    /// Node-ID
    #[arg(value_parser = node)]
    pub(super) node: NodeId,
    /// Speed: 60 (r/min), 60rpm, 6.28rad/s, 360deg/s, 1r/s; 200mm/s where the machine file has a feed constant
    #[arg(allow_hyphen_values = true)]
    speed: Along<Rpm>,
    #[command(flatten)]
    ramps: RampArgs,
    /// Turn for this long, then stop (default: until Ctrl-C)
    #[arg(long = "for", value_name = "TIME", value_parser = some_time, conflicts_with = "no_wait")]
    duration: Option<Duration>,
}

/// Move to a position, or by an angle
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive move 4 90deg\n  ferrodrive move 4 32000 --profile-velocity 60rpm\n  \
    ferrodrive move 4 --relative -0.5turn --acceleration 300ms")]
pub struct Move {
    /// Node-ID
    #[arg(value_parser = node)]
    pub(super) node: NodeId,
    /// Position: 32000 (counts), 90deg, 0.5turn, 1.57rad; 40mm where the machine file has a feed constant
    #[arg(allow_hyphen_values = true)]
    position: Along<Angle>,
    /// Move by this much from the last target, instead of to a position
    #[arg(long)]
    relative: bool,
    /// Highest speed of the move
    #[arg(long, value_name = "SPEED", value_parser = speed)]
    profile_velocity: Option<Along<Rpm>>,
    #[command(flatten)]
    ramps: RampArgs,
}

/// Apply a motor current (profile torque), until Ctrl-C or for a time
///
/// What the motor does depends on the load, its speed too. At the end a quick stop brings it to rest: without torque it
/// would coast. --no-wait returns at once and leaves the current applied; on the command's own virtual bus so does
/// a command without --for.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  ferrodrive torque 4 1A --for 500ms")]
pub struct Torque {
    /// Node-ID
    #[arg(value_parser = node)]
    pub(super) node: NodeId,
    /// Motor current: 1.5A, -800mA
    #[arg(allow_hyphen_values = true)]
    current: Amperes,
    /// Apply it for this long, then quick-stop (default: until Ctrl-C)
    #[arg(long = "for", value_name = "TIME", value_parser = some_time, conflicts_with = "no_wait")]
    duration: Option<Duration>,
    /// Return at once and leave the current applied
    #[arg(long)]
    no_wait: bool,
    #[command(flatten)]
    guard: GuardArgs,
}

/// How a motion is to be made, where the drive's own settings are not wanted.
#[derive(Debug, clap::Args)]
struct RampArgs {
    /// Acceleration, or the time to speed up: 500ms, 120rpm/s, 720deg/s2, 12.6rad/s2; 500mm/s2 with a feed constant
    #[arg(long, value_name = "RAMP")]
    acceleration: Option<Along<Ramp>>,
    /// Deceleration, in the same forms
    #[arg(long, value_name = "RAMP")]
    deceleration: Option<Along<Ramp>>,
    /// Return at once, without waiting for the target
    #[arg(long)]
    no_wait: bool,
    /// Longest time to reach the target; beyond it the drive is quick-stopped
    ///
    /// Without it: 1.5 times the calculated duration of the ramps and the travel, and 2 s.
    #[arg(long, value_name = "TIME", value_parser = parse_duration, conflicts_with = "no_wait")]
    within: Option<Duration>,
    #[command(flatten)]
    guard: GuardArgs,
}

/// A speed that is to be kept to.
///
/// # Errors
/// It is not one, or not above 0.
pub fn speed(text: &str) -> Result<Along<Rpm>, String> {
    match text.parse() {
        Ok(speed @ (Along::Turning(Rpm(value)) | Along::Metres(value))) if value > 0.0 => Ok(speed),
        Ok(_) => Err("expected a profile velocity above 0, e.g. 60rpm; the target decides the direction".into()),
        Err(error) => Err(error.to_string()),
    }
}

/// What was asked, within which limits, and what came of it.
#[derive(Debug, Serialize)]
pub struct MotionOutcome {
    asked: String,
    /// The same with what was sent, where that differs.
    #[serde(skip)]
    done: String,
    /// Each value that was asked for, and what was sent for it.
    commanded: Vec<SentCommand>,
    reached: bool,
    reached_after_s: Option<f64>,
    stopped: bool,
    /// How it turned or pushed before it was stopped again.
    #[serde(skip_serializing_if = "Option::is_none")]
    before_stop: Option<ShaftMotion>,
    limits: ProfileLimits,
    guard: GuardReport,
    #[serde(flatten)]
    state: StateReport,
    notes: Vec<String>,
}

/// A value that was asked for, and what the drive was sent for it.
#[derive(Debug, Serialize)]
struct SentCommand {
    what: &'static str,
    requested: f64,
    commanded: f64,
    unit: &'static str,
    object: String,
    raw: i64,
    /// The two differ by more than a thousandth.
    rounded: bool,
    #[serde(skip)]
    text: String,
}

impl From<&Commanded> for SentCommand {
    fn from(sent: &Commanded) -> Self {
        let Commanded { what, requested, commanded, unit, object, raw } = *sent;
        let (object, rounded) = (object.to_string(), sent.is_rounded());
        Self { what, requested, commanded, unit, object, raw, rounded, text: sent.to_string() }
    }
}

/// The limits that the drive keeps to.
#[derive(Debug, Default, Serialize)]
struct ProfileLimits {
    profile_velocity_rpm: Option<f64>,
    /// Where it turns at a speed: the highest that acts.
    #[serde(skip_serializing_if = "Option::is_none")]
    velocity_rpm: Option<f64>,
    /// Of a homing: the first speed at which the switch is looked for, where it has an object of its own.
    #[serde(skip_serializing_if = "Option::is_none")]
    search_speed_rpm: Option<f64>,
    acceleration_ms: Option<f64>,
    deceleration_ms: Option<f64>,
    quick_stop_ms: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    acceleration_rpm_s: Option<f64>,
    /// In profile torque: what limits the current. Profiles of speed say nothing then.
    #[serde(skip_serializing_if = "Option::is_none")]
    current_a: Option<f64>,
    #[serde(skip)]
    is_torque: bool,
    #[serde(skip)]
    is_homing: bool,
}

impl Velocity {
    /// What the drive is to do.
    pub(super) fn motion(&self) -> Motion {
        Motion::Velocity(self.speed, self.ramps.manner())
    }

    pub(super) const fn guard(&self) -> &GuardArgs {
        &self.ramps.guard
    }

    /// Turns.
    pub async fn run(&self, context: &Context) -> Result<MotionOutcome, Failure> {
        let drive = context.known_drive(self.node).await?;
        let doing = format!("node {}: to {}", self.node, self.speed);
        let (motion, guard) = perform(context, &drive, &doing, &self.ramps.guard, &self.motion()).await?;
        let then = Then::of_endless(context, self.duration, self.ramps.no_wait, !stands_at(&self.speed));
        outcome(context, &drive, ("turn at", &self.speed), motion, then, guard).await
    }
}

impl Move {
    /// What the drive is to do.
    pub(super) fn motion(&self) -> Motion {
        let (speed, manner) = (self.profile_velocity, self.ramps.manner());
        Motion::Move { to: self.position, relative: self.relative, speed, manner }
    }

    pub(super) const fn guard(&self) -> &GuardArgs {
        &self.ramps.guard
    }

    /// Moves.
    pub async fn run(&self, context: &Context) -> Result<MotionOutcome, Failure> {
        let drive = context.known_drive(self.node).await?;
        let verb = if self.relative { "move by" } else { "move to" };
        let doing = format!("node {}: {verb} {}", self.node, self.position);
        let (motion, guard) = perform(context, &drive, &doing, &self.ramps.guard, &self.motion()).await?;
        let then = Then::goes_on_if(motion.reached_after.is_none());
        outcome(context, &drive, (verb, &self.position), motion, then, guard).await
    }
}

impl Torque {
    /// What the drive is to do.
    pub(super) const fn motion(&self) -> Motion {
        Motion::Torque(self.current)
    }

    pub(super) const fn guard(&self) -> &GuardArgs {
        &self.guard
    }

    /// Pushes.
    pub async fn run(&self, context: &Context) -> Result<MotionOutcome, Failure> {
        let drive = context.known_drive(self.node).await?;
        let doing = format!("node {}: applying {}", self.node, self.current);
        let (motion, guard) = perform(context, &drive, &doing, &self.guard, &self.motion()).await?;
        let then = Then::of_endless(context, self.duration, self.no_wait, self.current.0 != 0.0);
        outcome(context, &drive, ("apply", &self.current), motion, then, guard).await
    }
}

impl RampArgs {
    fn manner(&self) -> Manner {
        Manner {
            acceleration: self.acceleration,
            deceleration: self.deceleration,
            wait: !self.no_wait,
            within: self.within,
        }
    }
}

/// Whether a motor that turns at this speed stands.
fn stands_at(speed: &Along<Rpm>) -> bool {
    matches!(speed, Along::Turning(Rpm(value)) | Along::Metres(value) if *value == 0.0)
}

/// Carries out a command that moves a drive, which is guarded first, and shows meanwhile what it is doing.
pub async fn perform(
    context: &Context,
    drive: &Drive,
    doing: &str,
    guard: &GuardArgs,
    command: &Motion,
) -> Result<(MotionReport, Guard), Failure> {
    drive.check_motion(command)?;
    context.show(doing);
    let guard = guard.begin(context, drive).await?;
    let report = shown_while(context, drive, doing, drive.make(command)).await?;
    Ok((report, guard))
}

/// How often a motion that goes on is shown to a person who waits at a terminal.
const PROGRESS_PERIOD: Duration = Duration::from_millis(500);

/// Shows where the shaft is while `motion` goes on, to people at a terminal: the questions cost the bus some frames.
pub async fn shown_while<T>(context: &Context, drive: &Drive, doing: &str, motion: impl Future<Output = T>) -> T {
    if !context.is_shown() {
        return motion.await;
    }
    let began = context.network.now();
    let mut motion = pin!(motion);
    loop {
        tokio::select! {
            done = &mut motion => return done,
            () = context.network.sleep(PROGRESS_PERIOD) => {}
        }
        // The motion goes on while it is asked where it is.
        let state = tokio::select! {
            done = &mut motion => return done,
            state = StateReport::read(drive) => state,
        };
        // What keeps it from answering is reported by the motion.
        let Ok(state) = state else { continue };
        let seconds = (context.network.now() - began).as_secs_f64();
        context.show(format!("{doing}: at {} after {seconds:.1} s", state.motion.text()));
    }
}

/// What follows a commanded motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Then {
    /// It is watched for this long, then the drive is stopped.
    StopAfter(Duration),
    /// It is watched until the command is asked to end; what ends the command stops the drive.
    UntilAskedToEnd,
    /// The command ends, the motion does not.
    GoesOn,
    /// It is at its end.
    Stands,
}

impl Then {
    /// The motion goes on if so, and else is at its end.
    pub const fn goes_on_if(moving: bool) -> Self {
        if moving { Self::GoesOn } else { Self::Stands }
    }

    /// Of a motion without an end of its own, for which a time was given or none: a motor is left `moving` by a command that
    /// ends only where that was asked for (`no_wait`), or where something else holds it.
    fn of_endless(context: &Context, duration: Option<Duration>, no_wait: bool, moving: bool) -> Self {
        match duration {
            Some(duration) => Self::StopAfter(duration),
            None if moving && !no_wait && context.holding == Holding::Unheld => Self::UntilAskedToEnd,
            None => Self::goes_on_if(moving),
        }
    }
}

/// Reads what came of a motion, and ends it if it is to be ended. `verb` and `value` say what was asked for.
pub async fn outcome(
    context: &Context,
    drive: &Drive,
    (verb, value): (&str, &dyn fmt::Display),
    motion: MotionReport,
    then: Then,
    guard: Guard,
) -> Result<MotionOutcome, Failure> {
    let asked = format!("{verb} {value}");
    let done = match motion.commanded.first().filter(|sent| sent.is_rounded()) {
        Some(sent) => format!("{verb} {} {} ({value} asked for)", Shown(sent.commanded), sent.unit),
        None => asked.clone(),
    };
    let limits = limits(drive).await;
    let mut before_stop = None;
    let node = drive.node().id();
    let watched = match then {
        Then::StopAfter(duration) => Some((duration, format!("node {node}: {done} for {} s", duration.as_secs_f64()))),
        Then::UntilAskedToEnd => {
            let (reached, limits) = (reached_text(motion.reached_after), limits.text());
            context.note(&format!(
                "node {node}: {done}: {reached}; limits: {limits}; until Ctrl-C stops it (or give --for TIME; --no-wait leaves it so)"
            ));
            Some((Duration::MAX, format!("node {node}: {done}")))
        }
        Then::GoesOn | Then::Stands => None,
    };
    if let Some((duration, doing)) = watched {
        context.show(&doing);
        shown_while(context, drive, &doing, drive.supervise(duration)).await?;
        before_stop = Some(StateReport::read(drive).await?.motion);
        drive.stop().await?;
    }
    let state = StateReport::read(drive).await?;
    let from_file = drive.description().is_some_and(is_from_file);
    let units = from_file.then(|| "the data sheet does not define the units: CiA 402's units are assumed".to_owned());
    let (guard, farewell) = guard.end(context, drive, then == Then::GoesOn).await?;
    // What the drive does without its host is reported by the guard.
    let notes = motion.notes.iter().filter(|note| !matches!(note, Note::HostLoss(_))).map(ToString::to_string);
    Ok(MotionOutcome {
        asked,
        done,
        commanded: motion.commanded.iter().map(SentCommand::from).collect(),
        reached: motion.reached_after.is_some(),
        reached_after_s: motion.reached_after.map(|time| time.as_secs_f64()),
        stopped: before_stop.is_some(),
        before_stop,
        limits,
        guard,
        state,
        notes: notes.chain(farewell).chain(units).collect(),
    })
}

/// What limits a motion, as far as the drive has objects for it.
async fn limits(drive: &Drive) -> ProfileLimits {
    let Some(axis) = drive.axis_description() else { return ProfileLimits::default() };
    let mode = drive.mode().await.ok();
    if mode == Some(ModeOfOperation::PROFILE_TORQUE) {
        let limit = drive.current_limit().await.ok().flatten();
        let current_a = limit.map(|Amperes(current)| current);
        return ProfileLimits { current_a, is_torque: true, ..ProfileLimits::default() };
    }
    if mode == Some(ModeOfOperation::HOMING) {
        let search_speed_rpm = match axis.homing.and_then(|rules| rules.search_speed) {
            Some(search) => drive.read_quantity(search).await.ok(),
            None => None,
        };
        return ProfileLimits { search_speed_rpm, is_homing: true, ..ProfileLimits::default() };
    }
    // The profile velocity is that of moves to a position.
    let limits = match (mode, axis.units.profile_velocity, axis.units.target_velocity) {
        (Some(ModeOfOperation::PROFILE_VELOCITY | ModeOfOperation::VELOCITY), _, Some(target)) => {
            ProfileLimits { velocity_rpm: highest_rpm(drive, target).await, ..ProfileLimits::default() }
        }
        (_, Some(profile), _) => {
            ProfileLimits { profile_velocity_rpm: drive.read_quantity(profile).await.ok(), ..ProfileLimits::default() }
        }
        _ => ProfileLimits::default(),
    };
    let number = async |object, scale| drive.read_quantity(Quantity { object, scale }).await.ok();
    let ms = Scale::PerCount(1.0);
    match axis.units.ramps {
        Some(Ramps::Times { acceleration, deceleration, quick_stop }) => {
            let option = drive.node().read::<i16>(axis.object(QUICK_STOP_OPTION_CODE)).await.ok();
            // 605Ah chooses between the two ramps.
            let by = match option.and_then(|option| QuickStopOption(option).ramp()) {
                Some(StopRamp::SlowDown) => deceleration,
                _ => quick_stop,
            };
            ProfileLimits {
                acceleration_ms: number(acceleration, ms).await,
                deceleration_ms: number(deceleration, ms).await,
                quick_stop_ms: number(by, ms).await,
                ..limits
            }
        }
        Some(Ramps::Rates { acceleration, scale, .. }) => {
            ProfileLimits { acceleration_rpm_s: number(acceleration, scale).await, ..limits }
        }
        None => limits,
    }
}

/// The highest target velocity that acts, in r/min of the output.
async fn highest_rpm(drive: &Drive, target: Quantity) -> Option<f64> {
    let limits = drive.limits(target.object).await.ok()?;
    let most = limits.held_to.map_or(limits.high, |(most, _)| most.abs().min(limits.high));
    // All that its type holds limits nothing.
    let most = Some(most).filter(|most| *most < i64::from(i32::MAX))?;
    Some(most as f64 * drive.step_of(target).await.ok()?)
}

impl ProfileLimits {
    fn text(&self) -> String {
        let parts = [
            self.velocity_rpm.map(|rpm| format!("speed up to {} r/min", Shown(rpm))),
            self.profile_velocity_rpm.map(|rpm| format!("profile velocity {} r/min", Shown(rpm))),
            self.search_speed_rpm.map(|rpm| format!("search speed {} r/min", Shown(rpm))),
            self.acceleration_ms.map(|ms| format!("acceleration {ms:.0} ms")),
            self.deceleration_ms.map(|ms| format!("deceleration {ms:.0} ms")),
            self.quick_stop_ms.map(|ms| format!("quick stop {ms:.0} ms")),
            self.acceleration_rpm_s.map(|rate| format!("acceleration {} (r/min)/s", Shown(rate))),
            self.current_a.map(|current| format!("current {} A", Shown(current))),
            self.is_homing.then(|| "ramps of the drive's homing".to_owned()),
            self.is_torque.then(|| "the speed is as the load lets it".to_owned()),
        ];
        parts.into_iter().flatten().collect::<Vec<_>>().join(", ")
    }
}

fn reached_text(after: Option<Duration>) -> String {
    after.map_or("commanded, not waited for".into(), |time| format!("reached after {:.2} s", time.as_secs_f64()))
}

impl MotionOutcome {
    /// As lines for people.
    pub fn text(&self, paint: Paint) -> String {
        let reached = reached_text(self.reached_after_s.map(Duration::from_secs_f64));
        let reached = if self.reached { paint.good(&reached) } else { reached };
        let then = if self.stopped { "; stopped again" } else { "" };
        let mut lines = vec![format!("node {}: {}: {reached}{then}", self.state.node, self.done)];
        let rounded = self.commanded.iter().filter(|sent| sent.rounded);
        lines.extend(rounded.map(|sent| format!("  sent    {}", sent.text)));
        lines.extend(self.before_stop.as_ref().map(|motion| format!("  before  {}", motion.text())));
        lines.push(format!("  at      {}", self.state.motion.text()));
        lines.push(format!("  limits  {}", self.limits.text()));
        lines.push(format!("  guard   {}", self.guard.text));
        lines.extend(self.state.fault_lines(paint, "  "));
        lines.extend(self.notes.iter().map(|note| format!("  note    {note}")));
        lines.join("\n")
    }
}
