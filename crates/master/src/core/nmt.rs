use std::time::Duration;

use can::Instant;
use canopen::nmt::{NmtRequest, NmtTarget};
use canopen::{NmtCommand, NodeId};

use super::Core;
use super::event::Event;
use super::facts::HeartbeatWatch;

/// NMT commands, and the watch over the heartbeats that show their effect.
impl Core {
    pub(super) fn send_nmt(&mut self, target: NmtTarget, command: NmtCommand) {
        let now = self.now;
        for node in NodeId::all().filter(|node| target.includes(*node)) {
            let facts = &mut self.member_mut(node).facts;
            facts.nmt_sent = Some((now, command));
            facts.heartbeats.commanded();
        }
        self.push_frame(NmtRequest::new(command, target).emit());
    }

    pub(super) fn watch_heartbeat(&mut self, node: NodeId, time: Option<Duration>) {
        let facts = &mut self.member_mut(node).facts;
        facts.heartbeat_watch = time.map(|time| HeartbeatWatch { time, deadline: None, lost: false });
        match time {
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
                self.events.push(Event::HeartbeatLost(node, watch.time), now);
            }
            if let Some(deadline) = watch.deadline {
                self.heartbeat_check = self.heartbeat_check.min(deadline);
            }
        }
    }
}
