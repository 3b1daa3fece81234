use std::time::Duration;

use can::Frame;
use canopen::{Mux, NodeId};

use super::Core;
use super::FEED;
use super::cycle::{Cycle, Tick};
use super::event::Event;
use super::field::{Sample, SetPoint, Signal};
use super::image::Received;
use super::payload::Payload;
use super::request::{Request, Transfer};
use super::supervision::{CycleLoss, CycleRules, WatchId};
use crate::host_loss::HostLoss;

/// Timeout of a write whose answer is not reported to any caller.
const POST_TIMEOUT: Duration = Duration::from_millis(500);

/// Cycles of SYNC, what is read and written in them, and who is stopped when they fail.
impl Core {
    /// The newest cycle of SYNC; `None` before the first.
    pub const fn cycle(&self) -> Option<Cycle> {
        self.sync.cycle()
    }

    /// Periods without a SYNC since cycles are counted.
    pub const fn missed_cycles(&self) -> u64 {
        self.sync.missed()
    }

    /// Time from one SYNC to the next; `None` while SYNC is neither produced nor followed.
    pub const fn sync_period(&self) -> Option<Duration> {
        self.sync.period()
    }

    /// True while the SYNC of another producer, which is followed, stays away.
    pub const fn sync_is_lost(&self) -> bool {
        self.sync.is_lost()
    }

    /// The newest value that came; `None` before the first, and once the PDO got another mapping.
    #[inline]
    pub fn read<T: Sample>(&self, signal: &Signal<T>) -> Option<T> {
        self.image.at(signal.place).map(|Received { raw, .. }| T::from_field(raw, &signal.field))
    }

    /// The same, with the cycles that have begun since it came.
    #[inline]
    pub(crate) fn read_aged<T: Sample>(&self, signal: &Signal<T>) -> Option<(T, u64)> {
        self.image.aged(signal.place).map(|(raw, age)| (T::from_field(raw, &signal.field), age))
    }

    /// Cycles that have begun since the value came: 0 in its own. `None` where there is none.
    pub fn cycles_since<T>(&self, signal: &Signal<T>) -> Option<u64> {
        self.image.cycles_since(signal.place)
    }

    /// Puts a value into its RPDO, which is sent by its transmission type. False if the object cannot hold the value, or if
    /// the PDO got another mapping: then nothing was changed.
    #[inline]
    pub fn write<T: Sample>(&mut self, set_point: &SetPoint<T>, value: T) -> bool {
        value.to_field(&set_point.field).is_some_and(|raw| self.image.put(set_point.place, raw))
    }

    /// Sends every RPDO that was written and waits for a SYNC at once: it then lies at the device before the next one.
    pub fn release_rpdos(&mut self) {
        self.image.release_waiting();
    }

    /// True, once, when a cycle has begun or there will be none: SYNC was lost, or is neither produced nor followed any more.
    pub const fn take_cycle_change(&mut self) -> bool {
        core::mem::replace(&mut self.cycle_changed, false)
    }

    pub(super) fn produce_sync(&mut self, period: Option<Duration>) {
        self.sync.produce(period, self.now);
        self.cycle_changed = true;
        self.stop_without_cycles();
        self.count_cycle();
    }

    pub(super) fn follow_sync(&mut self, period: Option<Duration>) {
        self.sync.follow(period, self.now);
        self.cycle_changed = true;
        self.stop_without_cycles();
    }

    /// Watches over a program that moves a drive by process data.
    pub(crate) fn watch_cycles(&mut self, rules: CycleRules) -> WatchId {
        self.supervision.set(rules)
    }

    /// A set-point was given in the newest cycle.
    pub(crate) fn note_moving(&mut self, id: WatchId) {
        self.supervision.note_moving(id, self.sync.cycle().map_or(0, |cycle| cycle.number));
    }

    /// A drive is about to be moved that nothing stops when this program dies.
    pub(crate) fn note_unguarded(&mut self, node: NodeId, loss: HostLoss) {
        self.events.push(Event::Unguarded(node, loss), self.now);
    }

    /// Nothing is in motion any more.
    pub(crate) fn note_resting(&mut self, id: WatchId) {
        self.supervision.note_resting(id);
    }

