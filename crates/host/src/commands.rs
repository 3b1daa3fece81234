//! The commands of a page, one by one: permission, effect on the drive, and answer.

use can::Instant;
use canopen::NodeId;
use master::drive::{self, Manner, Motion, MotionReport, Note, Report};
use master::explain::{Finding, Overheard, Weight};
use master::units::Rpm;
use master::{Drive, Error};
use serde_json::json;
use tokio::sync::oneshot;

use crate::answer::Answer;
use crate::command::{Command, NodeCommand, SessionCommand, WorldCommand};
use crate::motion::guarding::{UNGUARDED, guard};
use crate::parameters::STORING;
use crate::session::DeadMan;
use crate::session::authority::{Refusal, SessionId};
use crate::state::{Host, JOG_SPAN, PRESENCE_SPAN};
use crate::work::{Asked, Done, LISTENING_TIME, LineOf, Listening, Outcome, Running, STOPPING, refusal_of, send};
use crate::world::conclude_looking_around;

/// Explanations that may be under way.
const MOST_LISTENING: usize = 32;

impl Host {
    /// Executes a command of a session, or starts it.
    pub(crate) fn take_command(
        &mut self,
        session: SessionId,
        seq: u64,
        command: Command,
        answer: oneshot::Sender<Answer>,
    ) {
        if let Err((kind, text)) = self.allow(session, &command) {
            return send(answer, Answer::failed(Some(seq), kind, text));
        }
        let asked = (seq, answer);
        match command {
            Command::Session(command) => self.take_session(session, command, asked),
            Command::World(WorldCommand::WorldForms {}) => self.send_world_forms(asked),
            Command::World(WorldCommand::LookAround { after }) => self.look_around(after, asked),
            Command::World(WorldCommand::ChangeWorld { line }) => self.change_world(line, asked),
            Command::Group(command) => self.take_group(command, asked),
            Command::Node(node, command) => self.take_node(node, command, asked),
        }
    }

    /// Whether a session may command this: what needs control, and its speed limit.
    pub(crate) fn allow(&self, session: SessionId, command: &Command) -> Result<(), (&'static str, String)> {
        if command.needs_control() {
            self.authority.may_move(session).map_err(|refusal| (refusal.kind(), refusal.to_string()))?;
        }
        self.within_speed_limit(session, command)
    }

    fn take_session(&mut self, session: SessionId, command: SessionCommand, asked: Asked) {
        match command {
            // The stop itself came by its own channel, past everything that waits here.
            SessionCommand::Alive {} | SessionCommand::StopAll {} => done(asked),
            SessionCommand::TakeControl {} => {
                let taken = self.authority.take(session);
                self.change_control(asked, taken);
            }
            SessionCommand::AskControl {} => settle(asked, self.authority.ask(session)),
            SessionCommand::HandOver { to } => {
                let handed = self.authority.hand_over(session, SessionId(to));
                self.change_control(asked, handed);
            }
            SessionCommand::ReleaseControl {} => {
                let released = self.authority.release(session).then_some(()).ok_or(Refusal::NothingToGive);
                self.change_control(asked, released);
            }
            SessionCommand::LimitSpeed { rpm } => self.limit_speed(session, rpm, asked),
            SessionCommand::Scan {} => self.begin_scan(Some(asked)),
            SessionCommand::SendFrame { frame } => self.send_frame(session, &frame, asked),
            SessionCommand::Console { line } => self.take_line(session, &line, asked),
            SessionCommand::Help { node, topic, name } => {
                self.help(node, topic, &name, asked);
            }
        }
    }

