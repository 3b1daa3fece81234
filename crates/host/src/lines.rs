//! Lines of a console: what a [`Reader`](crate::console::Reader) understands is carried out as any other command of a session. Whatever
//! stops a motion of the session stops one of a line too, what needs control needs it here, and the session's speed limit holds.

use std::rc::Rc;
use std::sync::Arc;

use canopen::NodeId;
use futures_util::future::{Aborted, abortable};
use master::drive;
use tokio::sync::oneshot;

use crate::answer::Answer;
use crate::command::{Command, NodeCommand};
use crate::commands::{check, doing};
use crate::console::{Hands, Order, Said, Work};
use crate::motion::guarding::guard;
use crate::nodes::known_node::KnownNode;
use crate::session::authority::SessionId;
use crate::state::Host;
use crate::work::{Asked, Done, LineOf, OpenLine, send};

/// Lines that may be under way when one begins that only looks.
const MOST_LINES: usize = 32;

impl Host {
    /// Carries out a line of a console.
    pub(crate) fn take_line(&mut self, session: SessionId, line: &str, (seq, answer): Asked) {
        let Some(reader) = self.setting.console.clone() else {
            return send(answer, Answer::failed(Some(seq), "no_console", "this host has no console"));
        };
        let order = match reader.read(line) {
            Ok(order) => order,
            Err(said) => return send(answer, said.answer(seq)),
        };
        // A stop is never refused for what others look at.
        if order.asked.is_none() && self.lines >= MOST_LINES {
            return send(answer, Answer::failed(Some(seq), "busy", "too many lines are under way: try again"));
        }
        let allowed = order.asked.as_ref().map_or(Ok(()), |asked| self.allow(session, asked));
        if let Err((kind, text)) = allowed {
            return send(answer, Said::refused(kind, &text).answer(seq));
        }
        self.lines += 1;
        let (said, words) = oneshot::channel();
        self.begin_line(session, order, seq, said);
        self.work.push(Box::pin(async move {
            let gone = Said::refused("over", "the host is ending");
            Done::Line((seq, answer), words.await.unwrap_or(gone))
        }));
    }

    fn begin_line(&mut self, session: SessionId, order: Order, seq: u64, said: oneshot::Sender<Said>) {
        let Order { asked, work } = order;
        let hands = self.hands(session);
        let of = match &asked {
            Some(Command::Node(node, _)) => Some(LineOf::Stop(*node)),
            // One that stops everything is not given up, neither for a command to one drive nor with its session.
            Some(_) => None,
            None => Some(LineOf::Session(session)),
        };
        match asked {
            Some(Command::Node(node, NodeCommand::Drive(drive::Command::QuickStop))) => {
                // The host's own goes out now; the line's says what came of it.
                self.note_stop(node, "stopped by a quick stop");
                self.quick_stop_one(node, "stopped by a quick stop", None);
            }
            Some(Command::Node(node, NodeCommand::Drive(command))) => {
                return self.begin_line_on(node, command, (seq, said), work(hands));
            }
            Some(Command::Node(node, command)) => {
                return self.begin_line_after(node, command, (seq, said), work(hands));
            }
            Some(_) => self.stop_everything("stopped by a line of a console"),
            None => {}
        }
        let (line, abort) = abortable(work(hands));
        let alive = Rc::new(());
        if let Some(of) = of {
            self.open_lines.retain(|line| line.alive.strong_count() > 0);
            self.open_lines.push(OpenLine { of, abort, alive: Rc::downgrade(&alive) });
        }
        self.work.push(Box::pin(async move {
            let replaced = || Said::refused("replaced", "replaced by another command to the drive");
            // The session may have gone.
            let _ = said.send(line.await.unwrap_or_else(|Aborted| replaced()));
            drop(alive);
            Done::Nothing
        }));
    }

    /// Ends lines: a newer command to a drive takes the place of those that stop it, since their stop would meet that; the
    /// answers of a session that has left go nowhere.
    pub(crate) fn leave_lines(&mut self, of: LineOf) {
        self.open_lines.extract_if(.., |line| line.of == of).for_each(|line| line.abort.abort());
    }

    /// A line that commands a drive takes the place of the command under way there, and ends as one.
    fn begin_line_on(
        &mut self,
        node: NodeId,
        command: drive::Command,
        (seq, said): (u64, oneshot::Sender<Said>),
        line: Work,
    ) {
        let (answer, answered) = oneshot::channel();
        let stops = matches!(command, drive::Command::Stop | drive::Command::Disable);
        let accepted = self.accepted.contains(&node);
        let (words, worded) = oneshot::channel();
        if let Some((drive, asked)) = self.drive_to_move(node, stops, (seq, answer)) {
            if let Err(error) = check(&drive, &command) {
                let _ = said.send(Said::failed(&error.into()));
                return;
            }
            if !matches!(command, drive::Command::Enable | drive::Command::ResetFault) {
                self.jogs.remove(&node);
            }
            let (what, moves) = doing(&command);
            self.begin(node, what, moves, Some(asked), async move {
                if matches!(command, drive::Command::Motion(_)) {
                    guard(&drive, accepted).await?;
                }
                let said = line.await;
                let failed = said.trouble.clone();
                let _ = words.send(said);
                failed.map_or_else(|| Ok(Vec::new()), Err)
            });
        }
        self.work.push(Box::pin(async move {
            let outcome = answered.await;
            // What the line itself has said, or why it did not come to that: refused, stopped, replaced.
            let text = match (worded.await, outcome) {
                (Ok(text), _) => text,
                (Err(_), Ok(answer)) => answer.trouble().map_or_else(
                    || Said::refused("failed", "it ended without a word"),
                    |trouble| Said::refused(trouble.kind, &trouble.message),
                ),
                (Err(_), Err(_)) => Said::refused("over", "the host is ending"),
            };
            let _ = said.send(text);
            Done::Nothing
        }));
    }

    /// A line whose command is the host's own: what it says comes after that.
    fn begin_line_after(
        &mut self,
        node: NodeId,
        command: NodeCommand,
        (seq, said): (u64, oneshot::Sender<Said>),
        line: Work,
    ) {
        let (answer, answered) = oneshot::channel();
        self.take_node(node, command, (seq, answer));
        self.work.push(Box::pin(async move {
            let _ = said.send(match answered.await.as_ref().map(Answer::trouble) {
                Ok(None) => line.await,
                Ok(Some(trouble)) => Said::refused(trouble.kind, &trouble.message),
                Err(_) => Said::refused("over", "the host is ending"),
            });
            Done::Nothing
        }));
    }

    fn hands(&self, session: SessionId) -> Hands {
        let sure = |node: &KnownNode| {
            let drive = node.drive.as_ref().filter(|drive| drive.guess().is_none())?;
            drive.description()
        };
        let found = self.nodes.iter().filter_map(|(id, node)| Some((*id, sure(node)?)));
        Hands {
            network: self.network.clone(),
            bus: self.setting.bus.clone(),
            in_control: self.authority.controller() == Some(session),
            timeout: self.setting.timeout,
            models: found.collect(),
            gears: self.setting.gears.clone(),
            trace: Arc::clone(&self.inbox.trace),
        }
    }
}
