//! Stopping drives: by a press of stop, a dead man, or a session that has ended.

use std::collections::BTreeSet;
use std::time::Duration;

use can::Instant;
use canopen::NodeId;
use cia402::PowerCommand;
use cia402::object::CONTROLWORD;
use master::Drive;
use master::units::Rpm;

use crate::nodes::known_node::has_power;
use crate::snapshot::DriveView;
use crate::state::Host;
use crate::work::{Asked, STOPPING, quietly};

/// Presses of stop within this time are reported as one.
const SAME_PRESS: Duration = Duration::from_secs(1);

/// Consecutive readings at rest that are needed: a single one may catch a shaft that reverses.
const RESTING_LOOKS: u32 = 2;

impl Host {
    /// Quick-stops every drive of the bus that may move, including those moved by other programs.
    pub(crate) fn stop_everything(&mut self, why: &'static str) {
        self.stops += 1;
        let enabled = self.nodes.iter().filter(|(_, node)| node.may_move()).map(|(id, _)| *id);
        let nodes: BTreeSet<_> = enabled.chain(self.in_motion()).collect();
        self.quick_stop(nodes, why);
    }

    /// Quick-stops what this studio has set in motion, and ends captures: the session that began them has gone.
    pub(crate) fn stop_moved(&mut self, why: &'static str) {
        self.stops += 1;
        self.end_captures();
        let nodes = self.in_motion();
        self.quick_stop(nodes, why);
    }

    /// Quick-stops everything that is no longer held.
    pub(crate) fn stop_what_is_not_held(&mut self, now: Instant) {
        let released = self.jogs.iter().filter(|(_, held)| held.has_lapsed(now)).map(|(node, _)| *node);
        let released: BTreeSet<_> = released.collect();
        if !released.is_empty() {
            self.quick_stop(released, "the jog was not renewed in time");
        }
        let group = self.let_go_group(now);
        if !group.is_empty() {
            self.quick_stop(group.into_iter().collect(), "the group was not held in time");
        }
        if self.presence.is_some_and(|presence| presence.has_lapsed(now)) {
            self.presence = None;
            self.stop_moved("the page that moved it is silent");
        }
        if self.presence.is_none() {
            // A failed stop of a drive that did not answer is repeated as long as no new command moves it.
            let left = self.network.moved().iter().filter(|node| !self.running.contains_key(node)).collect::<Vec<_>>();
            left.into_iter().for_each(|node| self.quick_stop_one(node, "", None));
        }
    }

    /// Quick-stops these nodes, and cancels their commands.
    pub(crate) fn quick_stop(&mut self, nodes: BTreeSet<NodeId>, why: &'static str) {
        // If everything that moves has to stop, the stops are sent first, at once and without a read before. Whether each is at rest is
        // checked below.
        let moved = self.network.moved();
        if !moved.is_empty() && moved.iter().all(|node| nodes.contains(&node)) {
            self.network.quick_stop_moved();
        }
        for id in nodes {
            self.report_stop(id, why);
            self.quick_stop_one(id, why, None);
        }
    }

    /// Reports that a node is stopped, once for a press that comes by two channels, or from several pages.
    fn report_stop(&mut self, id: NodeId, why: &'static str) {
        let now = self.network.now();
        let before = self.stops_reported.insert(id, (now, why));
        if before.is_none_or(|(reported_at, of)| of != why || now - reported_at >= SAME_PRESS) {
            self.send_news(Some(id), why);
            self.note_stop(id, why);
        }
    }

    /// Quick-stops a node, and answers the request when it is at rest.
    pub(crate) fn quick_stop_one(&mut self, id: NodeId, why: &str, answer: Option<Asked>) {
        self.jogs.remove(&id);
        if let Some(before) = self.running.remove(&id) {
            before.cut_short("stopped", why);
        }
        for other in self.leave_group(id) {
            self.quick_stop_one(other, why, None);
        }
        let network = self.network.clone();
        let node = network.node(id).with_timeout(self.setting.timeout);
        let drive = self.nodes.get(&id).and_then(|node| node.drive.clone());
        self.begin(id, STOPPING, false, answer, async move {
            if network.moved().contains(id) {
                let stopped = network.stop_moved([id].into_iter().collect()).await;
                return quietly(stopped.into_iter().try_for_each(|axis| axis.outcome.map(drop)));
            }
            // Another program has moved it.
            match drive {
                Some(drive) => quietly(drive.quick_stop().await),
                None => quietly(node.write(CONTROLWORD, PowerCommand::QuickStop.controlword().0).await),
            }
        });
    }

    /// A drive whose stop was not seen was read.
    pub(crate) fn look_for_rest(&mut self, id: NodeId, look: Option<&DriveView>) {
        let Some(looks) = self.unseen_stops.get_mut(&id) else { return };
        let drive = self.nodes.get(&id).and_then(|node| node.drive.as_ref());
        *looks = if drive.zip(look).is_some_and(|(drive, look)| rests(drive, look)) { *looks + 1 } else { 0 };
        if *looks == RESTING_LOOKS {
            self.unseen_stops.remove(&id);
            self.send_news(Some(id), "it was seen at rest");
        } else if *looks == 0 && look.is_some() && !self.running.contains_key(&id) {
            // It answers again and turns: the stop that it missed is sent again.
            self.quick_stop_one(id, "", None);
        }
    }

    /// The nodes that this studio has set in motion, or is about to.
    fn in_motion(&self) -> BTreeSet<NodeId> {
        let begun = self.running.iter().filter(|(_, running)| running.moves).map(|(node, _)| *node);
        self.network.moved().iter().chain(begun).chain(self.jogs.keys().copied()).collect()
    }
}

/// By its speed, or by its power stage if the drive does not report a speed.
fn rests(drive: &Drive, look: &DriveView) -> bool {
    look.velocity_rpm.map_or_else(|| !has_power(look.state), |rpm| drive.stands_at(Rpm(rpm)))
}
