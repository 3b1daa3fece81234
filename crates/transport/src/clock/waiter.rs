//! Waiting of one task with a timer of its own, in the file descriptors that its runtime waits for anyway.
//!
//! A [`Sleep`](super::Sleep) goes by the clock's thread: two system calls to hand the deadline over, four and two changes of threads to come
//! back. A task that waits some thousand times a second, as that of a world with its drives does, waits here instead.

#[cfg(target_os = "linux")]
use tokio::io::{Interest, unix::AsyncFd};

#[cfg(target_os = "linux")]
use super::Alarm;
use super::WallClock;
use can::Instant;

/// A clock and a timer, of one task that waits often.
#[derive(Debug)]
pub(crate) struct Waiter {
    clock: WallClock,
    /// None where the system has no such timer left: the clock's thread then.
    #[cfg(target_os = "linux")]
    alarm: Option<AsyncFd<Alarm>>,
    /// What the alarm is set to, and has not gone off at.
    #[cfg(target_os = "linux")]
    set: Option<Instant>,
}

#[cfg(target_os = "linux")]
impl Waiter {
    pub(crate) fn new(clock: &WallClock) -> Self {
        let alarm = Alarm::that_never_blocks().and_then(watched);
        Self { clock: clock.clone(), alarm, set: None }
    }

    /// Completes when the clock has reached `deadline`; never for `None`. Dropped before, it leaves nothing to be undone.
    pub(crate) async fn until(&mut self, deadline: Option<Instant>) {
        let (Some(alarm), Some(deadline)) = (&self.alarm, deadline) else {
            return self.clock.sleep_until_due(deadline).await;
        };
        while self.clock.now() < deadline {
            if self.set != Some(deadline) {
                alarm.get_ref().set(Some(self.clock.face.absolute(deadline)));
                self.set = Some(deadline);
            }
            let Ok(mut ready) = alarm.readable().await else {
                return self.clock.sleep_until(deadline).await;
            };
            // It may have gone off for a deadline before this one: it is set anew then.
            alarm.get_ref().wait();
            ready.clear_ready();
            self.set = None;
        }
    }
}

/// `None` outside of a runtime that waits for file descriptors, too.
// As in `socketcan/socket.rs`: the successor is for unsafe code, and the alarm keeps its descriptor open by itself.
#[cfg(target_os = "linux")]
#[allow(deprecated, reason = "its successor is unsafe code")]
fn watched(alarm: Alarm) -> Option<AsyncFd<Alarm>> {
    AsyncFd::with_interest(alarm, Interest::READABLE).ok()
}

#[cfg(not(target_os = "linux"))]
impl Waiter {
    pub(crate) fn new(clock: &WallClock) -> Self {
        Self { clock: clock.clone() }
    }

    /// Completes when the clock has reached `deadline`; never for `None`.
    pub(crate) async fn until(&mut self, deadline: Option<Instant>) {
        self.clock.sleep_until_due(deadline).await;
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[tokio::test]
    async fn waits_until_the_deadline_also_after_a_wait_that_was_given_up() {
        let clock = WallClock::start();
        let mut waiter = Waiter::new(&clock);
        let soon = clock.now() + Duration::from_millis(2);
        // One that is given up, one whose alarm goes off with no task waiting, and one earlier than what is set.
        tokio::select! {
            () = waiter.until(Some(clock.now() + Duration::from_secs(3600))) => unreachable!("an hour has not passed"),
            () = clock.sleep_until(soon) => {}
        }
        tokio::select! {
            biased;
            () = waiter.until(Some(clock.now() + Duration::from_millis(1))) => {}
            () = tokio::task::yield_now() => {}
        }
        clock.sleep(Duration::from_millis(3)).await;
        for wait_us in [0, 500, 3000, 1] {
            let deadline = clock.now() + Duration::from_micros(wait_us);
            waiter.until(Some(deadline)).await;
            assert!(clock.now() >= deadline, "{wait_us} us");
        }
    }
}
