//! The commands of a page, one by one: permission, effect on the drive, and answer.

use can::Instant;
use canopen::NodeId;
use master::drive::{HomingOptions, MotionReport, Note};
use master::explain::{Finding, Overheard, Weight};
use master::units::{Amperes, Angle, Ramp, Rpm};
use master::{Drive, Error, MotionOptions};
use serde_json::json;
use tokio::sync::oneshot;

use super::guarding::{UNGUARDED, guard};
use super::parameters::STORING;
use super::state::{Host, JOG_SPAN, PRESENCE_SPAN};
use super::work::{Asked, Done, LISTENING_TIME, Listening, Outcome, Running, STOPPING, quietly, refusal_of, send};
use super::world::conclude_looking_around;
use crate::authority::{Refusal, SessionId};
use crate::dead_man::DeadMan;
use crate::message::{Answer, Command};

/// Explanations that may be under way.
const MOST_LISTENING: usize = 32;

impl Host {
    /// Executes a command of a session, or starts it.
    pub(super) fn take_command(
        &mut self,
        session: SessionId,
        seq: u64,
        command: Command,
        answer: oneshot::Sender<Answer>,
    ) {
        if command.needs_control()
            && let Err(refusal) = self.authority.may_move(session)
        {
            return send(answer, refused(seq, refusal));
        }
        if let Err((kind, text)) = self.within_speed_limit(session, &command) {
            return send(answer, Answer::failed(Some(seq), kind, text));
        }
        let asked = (seq, answer);
        match command {
            // The stop itself came by its own channel, past everything that waits here.
            Command::Alive {} | Command::StopAll {} => done(asked),
            Command::TakeControl {} => {
                let taken = self.authority.take(session);
                self.change_control(asked, taken);
            }
            Command::AskControl {} => settle(asked, self.authority.ask(session)),
            Command::HandOver { to } => {
                let handed = self.authority.hand_over(session, SessionId(to));
                self.change_control(asked, handed);
            }
            Command::ReleaseControl {} => {
                let released = self.authority.release(session).then_some(()).ok_or(Refusal::NothingToGive);
                self.change_control(asked, released);
            }
            Command::LimitSpeed { rpm } => self.limit_speed(session, rpm, asked),
            Command::Scan {} => self.begin_scan(Some(asked)),
            Command::WorldForms {} => self.send_world_forms(asked),
            Command::LookAround { after } => self.look_around(after, asked),
            Command::ChangeWorld { line } => self.change_world(line, asked),
            Command::Explain { node } => self.listen_for(node, asked),
            Command::GroupMove(_)
            | Command::GroupJog { .. }
            | Command::BaseJog(_)
            | Command::BaseTwist { .. }
            | Command::GroupHold {}
            | Command::GroupEnd {} => self.take_group(command, asked),
            Command::Help { node, topic, name } => self.help(node.and_then(NodeId::new), topic, &name, asked),
            Command::Homing { node } => self.look_at_homing(node, asked),
            Command::QuickStop { node } => {
                self.note_stop(node, "stopped by a quick stop");
                self.quick_stop_one(node, "stopped by a quick stop", Some(asked));
            }
            Command::JogHold { node } => self.hold_jog(node, asked),
            Command::JogEnd { node } => self.end_jog(node, asked),
            Command::AcceptUnguarded { node } => self.accept_unguarded(node, asked),
            Command::Objects { .. }
            | Command::ReadObjects { .. }
            | Command::PlanParameters { .. }
            | Command::CompareParameters { .. }
            | Command::WriteParameters { .. }
            | Command::RollBack { .. }
            | Command::Store { .. }
            | Command::BackUp { .. } => self.take_parameters(command, asked),
            Command::Pdos { .. } | Command::PlanPdos { .. } | Command::WritePdos { .. } | Command::Nmt { .. } => {
                self.take_pdos(command, asked);
            }
            _ => self.take_motion(command, asked),
        }
    }

