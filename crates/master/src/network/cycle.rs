//! Cycles of SYNC for programs: waiting for the next one, and the exchange of process data in it.

use core::fmt;
use core::future::{Future, poll_fn};
use core::pin::{Pin, pin};
use core::task::{Context, Poll};
use std::time::Duration;

use can::Instant;
use canopen::{Mux, NodeId};

use super::handle::{CycleWaiter, Network};
use super::moved::{Moved, MovedAxis};
use crate::core::{Command, Core, Cycle, CycleLoss, Sample, SetPoint, Signal, Ticket, WatchId};

/// Why there is no next cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NoCycle {
    /// No producer's SYNC counts the cycles.
    #[error("SYNC is neither produced nor followed: call Network::sync or Network::follow_sync first")]
    NoSync,
    /// The SYNC of another producer stays away.
    #[error("no SYNC has come for {} ms: check its producer and the cable", period.as_secs_f64() * 3e3)]
    Lost {
        /// The period with which it should come.
        period: Duration,
    },
}

impl Network {
    /// Counts the SYNCs that another node produces with this period, or stops. See [`next_sync`](Self::next_sync).
    pub fn follow_sync(&self, period: Option<Duration>) {
        self.submit(Command::FollowSync(period));
    }

    /// Waits for the next SYNC, produced ([`sync`](Self::sync)) or followed ([`follow_sync`](Self::follow_sync)) by this
    /// master. Counted from the first poll: a program that comes late does not see the cycles in which it was busy, and
    /// finds them missing in [`Cycle::number`].
    ///
    /// # Errors
    /// [`NoCycle`], at once, where no SYNC can be waited for or it stays away.
    pub fn next_sync(&self) -> NextSync {
        NextSync { network: self.clone(), ticket: None, after: 0 }
    }

    /// The newest cycle; `None` before the first.
    pub fn cycle(&self) -> Option<Cycle> {
        self.lock().core.cycle()
    }

    /// Awaits `question` while the cycles go on: `step` is called in each that begins meanwhile.
    pub(crate) async fn ask_beside_cycles<T>(
        &self,
        question: impl Future<Output = T>,
        mut step: impl FnMut(&mut Exchange<'_>),
    ) -> T {
        let mut question = pin!(question);
        loop {
            let mut cycle = pin!(self.next_sync());
            let answer_or_cycle = poll_fn(|context| match question.as_mut().poll(context) {
                Poll::Ready(answer) => Poll::Ready(Ok(answer)),
                Poll::Pending => cycle.as_mut().poll(context).map(Err),
            });
            match answer_or_cycle.await {
                Ok(answer) => return answer,
                Err(Ok(_)) => self.exchange(&mut step),
                // There are no cycles, and so none to miss.
                Err(Err(_)) => return question.await,
            }
        }
    }

    /// Reads and writes process data in one go: no frame comes in between, and every RPDO that was written leaves at once,
    /// whole, whatever its transmission type. Called after [`next_sync`](Self::next_sync), that is right behind the SYNC:
    /// a synchronous RPDO then lies at its device before the next one. Allocates nothing.
    pub fn exchange<T>(&self, step: impl FnOnce(&mut Exchange<'_>) -> T) -> T {
        self.with_shared(|shared| {
            let result = step(&mut Exchange { core: &mut shared.core, moved: &mut shared.moved });
            shared.core.release_rpdos();
            result
        })
    }
}

/// Process data for the length of one call of [`Network::exchange`].
#[derive(Debug)]
pub struct Exchange<'a> {
    core: &'a mut Core,
    moved: &'a mut Moved,
}

impl Exchange<'_> {
    /// The newest cycle; `None` before the first.
    pub const fn cycle(&self) -> Option<Cycle> {
        self.core.cycle()
    }

    /// Time from one SYNC to the next; `None` while SYNC is neither produced nor followed.
    pub const fn sync_period(&self) -> Option<Duration> {
        self.core.sync_period()
    }

    /// The latest time that the runner has passed.
    pub const fn now(&self) -> Instant {
        self.core.now()
    }

    /// The newest value that came; `None` before the first, and once the PDO got another mapping.
    #[inline]
    pub fn read<T: Sample>(&self, signal: Signal<T>) -> Option<T> {
        self.core.read(&signal)
    }

    /// As [`read`](Self::read), if the value is not older than this many cycles: 0 for one that came in this cycle.
    #[inline]
    pub fn read_fresh<T: Sample>(&self, signal: Signal<T>, cycles: u64) -> Option<T> {
        self.read_aged(&signal).filter(|(_, age)| *age <= cycles).map(|(value, _)| value)
    }

