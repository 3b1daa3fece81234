//! Several drives as one motion: to positions together, at speeds together, or as the two wheels of a base.
//!
//! The motion is the master's ([`Group`], [`Base`]): set-points in each cycle of SYNC, limited in jerk or acceleration, and a
//! fault of one drive stops all. Held like any other motion: speeds and twists by a dead man, all of them by the presence of
//! their page. There is one group at a time, since a bus has one SYNC. A group is made for each motion, and its drives are disabled
//! afterwards.

use std::cell::Cell;
use std::rc::Rc;
use std::time::Duration;

use can::Instant;
use canopen::NodeId;
use machine::file::{GroupPlan, speed_mode};
use machine::group_move::{self, PULLING_LOAD};
use master::Drive;
use master::base::{Base, BaseError, BaseLimits, Geometry, Twist, WheelSetup};
use master::cyclic::CyclicOptions;
use master::group::{AxisLimits, AxisSetup, Group, GroupError, StreamOptions};
use master::units::{Along, Angle, Rpm, Shown, Turns};

use crate::answer::Answer;
use crate::command::{AxisSpeed, BaseJog, GroupCommand, GroupMove};
use crate::motion::group_run::{GroupOutcome, GroupRun, Wanted};
use crate::motion::guarding::{UNGUARDED, expect_guard};
use crate::parameters::transactions::Refusal;
use crate::session::DeadMan;
use crate::state::{Host, JOG_SPAN};
use crate::work::{Asked, LineOf, Running, send};

/// SYNC period: at 500 kbit/s eight drives take half of it.
const PERIOD: Duration = Duration::from_millis(10);

/// Consecutive cycles that this program, or the TPDO of a drive, may be late: less than the time of the dead man. Desktops are late.
const TOLERANCE: u32 = 15;

/// Most axes of a group: as many as a bus at 500 kbit/s carries in one period besides the readings of the studio.
const MOST_AXES: usize = 8;

/// Cycles for which a stream continues at its last speed: the maximum.
const GRACE: u32 = 10;

/// Points of a path that are sent ahead of the first one in use, and kept ready.
const READY: usize = 2;

impl Host {
    /// Starts a motion of several drives, or holds one.
    pub(crate) fn take_group(&mut self, command: GroupCommand, asked: Asked) {
        match command {
            GroupCommand::GroupHold {} => self.hold_group(asked, |_| {}),
            GroupCommand::BaseTwist { linear_m_s, angular_rad_s } => {
                self.hold_group(asked, |wanted| wanted.twist = Twist { linear_m_s, angular_rad_s });
            }
            GroupCommand::GroupEnd {} => self.hold_group(asked, |wanted| wanted.released = true),
            GroupCommand::GroupMove(asked_for) => {
                let planned = together(asked_for).and_then(|wanted| {
                    let (nodes, plan) = wanted.axes_in(Some(&self.setting.groups)).map_err(|failure| {
                        let (kind, text) = crate::capture::refusal(&failure);
                        (if failure.is_usage { "malformed" } else { kind }, text)
                    })?;
                    Ok((nodes, plan.cloned(), wanted))
                });
                let (nodes, plan, wanted) = match planned {
                    Ok(planned) => planned,
                    Err((kind, text)) => return send(asked.1, Answer::failed(Some(asked.0), kind, text)),
                };
                self.begin_group(&nodes, "moving together", false, asked, move |drives, _| {
                    Box::pin(move_together(drives, plan, wanted))
                });
            }
            GroupCommand::GroupJog { axes, rpm_per_s } => {
                let nodes: Vec<_> = axes.iter().map(|axis| axis.node).collect();
                if let Some(text) = axes.iter().find_map(|axis| too_fast(axis, &self.setting.groups)) {
                    return send(asked.1, Answer::failed(Some(asked.0), "group", text));
                }
                self.begin_group(&nodes, "turning together", true, asked, move |drives, wanted| {
                    Box::pin(turn_together(drives, axes, rpm_per_s, wanted))
                });
            }
            GroupCommand::BaseJog(asked_for) => {
                self.begin_group(&asked_for.wheels.clone(), "driving", true, asked, move |drives, wanted| {
                    wanted.set(Wanted { twist: asked_for.twist(), released: false });
                    Box::pin(drive_base(drives, asked_for, wanted))
                });
            }
        }
    }