    /// Starts a command of a drive.
    fn take_motion(&mut self, command: Command, asked: Asked) {
        let Some((id, drive)) = subject(&command).and_then(|id| Some((id, self.nodes.get(&id)?.drive.clone()?))) else {
            let (seq, answer) = asked;
            let text = "no drive is known at this node: scan the bus, and check its supply";
            return send(answer, Answer::failed(Some(seq), "no_such_drive", text));
        };
        if self.parameters.is_writing(id) {
            // Nothing moves with half a set of parameters.
            let (seq, answer) = asked;
            let text = "its parameters are being written: try again afterwards";
            return send(answer, Answer::failed(Some(seq), "busy", text));
        }
        let stops = matches!(command, Command::Stop { .. } | Command::Disable { .. });
        if !stops && self.is_in_group(id) {
            let (seq, answer) = asked;
            let text = "it belongs to a group that is moving: stop the group first";
            return send(answer, Answer::failed(Some(seq), "busy", text));
        }
        match command {
            // Held from its start: a jog that is released while the drive is being enabled never turns.
            Command::Jog { .. } => drop(self.jogs.insert(id, DeadMan::new(JOG_SPAN, self.network.now()))),
            // These do not change the motion: a jog continues, and so does its dead man.
            Command::Enable { .. } | Command::ResetFault { .. } => {}
            _ => drop(self.jogs.remove(&id)),
        }
        let (asked, accepted) = (Some(asked), self.accepted.contains(&id));
        match command {
            Command::Enable { .. } => self.begin(id, "enabling", true, asked, enable(drive)),
            Command::Disable { .. } => {
                self.begin(id, "disabling", true, asked, async move { quietly(drive.disable().await) });
            }
            Command::ResetFault { .. } => {
                self.begin(id, "resetting", false, asked, async move { quietly(drive.reset_fault().await) });
            }
            Command::Stop { .. } => self.begin(id, "stopping", true, asked, stop(drive)),
            Command::Jog { rpm, .. } => {
                let options = MotionOptions { wait: false, ..MotionOptions::default() };
                self.begin(id, "jogging", true, asked, turn(drive, accepted, rpm, options));
            }
            Command::Velocity { rpm, rpm_per_s, .. } => {
                let ramp = rpm_per_s.map(Ramp::RpmPerSecond);
                let options = MotionOptions { acceleration: ramp, deceleration: ramp, ..MotionOptions::default() };
                self.begin(id, "turning", true, asked, turn(drive, accepted, rpm, options));
            }
            Command::Move { degrees, relative, rpm, .. } => {
                self.begin(id, "moving", true, asked, position(drive, accepted, degrees, relative, rpm));
            }
            Command::Torque { amperes, .. } => {
                self.begin(id, "pushing", true, asked, async move {
                    guard(&drive, accepted).await?;
                    motion_outcome(drive.torque(Amperes(amperes)).await)
                });
            }
            Command::Home { method, rpm, .. } => {
                self.begin(id, "homing", true, asked, home(drive, accepted, method, rpm));
            }
            // The others concern no drive, or are done.
            _ => {}
        }
    }

    /// Starts a command on a node, replacing the one under way there.
    pub(super) fn begin(
        &mut self,
        node: NodeId,
        what: &'static str,
        moves: bool,
        asked: Option<Asked>,
        command: impl Future<Output = Outcome> + 'static,
    ) {
        // A drive that continues alone leaves the others of its group without set-points.
        let others = self.leave_group(node);
        self.generation += 1;
        let (running, future) = Running::new(node, self.generation, what, moves, asked, command);
        if let Some(before) = self.running.insert(node, running) {
            before.cut_short("replaced", "replaced by another command to the drive");
        }
        self.work.push(future);
        for other in others {
            self.quick_stop_one(other, "another drive of its group got another command", None);
        }
    }

    fn hold_jog(&mut self, node: NodeId, asked: Asked) {
        let now = self.network.now();
        match self.jogs.get_mut(&node).is_some_and(|held| held.renew(now)) {
            true => done(asked),
            false => not_held(asked, node),
        }
    }

