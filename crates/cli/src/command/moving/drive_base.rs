//! `ferrodrive drive-base`: a base on two wheels, by twists.

use std::io::BufRead;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, TryRecvError, sync_channel};
use std::time::Duration;

use machine::base_drive::{BaseDrive, come_to_rest, cycle, finite, open, wheels};
use machine::file::{BASE_PERIOD, CyclePlan};
use master::base::{Base, BaseError, BaseLimits, BaseState, Geometry, StopCause, Twist, WheelSetup};
use master::units::{Shown, parse_duration};
use serde::Serialize;
use words::counted;

use super::group::end_guards;
use crate::command::cycles::{CycleArgs, refuse_too_full};
use crate::context::Context;
use crate::failure::Failure;
use crate::global::Global;
use crate::output::{Format, Report};
use crate::session;
use console::guard::{GuardArgs, GuardReport};
use plot::Paint;
use words::failure::SEE_DRIVES;
use words::time::some_time;

/// How long a line counts on the virtual bus of this command alone, where no time passes between two lines.
const VIRTUAL_LINE: Duration = Duration::from_millis(100);

/// How often a person is shown where the base is.
const PROGRESS_PERIOD: Duration = Duration::from_millis(200);

/// Lines that are kept while the base is busy; of more than one the newest counts.
const MOST_LINES: usize = 16;

/// Drive a base on two wheels by a twist, or by a stream of twists on standard input
///
/// Wheels, geometry and limits come from the [base] of a machine file. Without --for, each line of standard input is a
/// twist, `LINEAR ANGULAR` in m/s and rad/s: it is valid until the next one arrives, and for 300 ms at most, so that a
/// program that hangs stops the base. On the command's own virtual bus each line lasts for 100 ms of virtual time. At
/// the end of the input the base comes to rest; then power is removed from its drives.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    ferrodrive drive-base examples/base.toml --linear 0.3 --angular 0.2 --for 3s\n  \
    while echo 0.2 0; do sleep 0.1; done | ferrodrive drive-base base.toml\n  \
    my_controller | ferrodrive --bus can0 drive-base base.toml --dead-man 150ms")]
pub(crate) struct DriveBase {
    /// Machine file with a [base] (default: that of --machine or --bus sim:FILE.toml)
    #[arg(value_name = "FILE.toml")]
    file: Option<PathBuf>,
    /// Speed along the heading in m/s; negative is backwards
    #[arg(long, value_name = "M/S", value_parser = finite, allow_negative_numbers = true, requires = "duration")]
    linear: Option<f64>,
    /// Rate of turn in rad/s; positive is to the left
    #[arg(long, value_name = "RAD/S", value_parser = finite, allow_negative_numbers = true, requires = "duration")]
    angular: Option<f64>,
    /// How long to drive (default: twists are read from standard input)
    #[arg(long = "for", id = "duration", value_name = "TIME", value_parser = some_time)]
    duration: Option<Duration>,
    /// How long a line is valid (default: the file's watchdog, or 300ms)
    #[arg(long, value_name = "TIME", value_parser = parse_duration, conflicts_with = "duration")]
    dead_man: Option<Duration>,
    #[command(flatten)]
    cycles: CycleArgs,
    #[command(flatten)]
    guard: GuardArgs,
}

/// What came of it.
#[derive(Debug, Serialize)]
pub(crate) struct BaseDriven {
    /// How long it was driven, until it stood.
    time_s: f64,
    /// Where it came to by its wheels, from where it began.
    pose: PoseReport,
    /// How often no line came in time, and the base was stopped.
    dead_man_stops: u32,
    /// Lines that were not a twist.
    bad_lines: u32,
    /// Cycles in which a wheel's position did not come.
    unseen_cycles: u64,
    limits: BaseLimitValues,
    wheels: [WheelReport; 2],
}

#[derive(Debug, Serialize)]
struct PoseReport {
    x_m: f64,
    y_m: f64,
    heading_deg: f64,
}

#[derive(Debug, Serialize)]
struct BaseLimitValues {
    linear_m_s: f64,
    angular_rad_s: f64,
    wheel_m_s: f64,
    wheel_m_s2: f64,
    dead_man_ms: f64,
    lag_m: f64,
}

#[derive(Debug, Serialize)]
struct WheelReport {
    node: u8,
    mode: String,
    guard: GuardReport,
}

/// Where twists come from.
enum TwistSource {
    For(BaseDrive),
    Lines(Receiver<String>),
}