    fn begin_group(
        &mut self,
        nodes: &[NodeId],
        what: &'static str,
        held: bool,
        (seq, answer): Asked,
        motion: impl FnOnce(Vec<Drive>, Rc<Cell<Wanted>>) -> core::pin::Pin<Box<dyn Future<Output = GroupOutcome>>>,
    ) {
        let drives = match self.drives_of(nodes) {
            Ok(drives) => drives,
            Err((kind, text)) => return send(answer, Answer::failed(Some(seq), kind, text)),
        };
        self.generation += 1;
        let wanted = Rc::<Cell<Wanted>>::default();
        let unaccepted = self.not_accepted(&drives);
        let motion = motion(drives, Rc::clone(&wanted));
        let motion = async move {
            for drive in &unaccepted {
                expect_guard(drive).await?;
            }
            motion.await
        };
        let (running, future) = Running::of_group(nodes, self.generation, what, (seq, answer), motion);
        for (node, running) in nodes.iter().zip(running) {
            self.jogs.remove(node);
            self.leave_lines(LineOf::Stop(*node));
            if let Some(before) = self.running.insert(*node, running) {
                before.cut_short("replaced", "replaced by another command to the drive");
            }
        }
        let held = held.then(|| DeadMan::new(JOG_SPAN, self.network.now()));
        self.group = Some(GroupRun { generation: self.generation, nodes: nodes.to_vec(), held, wanted });
        self.work.push(future);
    }

    /// The drives for a group, if all of them can be moved now.
    fn drives_of(&self, nodes: &[NodeId]) -> Result<Vec<Drive>, Refusal> {
        if self.group.is_some() {
            return Err(("busy", "another group is moving, and there is one at a time: stop it first".into()));
        }
        // It ends with SYNC, its TPDOs and the node's NMT state as they were: a group that began meanwhile would lose them on the way.
        if let Some(node) = self.captures.keys().next() {
            let text =
                format!("node {node} is being captured: end the capture first, or begin it once the group moves");
            return Err(("busy", text));
        }
        if nodes.len() < 2 || nodes.len() > MOST_AXES {
            return Err(("malformed", format!("expected 2 to {MOST_AXES} drives, got {}", nodes.len())));
        }
        let mut drives = Vec::new();
        for (at, node) in nodes.iter().enumerate() {
            if nodes[..at].contains(node) {
                return Err(("malformed", format!("node {node} is named twice")));
            }
            if self.parameters.is_writing(*node) {
                let text = format!("the parameters of node {node} are being written: try again afterwards");
                return Err(("busy", text));
            }
            let drive = self.nodes.get(node).and_then(|known| known.drive.clone()).ok_or_else(|| {
                let text = format!("no drive is known at node {node}: scan the bus, and check its supply");
                ("no_such_drive", text)
            })?;
            drives.push(drive);
        }
        Ok(drives)
    }

    fn hold_group(&mut self, (seq, answer): Asked, change: impl FnOnce(&mut Wanted)) {
        let now = self.network.now();
        let held = self.group.as_mut().and_then(|group| {
            let renewed = group.held.as_mut()?.renew(now);
            renewed.then_some(group)
        });
        let Some(group) = held else {
            let text = "this page holds no group: start the motion again";
            return send(answer, Answer::failed(Some(seq), "not_held", text));
        };
        let mut wanted = group.wanted.get();
        change(&mut wanted);
        group.wanted.set(wanted);
        if wanted.released {
            // It comes to rest by itself now, as any motion that is not held.
            group.held = None;
        }
        send(answer, Answer::done(seq, Vec::new()));
    }