    fn end_jog(&mut self, node: NodeId, asked: Asked) {
        let drive = self.nodes.get(&node).and_then(|node| node.drive.clone());
        match drive.filter(|_| self.jogs.remove(&node).is_some()) {
            Some(drive) => self.begin(node, "stopping", true, Some(asked), stop(drive)),
            None => not_held(asked, node),
        }
    }

    /// Control changes hands or is released: what the previous session has moved stops.
    fn change_control(&mut self, asked: Asked, change: Result<(), Refusal>) {
        if change.is_ok() {
            let controller = self.authority.controller();
            if controller != self.held_by {
                self.stop_moved("control changed hands");
                self.held_by = controller;
                // The new session has not commanded anything yet.
                self.accepted.clear();
            }
            self.presence = controller.map(|_| DeadMan::new(PRESENCE_SPAN, self.network.now()));
        }
        settle(asked, change);
    }

    fn listen_for(&mut self, node: NodeId, (seq, answer): Asked) {
        if self.listening.len() == MOST_LISTENING {
            return send(answer, Answer::failed(Some(seq), "busy", "too many explanations are under way: try again"));
        }
        let now = self.network.now();
        let heard = Overheard::from(now);
        self.listening.push(Listening { node, until: now + LISTENING_TIME, heard, seq, answer });
    }

    /// Examines the drives to which the explanation has listened long enough.
    pub(super) fn explain_what_was_heard(&mut self, now: Instant) {
        let ready: Vec<Listening> = self.listening.extract_if(.., |listening| listening.until <= now).collect();
        for listening in ready {
            let Listening { node, mut heard, seq, answer, .. } = listening;
            heard.until(now);
            let drive = self.drive_or_unknown(node);
            self.work.push(Box::pin(async move {
                let explained = drive.explain(&heard).await;
                Done::Explained(seq, answer, Box::new(explained))
            }));
        }
    }

    /// Handles work that has ended.
    pub(super) fn finish(&mut self, done: Done) {
        match done {
            Done::Read(node, read) => self.take_in(node, read),
            Done::Scanned(found, asked) => {
                self.take_scan(found);
                asked.into_iter().for_each(self::done);
            }
            Done::Looked(asked, outcome) => self.conclude_looking(asked, outcome),
            Done::Written(asked, written) => self.conclude_writing(asked, *written),
            Done::Learned(node, traffic) => self.conclude_learning(node, traffic),
            Done::PdosRead(asked, node, read) => self.conclude_reading_pdos(asked, node, *read),
            Done::PdosPlanned(asked, planned) => self.conclude_planning_pdos(asked, *planned),
            Done::LookedAround(asked, seen) => conclude_looking_around(asked, seen),
            Done::WorldChanged(asked, done) => self.conclude_change(asked, done),
            Done::Command(node, generation, outcome) => self.conclude(node, generation, outcome),
            Done::Group(generation, outcome) => self.conclude_group(generation, outcome),
            Done::Explained(seq, answer, explained) => {
                let findings: Vec<_> = explained.findings.iter().map(shown).collect();
                send(answer, Answer::known(seq, json!({ "node": explained.node.raw(), "findings": findings })));
            }
        }
    }