    pub(crate) fn take_node(&mut self, node: NodeId, command: NodeCommand, asked: Asked) {
        match command {
            NodeCommand::Explain => self.listen_for(node, asked),
            NodeCommand::Homing => self.look_at_homing(node, asked),
            NodeCommand::Drive(drive::Command::QuickStop) => {
                self.note_stop(node, "stopped by a quick stop");
                self.quick_stop_one(node, "stopped by a quick stop", Some(asked));
            }
            NodeCommand::JogHold => self.hold_jog(node, asked),
            NodeCommand::JogEnd => self.end_jog(node, asked),
            NodeCommand::AcceptUnguarded => self.accept_unguarded(node, asked),
            NodeCommand::Objects => self.list_objects(node, asked),
            NodeCommand::Read(reading) => self.read_parameters(node, reading, asked),
            NodeCommand::Change(change) => self.change_parameters(node, change, asked),
            NodeCommand::Pdos(command) => self.take_pdos(node, command, asked),
            NodeCommand::Capture(command) => self.take_capture(node, command, asked),
            NodeCommand::Tune(command) => self.take_tune(node, command, asked),
            NodeCommand::Jog { rpm } => self.take_jog(node, rpm, asked),
            NodeCommand::Drive(command) => self.take_motion(node, command, asked),
        }
    }

    /// Turns a drive as long as it is held.
    fn take_jog(&mut self, id: NodeId, rpm: f64, asked: Asked) {
        let Some((drive, asked)) = self.drive_to_move(id, false, asked) else { return };
        // Held from its start: a jog that is released while the drive is being enabled never turns.
        self.jogs.insert(id, DeadMan::new(JOG_SPAN, self.network.now()));
        let turn = Motion::Velocity(Rpm(rpm).into(), Manner { wait: false, ..Manner::default() });
        let accepted = self.accepted.contains(&id);
        self.begin(id, "jogging", true, Some(asked), perform(drive, accepted, turn.into()));
    }

    /// Starts a command of a drive.
    fn take_motion(&mut self, id: NodeId, command: drive::Command, asked: Asked) {
        use drive::Command;
        let stops = matches!(command, Command::Stop | Command::Disable);
        // A test motion ends without power, whatever stops it.
        if stops && self.is_tested(id) {
            return self.quick_stop_one(id, "stopped", Some(asked));
        }
        let Some((drive, asked)) = self.drive_to_move(id, stops, asked) else { return };
        if let Err(error) = check(&drive, &command) {
            let (seq, answer) = asked;
            return send(answer, Answer::failed(Some(seq), error.kind(), error.to_string()));
        }
        // These do not change the motion: a jog continues, and so does its dead man.
        if !matches!(command, Command::Enable | Command::ResetFault) {
            self.jogs.remove(&id);
        }
        let (what, moves) = doing(&command);
        let accepted = self.accepted.contains(&id);
        self.begin(id, what, moves, Some(asked), perform(drive, accepted, command));
    }

    /// The drive of a node, if it may get a command now; else the refusal is sent.
    pub(crate) fn drive_to_move(&self, id: NodeId, stops: bool, (seq, answer): Asked) -> Option<(Drive, Asked)> {
        let refusal = match self.nodes.get(&id).and_then(|node| node.drive.clone()) {
            None => ("no_such_drive", "no drive is known at this node: scan the bus, and check its supply"),
            // Nothing moves with half a set of parameters.
            Some(_) if self.parameters.is_writing(id) => {
                ("busy", "its parameters are being written: try again afterwards")
            }
            Some(_) if !stops && self.is_in_group(id) => {
                ("busy", "it belongs to a group that is moving: stop the group first")
            }
            Some(_) if !stops && self.is_tested(id) => {
                ("busy", "it makes a test motion, or is being measured: wait for its end, or stop it first")
            }
            Some(drive) => return Some((drive, (seq, answer))),
        };
        send(answer, Answer::failed(Some(seq), refusal.0, refusal.1));
        None
    }