    /// True if a node is moved in a group.
    pub(crate) fn is_in_group(&self, node: NodeId) -> bool {
        self.group.as_ref().is_some_and(|group| group.nodes.contains(&node))
    }

    /// The nodes of a group whose dead man has lapsed.
    pub(crate) fn let_go_group(&self, now: Instant) -> Vec<NodeId> {
        let lapsed = self.group.as_ref().filter(|group| group.held.is_some_and(|held| held.has_lapsed(now)));
        lapsed.map_or_else(Vec::new, |group| group.nodes.clone())
    }

    /// The other nodes of the group of a node, to be stopped with it. The group ends with this.
    pub(crate) fn leave_group(&mut self, node: NodeId) -> Vec<NodeId> {
        let Some(group) = self.group.take_if(|group| group.nodes.contains(&node)) else { return Vec::new() };
        self.network.sync(None);
        group.nodes.into_iter().filter(|other| *other != node).collect()
    }

    /// A group has ended by itself.
    pub(crate) fn conclude_group(&mut self, generation: u64, outcome: Option<GroupOutcome>) {
        let Some(group) = self.group.take_if(|group| group.generation == generation) else { return };
        let mut asked = Vec::new();
        for node in &group.nodes {
            if let Some(running) = self.running.remove(node) {
                asked.push(running);
            }
            // Its mapping is that of the group now.
            self.learn_pdos(*node);
        }
        match outcome {
            Some(Ok(notes)) => {
                asked.into_iter().for_each(|running| running.reply(|seq| Answer::done(seq, notes.clone())));
            }
            Some(Err((kind, text))) => {
                if kind != UNGUARDED {
                    self.send_news(None, &text);
                }
                asked
                    .into_iter()
                    .for_each(|running| running.reply(|seq| Answer::failed(Some(seq), kind, text.clone())));
                self.network.sync(None);
                // The failure may have left one turning.
                let left: Vec<_> = group.nodes.iter().filter(|node| self.network.moved().contains(**node)).collect();
                left.into_iter().for_each(|node| self.quick_stop_one(*node, "", None));
            }
            None => {}
        }
    }
}

fn options() -> CyclicOptions {
    CyclicOptions { tolerance: TOLERANCE, ..CyclicOptions::default() }
}

/// Closes a group, and returns the outcome of its motion, with the reason of the drive that stopped it.
async fn close(mut group: Group, moved: Result<Vec<String>, GroupError>) -> GroupOutcome {
    let reason = match &moved {
        Err(GroupError::Stopped(_)) => group.explain_stop().await,
        _ => None,
    };
    let closed = group.close().await;
    let notes = moved.map_err(|error| {
        let reason = reason.map_or_else(String::new, |reason| format!(". {reason}"));
        ("group", format!("{error}{reason}"))
    })?;
    closed.map_err(refusal)?;
    Ok(notes)
}

fn refusal(error: GroupError) -> Refusal {
    match error {
        GroupError::Drive(error) => (error.kind(), error.to_string()),
        error => ("group", error.to_string()),
    }
}

/// The limits of an axis at this speed: else the conservative defaults, except a rate that was given.
fn limits(rpm: f64, rpm_per_s: Option<f64>) -> AxisLimits {
    let careful = AxisLimits::careful();
    let acceleration_turns_s2 = rpm_per_s.map_or(careful.acceleration_turns_s2, |rate| rate / 60.0);
    let rounding_s = careful.acceleration_turns_s2 / careful.jerk_turns_s3;
    AxisLimits {
        velocity_turns_s: rpm / 60.0,
        acceleration_turns_s2,
        jerk_turns_s3: acceleration_turns_s2 / rounding_s,
        ..careful
    }
}

