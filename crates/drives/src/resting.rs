use can::Instant;

use crate::Firmware;

/// Optional: how a firmware reports that its ticks change nothing any more, so that their caller may leave them out.
///
/// `impl Resting for Drive {}` is a firmware that never rests: each tick and each run of its communication task is computed.
/// One that rests states [`ROUND`](Self::ROUND) and [`rests_since`](Self::rests_since). The rest is for a firmware with a
/// communication task, which does nothing while the firmware rests and is then left out as well.
pub trait Resting: Firmware {
    /// Ticks after which all that counts them has come round.
    const ROUND: u32 = 1;

    /// Whether nothing that a tick reads or writes differs from `earlier`, which is this firmware whole [rounds](Self::ROUND) of
    /// ticks before, and nothing of it depends on the time. Then ticks with the same sensors change nothing any more, nor what
    /// they return, until a frame is handed in or something is [due](Self::next_event). False when in doubt.
    fn rests_since(&self, earlier: &Self, now: Instant) -> bool {
        let _ = (earlier, now);
        false
    }

    /// [`Station::poll_timeout`](can::Station::poll_timeout) but for the communication task, which does nothing for a firmware that rests.
    fn next_event(&self) -> Option<Instant> {
        self.poll_timeout()
    }

    /// When the communication task runs for the first time at or after `at`, if nothing disturbs it; `None` for never.
    fn task_from(&self, at: Instant) -> Option<Instant> {
        let _ = at;
        None
    }

    /// A run of the communication task finds nothing to do, whatever the ticks before it do: nothing waits to be stored, no change of
    /// a value is to be sent by itself, no host is watched by the time.
    fn task_is_idle(&self) -> bool {
        false
    }

    /// The runs of the communication task before `now` have been left out, of a firmware that rests: they would have done nothing.
    fn leave_out_tasks(&mut self, now: Instant) {
        let _ = now;
    }

    /// So many whole [rounds](Self::ROUND) of ticks have been left out, of a firmware that rests: what only counts them, and decides
    /// nothing any more, goes on.
    fn leave_out_rounds(&mut self, rounds: u64) {
        let _ = rounds;
    }
}
