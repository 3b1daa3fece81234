//! A dead-man's switch: a hold that is not renewed in time lapses, for good.

use std::time::Duration;

use can::Instant;

/// A hold that has to be renewed within its span, again and again. Time is an argument.
///
/// A renewal that comes too late changes nothing: the motion has to be started again, on purpose. Else messages that had been
/// delayed would restart a motion that has been stopped.
///
/// ```
/// use std::time::Duration;
/// use can::Instant;
/// use host::DeadMan;
///
/// let mut held = DeadMan::new(Duration::from_millis(200), Instant::ZERO);
/// assert!(held.renew(Instant::from_millis(150)));
/// assert!(!held.has_lapsed(Instant::from_millis(349)) && held.has_lapsed(Instant::from_millis(350)));
/// assert!(!held.renew(Instant::from_millis(350)), "too late");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DeadMan {
    span: Duration,
    deadline: Instant,
}

impl DeadMan {
    /// Lapses when `span` has passed from `now` on without a renewal.
    pub fn new(span: Duration, now: Instant) -> Self {
        Self { span, deadline: now + span }
    }

    /// Renews the hold for another span; false if it has lapsed already.
    pub fn renew(&mut self, now: Instant) -> bool {
        let in_time = !self.has_lapsed(now);
        if in_time {
            self.deadline = now + self.span;
        }
        in_time
    }

    /// True from its deadline on.
    pub fn has_lapsed(&self, now: Instant) -> bool {
        now >= self.deadline
    }
}