/// A file's limit for an axis is that of a speed that is held too.
fn too_fast(axis: &AxisSpeed, groups: &[GroupPlan]) -> Option<String> {
    let mut axes = groups.iter().flat_map(|group| group.axes.iter().map(move |axis| (group, axis)));
    let (group, said) = axes.find(|(_, said)| said.node == axis.node)?;
    let most_rpm = said.limits.velocity_turns_s * 60.0;
    (axis.rpm.abs() > most_rpm * (1.0 + 1e-9)).then(|| {
        let (rpm, most) = (Shown(axis.rpm.abs()), Shown(most_rpm));
        format!(
            "node {}: {rpm} r/min are more than {most} r/min, its limit in the group '{}' of the machine file",
            axis.node, group.name
        )
    })
}

/// The move that a page asks for.
fn together(asked: GroupMove) -> Result<group_move::GroupMove, Refusal> {
    let GroupMove { axes, relative, rpm, rpm_per_s, within_s } = asked;
    let within = match within_s.map(Duration::try_from_secs_f64).transpose() {
        Ok(within) => within,
        Err(_) => return Err(("malformed", "expected a time above 0 in seconds".into())),
    };
    Ok(group_move::GroupMove {
        targets: axes.iter().map(|axis| (axis.node, Along::Turning(Angle::Turns(axis.degrees / 360.0)))).collect(),
        relative,
        within,
        velocity: rpm.map(Rpm),
        acceleration: rpm_per_s.map(|rate| rate / 60.0),
        ..group_move::GroupMove::default()
    })
}

/// With a plan of the machine file within its limits and in its period; the axes that have no target stay where they are, powered.
async fn move_together(drives: Vec<Drive>, plan: Option<GroupPlan>, mut asked: group_move::GroupMove) -> GroupOutcome {
    let nodes: Vec<_> = drives.iter().map(|drive| drive.node().id()).collect();
    asked.period = if plan.is_some() { None } else { Some(PERIOD) };
    let planned = asked.plan(plan.as_ref(), drives).await.map_err(refusal)?;
    let mut group = planned.open(options()).await.map_err(refusal)?;
    let moved = planned.carry_out(&mut group, |_, _| {}).await.map(|run| {
        let lags = nodes.iter().zip(&run.largest_turns);
        let lags: Vec<_> = lags.map(|(node, turns)| format!("node {node} {:.1} deg", turns * 360.0)).collect();
        let time = format!("{} drives moved together in {:.3} s", nodes.len(), run.time.as_secs_f64());
        vec![format!("{time}; largest lag: {}. They are disabled now: {PULLING_LOAD}", lags.join(", "))]
    });
    close(group, moved).await
}

async fn turn_together(
    drives: Vec<Drive>,
    axes: Vec<AxisSpeed>,
    rpm_per_s: Option<f64>,
    wanted: Rc<Cell<Wanted>>,
) -> GroupOutcome {
    if let Some(axis) = axes.iter().find(|axis| !axis.rpm.is_finite()) {
        return Err(("malformed", format!("expected a finite speed for node {}", axis.node)));
    }
    // A drive that stays at rest has limits too.
    let least_rpm = AxisLimits::careful().velocity_turns_s * 60.0;
    let of_axis = |axis: &AxisSpeed| limits(axis.rpm.abs().max(least_rpm) * ROOM, rpm_per_s);
    let mut setups = Vec::new();
    for (drive, axis) in drives.into_iter().zip(&axes) {
        let mode = AxisSetup::best_mode(&drive).map_err(refusal)?;
        setups.push(AxisSetup { drive, mode, limits: of_axis(axis) });
    }
    let mut group = Group::open(&setups, PERIOD, options()).await.map_err(refusal)?;
    let turned = stream_speeds(&mut group, &axes, of_axis(&axes[0]).acceleration_turns_s2, &wanted).await;
    close(group, turned).await
}

/// Factor by which the limits of a stream are wider than its points need, since these are rounded.
const ROOM: f64 = 1.01;