    /// As [`read`](Self::read), with the cycles that have begun since the value came.
    #[inline]
    pub(crate) fn read_aged<T: Sample>(&self, signal: &Signal<T>) -> Option<(T, u64)> {
        self.core.read_aged(signal)
    }

    /// Cycles that have begun since the value came. `None` where there is no value.
    pub fn cycles_since<T>(&self, signal: Signal<T>) -> Option<u64> {
        self.core.cycles_since(&signal)
    }

    /// Puts a value into its RPDO. False if the object cannot hold the value, or if the PDO got another mapping: then nothing
    /// was changed.
    #[inline]
    pub fn write<T: Sample>(&mut self, set_point: SetPoint<T>, value: T) -> bool {
        self.core.write(&set_point, value)
    }

    /// A set-point was given in this cycle: the axis is in motion. It is noted at a place, which is returned; `place` is the one of the
    /// cycle before.
    #[inline]
    pub(crate) fn note_moving(&mut self, axis: &MovedAxis, watch: WatchId, place: usize) -> usize {
        self.core.note_moving(watch);
        self.moved.insert_at(axis, place)
    }

    /// Nothing was given in this cycle that moves the node.
    pub(crate) fn note_resting(&mut self, watch: WatchId) {
        self.core.note_resting(watch);
    }

    /// The drive is commanded to switch off; a loss is forgotten.
    pub(crate) fn forget_loss(&mut self, watch: WatchId) {
        self.core.forget_loss(watch);
    }

    /// The axis was seen to stand without power.
    pub(crate) fn note_stands(&mut self, axis: &MovedAxis) {
        self.moved.remove(axis.node, axis.controlword);
    }

    /// True if the axis has reported a fault by which its drive does not see its shaft, and not that it has ended.
    pub(crate) fn is_blind(&self, axis: &MovedAxis) -> bool {
        let rows = axis.description.map_or(&[][..], |description| description.faults.table);
        let hides = |code| rows.iter().any(|row| row.hides_motion && row.emcy == code);
        self.core.facts(axis.node).has_shown(hides)
    }

    /// Why the drive was stopped, until it was commanded to switch off.
    pub(crate) fn cycle_loss(&self, watch: WatchId) -> Option<CycleLoss> {
        self.core.cycle_loss(watch)
    }

    /// Writes an object by SDO, without waiting for the answer.
    pub(crate) fn command(&mut self, node: NodeId, object: Mux, value: u16) {
        self.core.post(node, object, value);
    }
}

/// Ends with the next SYNC. See [`Network::next_sync`].
#[must_use = "futures do nothing unless awaited"]
pub struct NextSync {
    network: Network,
    ticket: Option<Ticket>,
    /// The number of the cycle in which it was first polled.
    after: u64,
}

impl Future for NextSync {
    type Output = Result<Cycle, NoCycle>;

    fn poll(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Self::Output> {
        let this = self.get_mut();
        // What was asked for is carried out at the runner's next call: SYNC may only be on its way.
        let mut shared = this.network.lock();
        let cycle = shared.core.cycle();
        let ticket = match this.ticket {
            Some(ticket) => {
                if let Some(cycle) = cycle.filter(|cycle| cycle.number > this.after) {
                    return Poll::Ready(Ok(cycle));
                }
                ticket
            }
            None => {
                this.after = cycle.map_or(0, |cycle| cycle.number);
                *this.ticket.insert(shared.core.ticket())
            }
        };
        match shared.core.sync_period() {
            None if !shared.expects_sync() => return Poll::Ready(Err(NoCycle::NoSync)),
            Some(period) if shared.core.sync_is_lost() => return Poll::Ready(Err(NoCycle::Lost { period })),
            _ => {}
        }
        match shared.cycle_waiters.iter_mut().find(|waiter| waiter.ticket == ticket) {
            Some(waiter) => waiter.waker.clone_from(context.waker()),
            None => shared.cycle_waiters.push(CycleWaiter { ticket, waker: context.waker().clone() }),
        }
        Poll::Pending
    }
}

impl Drop for NextSync {
    fn drop(&mut self) {
        if let Some(ticket) = self.ticket {
            self.network.lock().cycle_waiters.retain(|waiter| waiter.ticket != ticket);
        }
    }
}

impl fmt::Debug for NextSync {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("NextSync").field("after", &self.after).finish_non_exhaustive()
    }
}
