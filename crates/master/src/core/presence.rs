use std::time::Duration;

use can::{Frame, Instant};
use canopen::heartbeat::{Heartbeat, Producer};
use canopen::{NmtState, NodeId};

use super::node_set::NodeSet;

/// Longest heartbeat period, as 1017h has it: UNSIGNED16 of ms (CiA 301, 7.5.2.17).
const LONGEST_PERIOD_MS: u128 = u16::MAX as u128;

/// Shortest time without a frame that a node is fed after: that of the fastest heartbeat.
const SHORTEST_FEED: Duration = Duration::from_millis(1);

/// How drives notice that this master lives: by its heartbeat, or by being asked something before they lose patience.
///
/// Heartbeats lie on a grid, as SYNC does. A node that is kept fed is asked only after a time in which nothing else was
/// sent to it.
#[derive(Clone, Debug, Default)]
pub(super) struct Presence {
    /// By the node-ID that they are sent under.
    producers: Vec<(NodeId, Producer)>,
    /// Whose heartbeat is to go out.
    pending: NodeSet,
    feeds: Vec<Feed>,
    /// The nodes of `feeds`.
    fed: NodeSet,
}

#[derive(Clone, Copy, Debug)]
struct Feed {
    node: NodeId,
    period: Duration,
    due: Instant,
}

impl Presence {
    /// Starts with a first heartbeat due at once, or stops (`None` or a period below 1 ms).
    pub(super) fn set_heartbeat(&mut self, node: NodeId, period: Option<Duration>, now: Instant) {
        self.producers.retain(|(own, _)| *own != node);
        self.pending.remove(node);
        let period_ms = period.map_or(0, |period| period.as_millis().min(LONGEST_PERIOD_MS) as u16);
        if period_ms > 0 {
            self.producers.push((node, Producer::from_write(period_ms, now)));
        }
    }

    /// Starts to feed a node, or stops.
    pub(super) fn set_feed(&mut self, node: NodeId, period: Option<Duration>, now: Instant) {
        self.feeds.retain(|feed| feed.node != node);
        self.fed.remove(node);
        if let Some(period) = period.filter(|period| !period.is_zero()) {
            let period = period.max(SHORTEST_FEED);
            self.feeds.push(Feed { node, period, due: now + period });
            self.fed.insert(node);
        }
    }

    /// Something was sent to a node.
    #[inline]
    pub(super) fn note_sent(&mut self, node: NodeId, now: Instant) {
        if self.fed.contains(node) {
            self.feeds.iter_mut().filter(|feed| feed.node == node).for_each(|feed| feed.due = now + feed.period);
        }
    }

    /// Heartbeats that are due wait to be sent; the nodes that want to be asked something, with how long they can wait.
    pub(super) fn handle_timeout(&mut self, now: Instant) -> Vec<(NodeId, Duration)> {
        for (node, producer) in &mut self.producers {
            if producer.handle_timeout(now) {
                self.pending.insert(*node);
            }
        }
        let hungry = self.feeds.iter_mut().filter(|feed| feed.due <= now);
        hungry
            .map(|feed| {
                feed.due = now + feed.period;
                (feed.node, feed.period)
            })
            .collect()
    }

    pub(super) fn poll_transmit(&mut self) -> Option<Frame> {
        let node = self.pending.first()?;
        self.pending.remove(node);
        Some(Heartbeat { node, state: NmtState::Operational.heartbeat_byte() }.emit())
    }

    pub(super) fn next(&self) -> Option<Instant> {
        let heartbeats = self.producers.iter().map(|(_, producer)| producer.deadline());
        heartbeats.chain(self.feeds.iter().map(|feed| feed.due)).min()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HOST: NodeId = NodeId::MAX;

    fn ms(at: u64) -> Instant {
        Instant::from_millis(at)
    }

    #[test]
    fn a_heartbeat_goes_out_at_once_and_then_on_its_grid() {
        let mut presence = Presence::default();
        presence.set_heartbeat(HOST, Some(Duration::from_millis(500)), ms(100));
        assert_eq!(presence.next(), Some(ms(100)));
        presence.handle_timeout(ms(100));
        // CiA 301, 7.2.8.3.2.1: 700h + node-ID, operational is 05h.
        assert_eq!(presence.poll_transmit().map(|frame| frame.to_string()).as_deref(), Some("77F#05"));
        assert_eq!((presence.poll_transmit(), presence.next()), (None, Some(ms(600))));
        presence.handle_timeout(ms(1750));
        assert!(presence.poll_transmit().is_some() && presence.poll_transmit().is_none());
        assert_eq!(presence.next(), Some(ms(2100)));
        presence.set_heartbeat(HOST, None, ms(1760));
        assert_eq!((presence.next(), presence.poll_transmit()), (None, None));
    }

    #[test]
    fn a_node_is_fed_only_when_nothing_else_was_sent_to_it() {
        let mut presence = Presence::default();
        presence.set_feed(HOST, Some(Duration::from_millis(300)), ms(0));
        presence.note_sent(HOST, ms(200));
        assert_eq!(presence.next(), Some(ms(500)));
        assert_eq!(presence.handle_timeout(ms(499)), []);
        assert_eq!(presence.handle_timeout(ms(500)), [(HOST, Duration::from_millis(300))]);
        assert_eq!(presence.next(), Some(ms(800)));
        presence.set_feed(HOST, None, ms(600));
        assert_eq!(presence.next(), None);
    }
}