/// Points of shafts that accelerate together, until they are released. The fraction of the speeds rises as 3x^2 - 2x^3, whose
/// steepest slope is 1.5.
async fn stream_speeds(
    group: &mut Group,
    axes: &[AxisSpeed],
    acceleration_turns_s2: f64,
    wanted: &Cell<Wanted>,
) -> Result<Vec<String>, GroupError> {
    group.enable().await?;
    let period_s = PERIOD.as_secs_f64();
    let fastest_turns_s = axes.iter().map(|axis| axis.rpm.abs() / 60.0).fold(0.0, f64::max);
    let ramp_s = (1.5 * ROOM * fastest_turns_s / acceleration_turns_s2).max(period_s);
    let mut points: Vec<_> = group.points().iter().map(|point| Turns(point.position_turns)).collect();
    group.start_stream(StreamOptions { capacity: 8, prefill: READY, grace: GRACE })?;
    let mut time_s = 0.0;
    while !wanted.get().released {
        while group.stream().is_some_and(|stream| stream.queued() < READY) {
            time_s += period_s;
            let x = (time_s / ramp_s).min(1.0);
            let share = x * x * (3.0 - 2.0 * x);
            for (Turns(at), axis) in points.iter_mut().zip(axes) {
                *at += axis.rpm / 60.0 * share * period_s;
            }
            group.push(&points)?;
        }
        if group.cycle().await?.cause.is_some() {
            break;
        }
    }
    group.end_stream();
    group.rest().await?;
    Ok(Vec::new())
}

async fn drive_base(drives: Vec<Drive>, asked: BaseJog, wanted: Rc<Cell<Wanted>>) -> GroupOutcome {
    let refused = |error: BaseError| match error {
        BaseError::Drive(error) => (error.kind(), error.to_string()),
        error => ("group", error.to_string()),
    };
    let wheel =
        |at: usize| WheelSetup { mode: speed_mode(&drives[at]), drive: drives[at].clone(), turns: asked.turns[at] };
    let geometry = Geometry { wheel_base_m: asked.wheel_base_m, wheel_radius_m: asked.wheel_radius_m };
    let limits = BaseLimits {
        linear_m_s: asked.most_m_s,
        angular_rad_s: 2.0 * asked.most_m_s / asked.wheel_base_m,
        wheel_m_s: asked.most_m_s,
        wheel_m_s2: asked.m_per_s2,
        // The dead man of the page holds the motion; this covers a late host.
        watchdog: JOG_SPAN,
        lag_m: BaseLimits::lag_for(asked.most_m_s),
    };
    let base = Base::open([&wheel(0), &wheel(1)], geometry, limits, PERIOD, options()).await;
    let mut base = base.map_err(refused)?;
    let driven = follow_twists(&mut base, &wanted).await;
    let reason = match &driven {
        Err(BaseError::Stopped(_) | BaseError::NotStopped { .. }) => base.explain_stop().await,
        _ => None,
    };
    let pose = base.state().pose;
    let closed = base.close().await;
    driven.map_err(|error| {
        let (kind, text) = refused(error);
        (kind, reason.map_or(text.clone(), |reason| format!("{text}. {reason}")))
    })?;
    closed.map_err(refused)?;
    let heading = pose.heading_rad.to_degrees();
    Ok(vec![format!("moved {:.3} m forward, {:.3} m to the left, turned {heading:.1} deg", pose.x_m, pose.y_m)])
}

async fn follow_twists(base: &mut Base, wanted: &Cell<Wanted>) -> Result<(), BaseError> {
    base.enable().await?;
    while !wanted.get().released {
        base.command(wanted.get().twist)?;
        if let Some(cause) = base.cycle().await?.cause.filter(|cause| cause.wheel().is_some()) {
            // Both wheels come to rest before the outcome is reported.
            base.stop().await?;
            return Err(BaseError::Stopped(cause));
        }
    }
    base.stop().await
}