    /// Starts a command on a node, replacing the one under way there.
    pub(crate) fn begin(
        &mut self,
        node: NodeId,
        what: &'static str,
        moves: bool,
        asked: Option<Asked>,
        command: impl Future<Output = Outcome> + 'static,
    ) {
        // A drive that continues alone leaves the others of its group without set-points.
        let others = self.leave_group(node);
        if what != STOPPING {
            self.leave_lines(LineOf::Stop(node));
        }
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
            Some(drive) => {
                let stop = perform(drive, true, drive::Command::Stop);
                self.begin(node, "stopping", true, Some(asked), stop);
            }
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
                self.tuned.clear();
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
    pub(crate) fn explain_what_was_heard(&mut self, now: Instant) {
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
    pub(crate) fn finish(&mut self, done: Done) {
        match done {
            Done::Read(node, read) => self.take_in(node, read),
            Done::Scanned(found, asked) => {
                self.take_scan(found);
                asked.into_iter().for_each(self::done);
            }
            Done::Looked(asked, outcome) => self.conclude_looking(asked, outcome),
            Done::Written(asked, written) => self.conclude_writing(asked, *written),
            Done::Captured(asked, ended) => self.conclude_capture(asked, *ended),
            Done::Tuned(asked, ended) => self.conclude_tuning(asked, *ended),
            Done::Learned(node, traffic) => self.conclude_learning(node, traffic),
            Done::PdosRead(asked, node, read) => self.conclude_reading_pdos(asked, node, *read),
            Done::PdosPlanned(asked, planned) => self.conclude_planning_pdos(asked, *planned),
            Done::LookedAround(asked, seen) => conclude_looking_around(asked, seen),
            Done::WorldChanged(asked, done) => self.conclude_change(asked, done),
            Done::Command(node, generation, outcome) => self.conclude(node, generation, outcome),
            Done::Line((seq, answer), said) => {
                self.lines = self.lines.saturating_sub(1);
                send(answer, said.answer(seq));
            }
            Done::Nothing => {}
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
            // It was seen at rest, or is under control again. What moves nothing (a reset, a store) has seen neither.
            Some(Ok(_)) if running.what == STOPPING || running.moves => drop(self.unseen_stops.remove(&node)),
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

/// Whether a command can be, as far as that is known without asking the drive: what is refused does not take the place of the motion
/// under way.
pub(crate) fn check(drive: &Drive, command: &drive::Command) -> Result<(), Error> {
    match command {
        drive::Command::Motion(motion) => drive.check_motion(motion),
        _ => Ok(()),
    }
}

/// What a drive is doing during a command, for people, and whether it moves and so ends with the session.
pub(crate) const fn doing(command: &drive::Command) -> (&'static str, bool) {
    use drive::Command;
    match command {
        Command::Enable => ("enabling", true),
        Command::Disable => ("disabling", true),
        Command::Stop | Command::QuickStop => (STOPPING, true),
        Command::ResetFault => ("resetting", false),
        Command::Save => (STORING, false),
        Command::Restore => ("restoring", false),
        Command::Guard(_) | Command::ReleaseGuard => ("guarding", false),
        Command::Motion(Motion::Velocity(..)) => ("turning", true),
        Command::Motion(Motion::Move { .. }) => ("moving", true),
        Command::Motion(Motion::Torque(_)) => ("pushing", true),
        Command::Motion(Motion::Home { .. }) => ("homing", true),
    }
}

/// Carries a command out; one that moves is guarded first.
async fn perform(drive: Drive, accepted: bool, command: drive::Command) -> Outcome {
    if matches!(command, drive::Command::Motion(_)) {
        guard(&drive, accepted).await?;
    }
    match drive.perform(&command).await.map_err(|error| refusal_of(&error))? {
        Report::Moved(report) => Ok(remarks(&report)),
        Report::Done | Report::Guarded(_) => Ok(Vec::new()),
    }
}

/// Remarks on a motion: rounded values, and the like. What the drive does without this program is shown
/// all the time.
fn remarks(report: &MotionReport) -> Vec<String> {
    let rounded = report.commanded.iter().filter(|commanded| commanded.is_rounded()).map(ToString::to_string);
    let notes = report.notes.iter().filter(|note| !matches!(note, Note::HostLoss(_))).map(ToString::to_string);
    rounded.chain(notes).collect()
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

pub(crate) fn done((seq, answer): Asked) {
    send(answer, Answer::done(seq, Vec::new()));
}

fn settle((seq, answer): Asked, outcome: Result<(), Refusal>) {
    send(answer, outcome.map_or_else(|refusal| refused(seq, refusal), |()| Answer::done(seq, Vec::new())));
}

fn not_held((seq, answer): Asked, node: NodeId) {
    let text = format!("node {node} is not being jogged by this page: start the jog again");
    send(answer, Answer::failed(Some(seq), "not_held", text));
}