    /// A loss is forgotten.
    pub(crate) fn forget_loss(&mut self, id: WatchId) {
        self.supervision.forget_loss(id);
    }

    /// Why the drive was stopped, until that is forgotten.
    pub(crate) fn cycle_loss(&self, id: WatchId) -> Option<CycleLoss> {
        self.supervision.loss(id)
    }

    /// An axis is being stopped: no step moves it on, and no frame that was sent before takes the stop back. The word that stops it
    /// goes into every RPDO that carries its controlword and has been written to; by SDO it is the caller's.
    pub(crate) fn stop_axis(&mut self, node: NodeId, controlword: Mux, stop: u16) {
        self.supervision.stop(node, controlword);
        self.image.overrule(node, controlword, stop);
        // The stop by SDO does not wait behind what no caller waits for: words of earlier cycles, and questions to keep
        // a drive content.
        let now = self.now;
        let blocks = self.may_use_blocks(node);
        while self.member_mut(node).channel.cancel(FEED, blocks, now) {}
        self.settle(node);
        self.find_due();
    }

    /// Writes an object by SDO; no caller waits for the answer.
    pub(crate) fn post(&mut self, node: NodeId, mux: Mux, value: u16) {
        let transfer = Transfer::Download(Payload::new(&value.to_le_bytes()));
        self.start_request(FEED, Request { node, mux, transfer, timeout: POST_TIMEOUT });
        self.find_due();
    }

    pub(super) fn poll_rpdo(&mut self) -> Option<Frame> {
        let (node, frame) = self.image.poll_transmit()?;
        let now = self.now;
        let facts = &mut self.member_mut(node).facts;
        (facts.talked_to_at, facts.written_at) = (Some(now), Some(now));
        Some(frame)
    }

    /// Time may have brought a cycle, or the end of the patience for one.
    pub(super) fn count_cycle(&mut self) {
        if let Some(tick) = self.sync.handle_timeout(self.now) {
            self.take_tick(tick);
        }
    }

    /// A SYNC has come.
    pub(super) fn handle_sync(&mut self) {
        if let Some(tick) = self.sync.handle_sync(self.now) {
            self.take_tick(tick);
            self.find_due();
        }
    }

    fn take_tick(&mut self, tick: Tick) {
        let (cycle, now) = match tick {
            Tick::Lost => return self.lose_sync(),
            Tick::Begun(cycle) => (cycle, self.now),
            Tick::Back(cycle) => {
                self.events.push(Event::SyncBack, self.now);
                (cycle, self.now)
            }
        };
        if cycle.missed > 0 {
            self.events.push(Event::CyclesMissed(cycle.missed), now);
        }
        self.cycle_changed = true;
        self.image.begin_cycle(cycle.number);
        self.image.release_waiting();
        self.lost.extend(self.supervision.begin_cycle(cycle.number, self.sync.period(), &self.image));
        self.stop_lost();
    }

    /// Where cycles are no longer counted, a program that stays away would not be noticed.
    fn stop_without_cycles(&mut self) {
        if self.sync.period().is_none() {
            self.lost.extend(self.supervision.lose_sync(self.since_sync()));
            self.stop_lost();
        }
    }

    fn since_sync(&self) -> Duration {
        self.sync.cycle().map_or(Duration::ZERO, |cycle| self.now - cycle.at)
    }

    fn lose_sync(&mut self) {
        let waited = self.since_sync();
        self.cycle_changed = true;
        self.events.push(Event::SyncLost(waited), self.now);
        self.lost.extend(self.supervision.lose_sync(waited));
        self.stop_lost();
    }

    /// Stops the drives that were found lost, by SDO: a synchronous RPDO waits for a SYNC that may not come. What an RPDO
    /// carries from here on says the same.
    fn stop_lost(&mut self) {
        while let Some((rules, loss)) = self.lost.pop() {
            let CycleRules { node, stop, controlword: mux, place, .. } = rules;
            if let Some(place) = place {
                self.image.put(place, stop.into());
                self.image.release_waiting();
            }
            self.post(node, mux, stop);
            self.events.push(Event::CyclicStopped(node, loss), self.now);
            self.changed.insert(node);
        }
    }
}
