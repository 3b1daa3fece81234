use std::time::Duration;

use can::Instant;
use canopen::nmt::{NmtRequest, NmtTarget};
use canopen::{NmtCommand, NodeId};

use super::Core;
use super::event::{Event, Silence};
use super::facts::HeartbeatWatch;

/// NMT commands, and the watch over the heartbeats that show their effect.
impl Core {
    pub(super) fn send_nmt(&mut self, target: NmtTarget, command: NmtCommand) {
        let request = NmtRequest::new(command, target);
        self.note_nmt(request);
        self.push_frame(request.emit());
    }

    /// A command that is sent, or that was heard of another master.
    pub(super) fn note_nmt(&mut self, NmtRequest { command, target }: NmtRequest) {
        let now = self.now;
        for node in NodeId::all().filter(|node| target.includes(*node)) {
            let facts = &mut self.member_mut(node).facts;
            facts.nmt_sent = Some((now, command));
            facts.heartbeats.commanded();
        }
    }

    pub(super) fn watch_heartbeat(&mut self, node: NodeId, time: Option<Duration>) {
        self.presence.set_guard(node, None, self.now);
        self.watch(node, time.map(|time| HeartbeatWatch { time, asked: false, deadline: None, lost: false }));
    }

    /// Asks the node for its state each guard time; it counts as lost when no answer has come for that times the factor.
    pub(super) fn watch_by_guarding(&mut self, node: NodeId, period: Duration, factor: u8) {
        let now = self.now;
        self.presence.set_guard(node, Some(period), now);
        let time = period.saturating_mul(factor.max(1).into());
        let deadline = Some(now + time);
        self.watch(node, Some(HeartbeatWatch { time, asked: true, deadline, lost: false }));
        self.heartbeat_check = self.heartbeat_check.min(now + time);
        self.show_presence();
    }

    fn watch(&mut self, node: NodeId, watch: Option<HeartbeatWatch>) {
        self.member_mut(node).facts.heartbeat_watch = watch;
        match watch {
            Some(_) => self.watched.insert(node),
            None => self.watched.remove(node),
        }
    }

    pub(super) fn check_heartbeats(&mut self) {
        let now = self.now;
        if self.heartbeat_check > now {
            return;
        }
        self.heartbeat_check = Instant::FAR_FUTURE;
        for node in self.watched.iter() {
            let facts = &mut self.member_mut(node).facts;
            let lost = facts.check_heartbeat(now);
            let Some(watch) = facts.heartbeat_watch else { continue };
            if lost {
                self.changed.insert(node);
                self.events.push(Event::HeartbeatLost(node, Silence { time: watch.time, asked: watch.asked }), now);
            }
            if let Some(deadline) = watch.deadline {
                self.heartbeat_check = self.heartbeat_check.min(deadline);
            }
        }
    }
}