/// What happened while it was driven.
#[derive(Debug, Default)]
struct BaseRun {
    time: Duration,
    dead_man_stops: u32,
    bad_lines: u32,
    /// The last twist was beyond the limits.
    beyond: bool,
}

/// What the base can do, for what is asked of it beyond that.
#[derive(Clone, Copy)]
struct BaseBounds {
    geometry: Geometry,
    limits: BaseLimits,
}

impl BaseBounds {
    /// Says once of twists beyond the limits, one after the other, what is driven instead.
    fn say(&self, context: &Context, twist: Twist, seen: &mut BaseRun) {
        let driven = self.geometry.saturate(twist, &self.limits);
        let beyond = driven != twist;
        if beyond && !seen.beyond {
            let [linear, angular] = [twist.linear_m_s, twist.angular_rad_s].map(Shown);
            let [to_linear, to_angular] = [driven.linear_m_s, driven.angular_rad_s].map(Shown);
            context.note(&format!(
                "{linear} m/s and {angular} rad/s are beyond the limits of the base: it is driven at {to_linear} m/s and {to_angular} rad/s"
            ));
        }
        seen.beyond = beyond;
    }
}

impl DriveBase {
    /// Drives, and prints where the base came to.
    pub(crate) fn run(&self, global: &Global, format: Format) -> Result<(), Failure> {
        if self.duration.is_some() && self.linear.is_none() && self.angular.is_none() {
            return Err(Failure::usage("--for needs a twist").next(
                "give --linear M/S, --angular RAD/S or both, or omit --for: twists are then read from standard input",
            ));
        }
        let global = match &self.file {
            Some(path) => global.on_machine(path, &session::read_machine(path)?)?,
            None => global.clone(),
        };
        let report = session::run(&global, async |context| self.drive(context).await)?;
        format.print(&report).map_err(Failure::of_stdout)
    }

    async fn drive(&self, context: &Context) -> Result<BaseDriven, Failure> {
        let Some(plan) = context.machine.as_ref().and_then(|machine| machine.base) else {
            // A file that was given is the one that has to have it.
            let failure = if context.machine.is_some() {
                Failure::bad_file("the machine file has no [base]")
            } else {
                Failure::usage("expected a machine file with a [base]")
            };
            return Err(
                failure.next("give one: ferrodrive drive-base --machine FILE.toml (docs/machine-file.md describes it)")
            );
        };
        let watchdog = self.dead_man.unwrap_or(plan.limits.watchdog);
        let limits = BaseLimits { watchdog, ..plan.limits };
        if let Some(asked) = self.asked() {
            asked.check(&plan, &limits)?;
        }
        let [(left, _), (right, _)] = plan.wheels;
        let wheels = wheels(&plan, [context.known_drive(left).await?, context.known_drive(right).await?]);
        let [left, right] = &wheels;
        refuse_too_full(context, &CyclePlan::from(&plan), &[&left.drive, &right.drive]).await?;
        let mut guards = Vec::new();
        for wheel in &wheels {
            guards.push(self.guard.begin(context, &wheel.drive).await?);
        }
        let driven = match open(&plan, &wheels, limits, self.cycles.options()).await {
            Ok(mut base) => {
                let driven = self.carry_out(context, &mut base, BaseBounds { geometry: plan.geometry, limits }).await;
                let state = base.state();
                let closed = base.close().await.map_err(Failure::from);
                driven.and_then(|seen| closed.map(|()| (seen, state)))
            }
            Err(error) => Err(error.into()),
        };
        let reports = end_guards(context, guards, [&left.drive, &right.drive].into_iter()).await;
        let (seen, state) = driven?;
        let reports: [GuardReport; 2] =
            reports?.try_into().map_err(|_| Failure::new("a wheel was not released").next(SEE_DRIVES))?;
        Ok(BaseDriven::new(&seen, &state, limits, [left, right], reports))
    }

    async fn carry_out(&self, context: &Context, base: &mut Base, bounds: BaseBounds) -> Result<BaseRun, Failure> {
        match self.follow(context, base, bounds).await {
            Ok(seen) => Ok(seen),
            Err(error) => {
                let cause = match &error {
                    BaseError::Stopped(cause) => Some(*cause),
                    BaseError::NotStopped { cause, .. } => Some(**cause),
                    _ => None,
                };
                let reason = if cause.is_some() { base.explain_stop().await } else { None };
                let failure = reason.into_iter().fold(Failure::from(error), Failure::because);
                Err(match cause {
                    Some(StopCause::Wheel { refusal, .. }) => self.cycles.advised(failure, refusal),
                    _ => failure,
                })
            }
        }
    }

