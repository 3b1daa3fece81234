use std::time::Duration;

use can::{Frame, Instant};
use canopen::guarding::Guard;
use canopen::heartbeat::{Heartbeat, Producer};
use canopen::{NmtState, NodeId};

use super::node_set::NodeSet;

/// Longest heartbeat period, as 1017h has it: UNSIGNED16 of ms (CiA 301, 7.5.2.17).
const LONGEST_PERIOD_MS: u128 = u16::MAX as u128;

/// Shortest time without a frame that a node is fed after: that of the fastest heartbeat.
const SHORTEST_FEED: Duration = Duration::from_millis(1);

/// How drives notice that this master lives: by its heartbeat, or by being asked something before they lose patience. And the
/// remote frames of node guarding, by which nodes without a heartbeat are watched, and watch this master (life guarding).
///
/// Heartbeats lie on a grid, as SYNC does. A node that is kept fed is asked only after a time in which nothing else was
/// sent to it. A sign of life that comes later than a drive allows (the program was frozen) would have a drive that has stopped
/// start again unasked: it is not sent, and none after it until it is asked for anew.
#[derive(Clone, Debug, Default)]
pub(super) struct Presence {
    producers: Vec<Own>,
    /// Whose heartbeat is to go out.
    pending: NodeSet,
    feeds: Vec<Feed>,
    /// The nodes of `feeds`.
    fed: NodeSet,
    guards: Vec<Guard>,
    /// The nodes of `guards`.
    guarded: NodeSet,
    /// Those that are to be asked for their state.
    asked: NodeSet,
}

/// A heartbeat of this master.
#[derive(Clone, Debug)]
struct Own {
    /// The node-ID that it is sent under.
    node: NodeId,
    /// `None` once it came too late.
    producer: Option<Producer>,
    patience: Patience,
}

#[derive(Clone, Copy, Debug)]
struct Feed {
    node: NodeId,
    period: Duration,
    due: Instant,
    patience: Patience,
}

/// How long a drive that watches this master waits for a sign of life.
#[derive(Clone, Copy, Debug)]
struct Patience {
    /// `None`: not known.
    allowed: Option<Duration>,
    last: Instant,
    /// How long it was left without one.
    lapse: Option<Duration>,
}

impl Patience {
    const fn begin(allowed: Option<Duration>, now: Instant) -> Self {
        Self { allowed, last: now, lapse: None }
    }

    /// False if a sign of life at `now` is too late.
    fn is_in_time(&mut self, now: Instant) -> bool {
        let waited = now - self.last;
        if self.lapse.is_none() && self.allowed.is_some_and(|allowed| waited >= allowed) {
            self.lapse = Some(waited);
        }
        self.lapse.is_none()
    }
}

impl Presence {
    /// Starts with a first heartbeat due at once, or stops (`None` or a period below 1 ms).
    pub(super) fn set_heartbeat(
        &mut self,
        node: NodeId,
        period: Option<Duration>,
        allowed: Option<Duration>,
        now: Instant,
    ) {
        self.producers.retain(|own| own.node != node);
        self.pending.remove(node);
        let period_ms = period.map_or(0, |period| period.as_millis().min(LONGEST_PERIOD_MS) as u16);
        if period_ms > 0 {
            let producer = Some(Producer::from_write(period_ms, now));
            self.producers.push(Own { node, producer, patience: Patience::begin(allowed, now) });
        }
    }

    /// Starts to feed a node, or stops.
    pub(super) fn set_feed(&mut self, node: NodeId, period: Option<Duration>, allowed: Option<Duration>, now: Instant) {
        self.feeds.retain(|feed| feed.node != node);
        self.fed.remove(node);
        if let Some(period) = period.filter(|period| !period.is_zero()) {
            let period = period.max(SHORTEST_FEED);
            self.feeds.push(Feed { node, period, due: now + period, patience: Patience::begin(allowed, now) });
            self.fed.insert(node);
        }
    }

    /// Starts to guard a node, with a first request at once, or stops.
    pub(super) fn set_guard(&mut self, node: NodeId, period: Option<Duration>, now: Instant) {
        self.guards.retain(|guard| guard.node() != node);
        self.guarded.remove(node);
        self.asked.remove(node);
        if let Some(period) = period {
            let period_ns = u64::try_from(period.max(SHORTEST_FEED).as_nanos()).unwrap_or(u64::MAX);
            self.guards.push(Guard::new(node, period_ns, now));
            self.guarded.insert(node);
        }
    }

    /// The guard of a node, if it is guarded.
    pub(super) fn guard(&mut self, node: NodeId) -> Option<&mut Guard> {
        if self.guarded.contains(node) { self.guards.iter_mut().find(|guard| guard.node() == node) } else { None }
    }

    /// Something was sent to a node.
    #[inline]
    pub(super) fn note_sent(&mut self, node: NodeId, now: Instant) {
        if self.fed.contains(node) {
            self.feeds.iter_mut().filter(|feed| feed.node == node).for_each(|feed| {
                if feed.patience.is_in_time(now) {
                    feed.due = now + feed.period;
                    feed.patience.last = now;
                }
            });
        }
    }

