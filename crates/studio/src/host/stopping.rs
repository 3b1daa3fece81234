//! What stops drives: a press of stop, a dead man, a session that has gone.

use std::collections::BTreeSet;
use std::time::Duration;

use can::Instant;
use canopen::{Mux, NodeId};
use cia402::PowerCommand;

use super::known_node::has_power;
use super::state::Host;
use super::work::{Asked, STOPPING, quietly};
use crate::snapshot::DriveView;

/// Presses of stop that come within this time are told as one.
const SAME_PRESS: Duration = Duration::from_secs(1);

/// A shaft that turns more slowly is taken to rest, in r/min.
const RESTING_RPM: f64 = 1.0;

/// Looks in a row in which it has to: one may meet a shaft that turns round.
const RESTING_LOOKS: u32 = 2;

const CONTROLWORD: Mux = Mux::new(0x6040, 0);

impl Host {
    /// Quick-stops every drive of the bus that may move, whoever moves it.
    pub(super) fn stop_everything(&mut self, why: &'static str) {
        let enabled = self.nodes.iter().filter(|(_, node)| node.may_move()).map(|(id, _)| *id);
        let nodes: BTreeSet<_> = enabled.chain(self.in_motion()).collect();
        self.quick_stop(nodes, why);
    }

    /// Quick-stops what this studio has set in motion.
    pub(super) fn stop_moved(&mut self, why: &'static str) {
        let nodes = self.in_motion();
        self.quick_stop(nodes, why);
    }

    /// Quick-stops whatever nobody holds any more.
    pub(super) fn stop_what_is_not_held(&mut self, now: Instant) {
        let let_go = self.jogs.iter().filter(|(_, held)| held.has_lapsed(now)).map(|(node, _)| *node);
        let let_go: BTreeSet<_> = let_go.collect();
        if !let_go.is_empty() {
            self.quick_stop(let_go, "the jog was not renewed in time");
        }
        let group = self.let_go_group(now);
        if !group.is_empty() {
            self.quick_stop(group.into_iter().collect(), "the group was not held in time");
        }
        if self.presence.is_some_and(|presence| presence.has_lapsed(now)) {
            self.presence = None;
            self.stop_moved("nothing was heard of the page that moved it");
        }
        if self.presence.is_none() {
            // A stop that failed, of a drive that did not answer, is tried again for as long as nobody has it in hand.
            let left = self.network.moved().iter().filter(|node| !self.running.contains_key(node)).collect::<Vec<_>>();
            left.into_iter().for_each(|node| self.quick_stop_one(node, "", None));
        }
    }

    /// Quick-stops these nodes. What was asked of them before is not gone on with.
    pub(super) fn quick_stop(&mut self, nodes: BTreeSet<NodeId>, why: &'static str) {
        // Where all that moves is to stop, that is sent first, in one go and without a question before. Whether each stands is
        // looked at below.
        let moved = self.network.moved();
        if !moved.is_empty() && moved.iter().all(|node| nodes.contains(&node)) {
            self.network.quick_stop_moved();
        }
        for id in nodes {
            self.tell_stop(id, why);
            self.quick_stop_one(id, why, None);
        }
    }

    /// Tells that a node is stopped, once for a press that comes by two ways, or by several fingers.
    fn tell_stop(&mut self, id: NodeId, why: &'static str) {
        let now = self.network.now();
        let before = self.stops_told.insert(id, (now, why));
        if before.is_none_or(|(told_at, of)| of != why || now - told_at >= SAME_PRESS) {
            self.say_news(Some(id), why);
            self.note_stop(id, why);
        }
    }

    /// Quick-stops a node, and answers whoever asked for it when it stands still.
    pub(super) fn quick_stop_one(&mut self, id: NodeId, why: &str, answer: Option<Asked>) {
        self.jogs.remove(&id);
        if let Some(before) = self.running.remove(&id) {
            before.cut_short("stopped", why);
        }
        for other in self.leave_group(id) {
            self.quick_stop_one(other, why, None);
        }
        let node = self.network.node(id).with_timeout(self.setting.timeout);
        let drive = self.nodes.get(&id).and_then(|node| node.drive.clone());
        self.begin(id, STOPPING, false, answer, async move {
            match drive {
                Some(drive) => quietly(drive.quick_stop().await),
                None => quietly(node.write(CONTROLWORD, PowerCommand::QuickStop.controlword().0).await),
            }
        });
    }

    /// A drive whose stop was not seen was looked at.
    pub(super) fn look_for_rest(&mut self, id: NodeId, look: Option<&DriveView>) {
        let Some(looks) = self.unseen_stops.get_mut(&id) else { return };
        *looks = if look.is_some_and(rests) { *looks + 1 } else { 0 };
        if *looks == RESTING_LOOKS {
            self.unseen_stops.remove(&id);
            self.say_news(Some(id), "it was seen to stand");
        } else if *looks == 0 && look.is_some() && !self.running.contains_key(&id) {
            // It answers again and turns: what it missed is said anew.
            self.quick_stop_one(id, "", None);
        }
    }

    /// The nodes that this studio has set in motion, or is about to.
    fn in_motion(&self) -> BTreeSet<NodeId> {
        let begun = self.running.iter().filter(|(_, running)| running.moves).map(|(node, _)| *node);
        self.network.moved().iter().chain(begun).chain(self.jogs.keys().copied()).collect()
    }
}

/// By its speed; of a drive that does not show it, by its power stage.
fn rests(look: &DriveView) -> bool {
    look.velocity_rpm.map_or_else(|| !has_power(look.state), |rpm| rpm.abs() < RESTING_RPM)
}