    async fn follow(&self, context: &Context, base: &mut Base, bounds: BaseBounds) -> Result<BaseRun, BaseError> {
        context.progress.show("enabling both wheels");
        base.enable().await?;
        let mut seen = BaseRun::default();
        let began = context.network.now();
        match self.source() {
            TwistSource::For(asked) => {
                asked.carry_out(base, &context.network, |state| show(context, state, began)).await?;
            }
            TwistSource::Lines(lines) if context.is_embedded() => {
                follow_virtually(context, (base, bounds), &lines, &mut seen).await?
            }
            TwistSource::Lines(lines) => follow_lines(context, (base, bounds), &lines, &mut seen).await?,
        }
        come_to_rest(base, &context.network).await?;
        seen.time = context.network.now() - began;
        Ok(seen)
    }

    fn source(&self) -> TwistSource {
        self.asked().map_or_else(|| TwistSource::Lines(lines_of_input()), TwistSource::For)
    }

    /// The twist of the command line, with its time; lines of a controller are held to the limits as they come.
    fn asked(&self) -> Option<BaseDrive> {
        let (linear_m_s, angular_rad_s) = (self.linear.unwrap_or_default(), self.angular.unwrap_or_default());
        Some(BaseDrive { twist: Twist { linear_m_s, angular_rad_s }, time: self.duration? })
    }
}

/// The lines of standard input, read by a thread: a read cannot be waited for beside the cycles. The thread ends with the input
/// or with the process.
fn lines_of_input() -> Receiver<String> {
    let (sender, lines) = sync_channel(MOST_LINES);
    std::thread::spawn(move || {
        for line in std::io::stdin().lock().lines() {
            let Ok(line) = line else { return };
            if sender.send(line).is_err() {
                return;
            }
        }
    });
    lines
}

/// Where the base is, for a person.
fn show(context: &Context, state: &BaseState, began: can::Instant) {
    let elapsed = context.network.now() - began;
    if is_progress_due(elapsed) {
        context.progress.show(format!("after {:.1} s: {}", elapsed.as_secs_f64(), place(state)));
    }
}

/// True in about one cycle of each such period.
fn is_progress_due(elapsed: Duration) -> bool {
    elapsed.as_millis() % PROGRESS_PERIOD.as_millis() < BASE_PERIOD.as_millis()
}

fn place(state: &BaseState) -> String {
    let pose = state.pose;
    let heading_deg = pose.heading_rad.to_degrees();
    format!("at x {:.3} m, y {:.3} m, heading {heading_deg:.1} deg", pose.x_m, pose.y_m)
}

/// The newest line of each cycle, until the input ends. Where none comes in time, the base's watchdog stops it.
async fn follow_lines(
    context: &Context,
    (base, bounds): (&mut Base, BaseBounds),
    lines: &Receiver<String>,
    seen: &mut BaseRun,
) -> Result<(), BaseError> {
    let began = context.network.now();
    let mut was_late = false;
    loop {
        let mut newest = None;
        let ended = loop {
            match lines.try_recv() {
                Ok(line) => newest = twist_of(context, &line, seen).or(newest),
                Err(TryRecvError::Empty) => break false,
                Err(TryRecvError::Disconnected) => break true,
            }
        };
        if let Some(twist) = newest {
            take(context, (base, bounds), twist, seen)?;
        }
        let state = cycle(base).await?;
        show(context, &state, began);
        let is_late = matches!(state.cause, Some(StopCause::Watchdog { .. }));
        if let Some(cause) = state.cause.filter(|_| is_late && !was_late) {
            seen.dead_man_stops += 1;
            context.note(&format!("{cause}; the next line continues"));
        }
        was_late = is_late;
        if ended {
            return Ok(());
        }
    }
}

/// Each line for the same virtual time, so that a run is the same whenever its lines come.
async fn follow_virtually(
    context: &Context,
    (base, bounds): (&mut Base, BaseBounds),
    lines: &Receiver<String>,
    seen: &mut BaseRun,
) -> Result<(), BaseError> {
    let began = context.network.now();
    while let Ok(line) = lines.recv() {
        let Some(twist) = twist_of(context, &line, seen) else { continue };
        let end = context.network.now() + VIRTUAL_LINE;
        while context.network.now() < end {
            take(context, (base, bounds), twist, seen)?;
            show(context, &cycle(base).await?, began);
        }
    }
    Ok(())
}

