//! The speed limit of a session: faster motions are refused before anything is sent. Enforced here and not by the page,
//! which may be an old one, or a program.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use canopen::NodeId;
use master::Gear;
use master::drive::{self, Motion};
use master::group::AxisLimits;
use master::units::{Along, Rpm};

use crate::answer::Answer;
use crate::command::{BaseJog, CaptureCommand, Command, GroupCommand, NodeCommand, TestMotionOrder, TuneCommand};
use crate::commands::done;
use crate::parameters::transactions::Refusal;
use crate::session::authority::SessionId;
use crate::state::Host;
use crate::test_motion::ShapeName;
use crate::work::{Asked, send};

/// The kind of the refusal, for programs.
pub(crate) const TOO_FAST: &str = "speed_limit";

impl Host {
    /// A session sets its speed limit, in r/min of the shaft, or removes it. What this studio has in motion for it was
    /// started under another limit: a lower one stops it.
    pub(crate) fn limit_speed(&mut self, session: SessionId, rpm: Option<f64>, asked: Asked) {
        if let Some(rpm) = rpm.filter(|rpm| !(rpm.is_finite() && *rpm > 0.0)) {
            let (seq, answer) = asked;
            let text = format!("expected a speed limit above 0 r/min, got {rpm}");
            return send(answer, Answer::failed(Some(seq), "malformed", text));
        }
        let before = match rpm {
            Some(rpm) => self.speed_limits.insert(session, rpm),
            None => self.speed_limits.remove(&session),
        };
        let is_lower = rpm.is_some_and(|rpm| before.is_none_or(|before| rpm < before));
        if is_lower && self.authority.controller() == Some(session) {
            self.stop_moved("a lower speed limit was set");
            // Their trial would be as fast as their measurement.
            self.tuned.clear();
        }
        done(asked);
    }

    /// Whether a command of a session keeps to its limit.
    pub(crate) fn within_speed_limit(&self, session: SessionId, command: &Command) -> Result<(), Refusal> {
        self.speed_limits.get(&session).map_or(Ok(()), |limit_rpm| keeps_to(command, *limit_rpm, &self.setting.gears))
    }
}

type Gears = BTreeMap<NodeId, Gear>;

/// The speed of a shaft, behind its gear, in a command.
enum Speed {
    /// At most this, in r/min.
    Rpm(f64),
    /// The speed set in the drive.
    AsSet,
    /// That with which the model is usually measured.
    UsualToMeasure,
    /// Any speed that its load allows.
    UpToTheLoad,
    /// So much along a way, and not known how many turns those are.
    OfAnUnknownFeed,
    /// The command does not move it.
    None,
}

fn keeps_to(command: &Command, limit_rpm: f64, gears: &Gears) -> Result<(), Refusal> {
    let limit = format!("beyond the speed limit of this session, {limit_rpm} r/min");
    match fastest(command, gears) {
        // A speed that is not a number is not within the limit.
        Speed::Rpm(rpm) if rpm.abs() <= limit_rpm => Ok(()),
        Speed::Rpm(rpm) => {
            Err((TOO_FAST, format!("{:.1} r/min is {limit}: use a lower speed, or raise the limit", rpm.abs())))
        }
        Speed::AsSet => Err((TOO_FAST, format!("the speed set in the drive may be {limit}: give a speed"))),
        Speed::UsualToMeasure => Err((TOO_FAST, format!("the usual speed may be {limit}: give a speed"))),
        Speed::UpToTheLoad => Err((
            TOO_FAST,
            format!("with a current the speed depends on the load and may be {limit}: remove the limit first"),
        )),
        Speed::OfAnUnknownFeed => {
            Err((TOO_FAST, format!("the drive has no feed constant, and its speed may be {limit}: give it in r/min")))
        }
        Speed::None => Ok(()),
    }
}

fn fastest(command: &Command, gears: &Gears) -> Speed {
    match command {
        Command::Session(_) | Command::World(_) => Speed::None,
        Command::Node(_, NodeCommand::Jog { rpm }) => Speed::Rpm(*rpm),
        Command::Node(node, NodeCommand::Drive(drive::Command::Motion(motion))) => {
            of_motion(motion, gears.get(node).and_then(|gear| gear.feed_m()))
        }
        Command::Node(_, NodeCommand::Capture(CaptureCommand::TestMotion(TestMotionOrder { motion, .. }))) => {
            Speed::Rpm(if motion.shape == ShapeName::Steps { motion.speed_rpm } else { motion.velocity_rpm })
        }
        // Without a speed it is that which is usual for the model. Gains are tried as fast as they were measured.
        Command::Node(_, NodeCommand::Tune(TuneCommand::Tune(order))) => {
            order.speed_rpm.map_or(Speed::UsualToMeasure, Speed::Rpm)
        }
        Command::Node(..) => Speed::None,
        Command::Group(command) => of_group(command),
    }
}

/// Of a drive whose output moves something by `feed_m` with each turn.
fn of_motion(motion: &Motion, feed_m: Option<f64>) -> Speed {
    let of = |speed: &Along<Rpm>| match speed {
        Along::Turning(Rpm(rpm)) => Speed::Rpm(*rpm),
        Along::Metres(metres_s) => feed_m.map_or(Speed::OfAnUnknownFeed, |feed_m| Speed::Rpm(metres_s / feed_m * 60.0)),
    };
    match motion {
        Motion::Velocity(speed, _) => of(speed),
        Motion::Move { speed, .. } | Motion::Home { speed, .. } => speed.as_ref().map_or(Speed::AsSet, of),
        Motion::Torque(_) => Speed::UpToTheLoad,
    }
}

fn of_group(command: &GroupCommand) -> Speed {
    match command {
        GroupCommand::GroupMove(group) => {
            Speed::Rpm(group.rpm.unwrap_or(AxisLimits::careful().velocity_turns_s * 60.0))
        }
        GroupCommand::GroupJog { axes, .. } => Speed::Rpm(axes.iter().map(|axis| axis.rpm).fold(0.0, faster)),
        GroupCommand::BaseJog(BaseJog { turns, wheel_radius_m, most_m_s, .. }) => {
            // No later twist is faster: these are the limits of the base.
            let wheel_rpm = most_m_s / (TAU * wheel_radius_m) * 60.0;
            Speed::Rpm(turns.iter().map(|turns| turns * wheel_rpm).fold(0.0, faster))
        }
        GroupCommand::BaseTwist { .. } | GroupCommand::GroupHold {} | GroupCommand::GroupEnd {} => Speed::None,
    }
}

/// The larger of two amounts, NaN if one of them is.
fn faster(one: f64, other: f64) -> f64 {
    if one.is_nan() || one.abs() > other.abs() { one } else { other }
}