    fn conclude(&mut self, node: NodeId, generation: u64, outcome: Option<Outcome>) {
        if self.running.get(&node).is_none_or(|running| running.generation != generation) {
            // The drive has got another command since.
            return;
        }
        let Some(running) = self.running.remove(&node) else { return };
        match &outcome {
            // It follows commands: it is at rest, or under control again.
            Some(Ok(_)) => drop(self.unseen_stops.remove(&node)),
            Some(Err(_)) if running.what == STOPPING => drop(self.unseen_stops.insert(node, 0)),
            _ => {}
        }
        match outcome {
            Some(Ok(notes)) if running.what == STORING => {
                self.parameters.note_stored(node);
                running.reply(|seq| Answer::done(seq, notes));
            }
            Some(Ok(notes)) => running.reply(|seq| Answer::done(seq, notes)),
            Some(Err((kind, text))) => {
                let text = if running.what == STOPPING { format!("it may still be moving: {text}") } else { text };
                if kind == UNGUARDED {
                    // A request for acceptance is not news to the others, and nothing has started that would have to be stopped.
                    self.jogs.remove(&node);
                } else {
                    self.send_news(Some(node), &text);
                }
                let moves = running.moves;
                running.reply(|seq| Answer::failed(Some(seq), kind, text));
                // The failure may have left it turning.
                if moves && (self.jogs.contains_key(&node) || self.network.moved().contains(node)) {
                    self.quick_stop_one(node, "", None);
                }
            }
            None => {}
        }
    }
}

/// The node of a command.
const fn subject(command: &Command) -> Option<NodeId> {
    match command {
        Command::Enable { node }
        | Command::Disable { node }
        | Command::ResetFault { node }
        | Command::Stop { node }
        | Command::Jog { node, .. }
        | Command::Velocity { node, .. }
        | Command::Move { node, .. }
        | Command::Torque { node, .. }
        | Command::Home { node, .. } => Some(*node),
        _ => None,
    }
}

async fn enable(drive: Drive) -> Outcome {
    quietly(drive.enable().await)
}

async fn stop(drive: Drive) -> Outcome {
    quietly(drive.stop().await)
}

async fn turn(drive: Drive, accepted: bool, rpm: f64, options: MotionOptions) -> Outcome {
    guard(&drive, accepted).await?;
    motion_outcome(drive.velocity(Rpm(rpm), options).await)
}

async fn position(drive: Drive, accepted: bool, degrees: f64, relative: bool, rpm: Option<f64>) -> Outcome {
    guard(&drive, accepted).await?;
    let options = MotionOptions { speed: rpm.map(Rpm), ..MotionOptions::default() };
    let angle = Angle::Turns(degrees / 360.0);
    motion_outcome(match relative {
        true => drive.move_relative(angle, options).await,
        false => drive.move_absolute(angle, options).await,
    })
}

async fn home(drive: Drive, accepted: bool, method: i8, rpm: Option<f64>) -> Outcome {
    guard(&drive, accepted).await?;
    let options = HomingOptions { speed: rpm.map(Rpm), ..HomingOptions::default() };
    motion_outcome(drive.home(method, options).await)
}

/// Remarks on a motion: rounded values, and the like. What the drive does without this program is shown
/// all the time.
fn motion_outcome(moved: Result<MotionReport, Error>) -> Outcome {
    let report = moved.map_err(|error| refusal_of(&error))?;
    let rounded = report.commanded.iter().filter(|commanded| commanded.is_rounded()).map(ToString::to_string);
    let notes = report.notes.iter().filter(|note| !matches!(note, Note::HostLoss(_))).map(ToString::to_string);
    Ok(rounded.chain(notes).collect())
}

fn shown(finding: &Finding) -> serde_json::Value {
    json!({
        "rule": finding.rule,
        "topic": finding.topic.name(),
        "cause": finding.weight == Weight::Cause,
        "expected": finding.expected,
        "found": finding.found,
        "follows": finding.follows,
        "remedy": finding.remedy,
    })
}

fn refused(seq: u64, refusal: Refusal) -> Answer {
    Answer::failed(Some(seq), refusal.kind(), refusal.to_string())
}

pub(super) fn done((seq, answer): Asked) {
    send(answer, Answer::done(seq, Vec::new()));
}

fn settle((seq, answer): Asked, outcome: Result<(), Refusal>) {
    send(answer, outcome.map_or_else(|refusal| refused(seq, refusal), |()| Answer::done(seq, Vec::new())));
}

fn not_held((seq, answer): Asked, node: NodeId) {
    let text = format!("node {node} is not being jogged by this page: start the jog again");
    send(answer, Answer::failed(Some(seq), "not_held", text));
}