/// A twist that is not a number is a bad line; any other error ends the command.
fn take(
    context: &Context,
    (base, bounds): (&mut Base, BaseBounds),
    twist: Twist,
    seen: &mut BaseRun,
) -> Result<(), BaseError> {
    bounds.say(context, twist, seen);
    match base.command(twist) {
        Err(error @ BaseError::BadTwist { .. }) => {
            seen.bad_lines += 1;
            context.note(&error.to_string());
            Ok(())
        }
        taken => taken,
    }
}

/// The twist of a line. Any other line is reported and ignored: if no valid one follows, the dead man stops the base.
fn twist_of(context: &Context, line: &str, seen: &mut BaseRun) -> Option<Twist> {
    let mut words = line.split_whitespace().map(|word| word.parse::<f64>().ok().filter(|number| number.is_finite()));
    let twist = match (words.next(), words.next(), words.next()) {
        (None, None, None) => return None,
        (Some(Some(linear_m_s)), Some(Some(angular_rad_s)), None) => Some(Twist { linear_m_s, angular_rad_s }),
        _ => None,
    };
    if twist.is_none() {
        seen.bad_lines += 1;
        let shown: String = line.chars().take(60).collect();
        context.note(&format!("expected a twist of two numbers, m/s and rad/s, e.g. 0.3 -0.1, got '{shown}'"));
    }
    twist
}

impl BaseDriven {
    fn new(
        seen: &BaseRun,
        state: &BaseState,
        limits: BaseLimits,
        wheels: [&WheelSetup; 2],
        guards: [GuardReport; 2],
    ) -> Self {
        let BaseLimits { linear_m_s, angular_rad_s, wheel_m_s, wheel_m_s2, watchdog, lag_m } = limits;
        let dead_man_ms = watchdog.as_secs_f64() * 1e3;
        let [left, right] = guards;
        let report = |wheel: &WheelSetup, guard| WheelReport {
            node: wheel.drive.node().id().raw(),
            mode: wheel.mode.name().unwrap_or("manufacturer-specific").to_owned(),
            guard,
        };
        Self {
            time_s: seen.time.as_secs_f64(),
            pose: PoseReport {
                x_m: state.pose.x_m,
                y_m: state.pose.y_m,
                heading_deg: state.pose.heading_rad.to_degrees(),
            },
            dead_man_stops: seen.dead_man_stops,
            bad_lines: seen.bad_lines,
            unseen_cycles: state.unseen_cycles,
            limits: BaseLimitValues { linear_m_s, angular_rad_s, wheel_m_s, wheel_m_s2, dead_man_ms, lag_m },
            wheels: [report(wheels[0], left), report(wheels[1], right)],
        }
    }
}

impl Report for BaseDriven {
    fn text(&self, paint: Paint) -> String {
        let PoseReport { x_m, y_m, heading_deg } = self.pose;
        let head = format!("the base stands after {:.2} s; its drives are without power", self.time_s);
        let BaseLimitValues { linear_m_s, angular_rad_s, wheel_m_s, wheel_m_s2, dead_man_ms, lag_m } = self.limits;
        let [linear, angular, wheel, ramp] = [linear_m_s, angular_rad_s, wheel_m_s, wheel_m_s2].map(Shown);
        let mut lines = vec![
            paint.good(&head),
            format!("  at      x {x_m:.3} m, y {y_m:.3} m, heading {heading_deg:.1} deg, by its wheels"),
            format!(
                "  limits  {linear} m/s, {angular} rad/s, a wheel {wheel} m/s and {ramp} m/s^2, {} m behind at most, a twist {} ms",
                Shown(lag_m),
                Shown(dead_man_ms)
            ),
        ];
        lines.extend(self.wheels.iter().map(|wheel| format!("  guard   node {}: {}", wheel.node, wheel.guard.text)));
        if self.dead_man_stops > 0 {
            lines.push(format!("  note    stopped {} because no line arrived", counted(self.dead_man_stops, "time")));
        }
        if self.bad_lines > 0 {
            lines.push(format!("  note    {} ignored: not a twist", counted(self.bad_lines, "line")));
        }
        lines.join("\n")
    }
}