    /// Heartbeats that are due wait to be sent; the nodes that want to be asked something, with how long they can wait.
    pub(super) fn handle_timeout(&mut self, now: Instant) -> Vec<(NodeId, Duration)> {
        for own in &mut self.producers {
            let Some(producer) = &mut own.producer else { continue };
            if !producer.handle_timeout(now) {
                continue;
            }
            if own.patience.is_in_time(now) {
                own.patience.last = now;
                self.pending.insert(own.node);
            } else {
                own.producer = None;
            }
        }
        for guard in &mut self.guards {
            if guard.handle_timeout(now) {
                self.asked.insert(guard.node());
            }
        }
        let hungry = self.feeds.iter_mut().filter(|feed| feed.due <= now);
        hungry
            .filter_map(|feed| {
                let in_time = feed.patience.is_in_time(now);
                feed.due = if in_time { now + feed.period } else { Instant::FAR_FUTURE };
                in_time.then_some((feed.node, feed.period))
            })
            .collect()
    }

    /// How long a drive that watches the heartbeat of this node-ID, or is fed at it, was left without a sign of life,
    /// if too long.
    pub(super) fn lapse(&self, node: NodeId) -> Option<Duration> {
        let heartbeats = self.producers.iter().filter(|own| own.node == node).find_map(|own| own.patience.lapse);
        heartbeats.or_else(|| self.feeds.iter().filter(|feed| feed.node == node).find_map(|feed| feed.patience.lapse))
    }

    #[inline]
    pub(super) fn poll_transmit(&mut self) -> Option<Frame> {
        if self.pending.is_empty() && self.asked.is_empty() {
            return None;
        }
        self.next_frame()
    }

    #[inline(never)]
    fn next_frame(&mut self) -> Option<Frame> {
        if let Some(node) = self.pending.first() {
            self.pending.remove(node);
            return Some(Heartbeat { node, state: NmtState::Operational.heartbeat_byte() }.emit());
        }
        let node = self.asked.first()?;
        self.asked.remove(node);
        self.guards.iter().find(|guard| guard.node() == node).map(Guard::request)
    }

    pub(super) fn next(&self) -> Option<Instant> {
        let heartbeats = self.producers.iter().filter_map(|own| own.producer.as_ref()).map(Producer::deadline);
        let guards = self.guards.iter().map(Guard::deadline);
        heartbeats.chain(self.feeds.iter().map(|feed| feed.due)).chain(guards).min()
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
        presence.set_heartbeat(HOST, Some(Duration::from_millis(500)), None, ms(100));
        assert_eq!(presence.next(), Some(ms(100)));
        presence.handle_timeout(ms(100));
        // CiA 301, 7.2.8.3.2.1: 700h + node-ID, operational is 05h.
        assert_eq!(presence.poll_transmit().map(|frame| frame.to_string()).as_deref(), Some("77F#05"));
        assert_eq!((presence.poll_transmit(), presence.next()), (None, Some(ms(600))));
        presence.handle_timeout(ms(1750));
        assert!(presence.poll_transmit().is_some() && presence.poll_transmit().is_none());
        assert_eq!(presence.next(), Some(ms(2100)));
        presence.set_heartbeat(HOST, None, None, ms(1760));
        assert_eq!((presence.next(), presence.poll_transmit()), (None, None));
    }

    #[test]
    fn a_node_is_fed_only_when_nothing_else_was_sent_to_it() {
        let mut presence = Presence::default();
        presence.set_feed(HOST, Some(Duration::from_millis(300)), None, ms(0));
        presence.note_sent(HOST, ms(200));
        assert_eq!(presence.next(), Some(ms(500)));
        assert_eq!(presence.handle_timeout(ms(499)), []);
        assert_eq!(presence.handle_timeout(ms(500)), [(HOST, Duration::from_millis(300))]);
        assert_eq!(presence.next(), Some(ms(800)));
        presence.set_feed(HOST, None, None, ms(600));
        assert_eq!(presence.next(), None);
    }

    #[test]
    fn a_sign_of_life_that_a_drive_no_longer_waits_for_is_not_sent() {
        const DRIVE: NodeId = NodeId::MIN;
        let allowed = Some(Duration::from_millis(2000));
        let mut presence = Presence::default();
        presence.set_heartbeat(HOST, Some(Duration::from_millis(500)), allowed, ms(0));
        presence.set_feed(DRIVE, Some(Duration::from_millis(500)), allowed, ms(0));
        presence.handle_timeout(ms(0));
        assert!(presence.poll_transmit().is_some());
        // As late as it may just be.
        assert_eq!(presence.handle_timeout(ms(1999)), [(DRIVE, Duration::from_millis(500))]);
        assert!(presence.poll_transmit().is_some());
        presence.note_sent(DRIVE, ms(1999));
        assert_eq!((presence.lapse(HOST), presence.lapse(DRIVE)), (None, None));
        // The program was frozen for 4 s.
        assert_eq!(presence.handle_timeout(ms(5999)), []);
        assert_eq!(presence.poll_transmit(), None);
        let lapse = Some(Duration::from_millis(4000));
        assert_eq!((presence.lapse(HOST), presence.lapse(DRIVE)), (lapse, lapse));
        presence.note_sent(DRIVE, ms(6000));
        assert_eq!((presence.handle_timeout(ms(9000)), presence.poll_transmit()), (Vec::new(), None));
        // Asked for anew, it begins anew.
        presence.set_heartbeat(HOST, Some(Duration::from_millis(500)), allowed, ms(9000));
        presence.handle_timeout(ms(9000));
        assert!(presence.poll_transmit().is_some());
        assert_eq!(presence.lapse(HOST), None);
    }
}
