//! What the clock's thread waits for: an absolute time, which another thread may change meanwhile.

#[cfg(target_os = "linux")]
pub(super) use linux::Alarm;
#[cfg(not(target_os = "linux"))]
pub(super) use portable::Alarm;

/// A timer of the kernel (timerfd_create(2)): it takes an absolute time of CLOCK_BOOTTIME, so that what passes between
/// computing and setting it makes nothing later, and the kernel's slack of 50 µs for sleeping threads does not hold for it.
#[cfg(target_os = "linux")]
mod linux {
    use std::os::fd::{AsFd, AsRawFd, RawFd};
    use std::time::Duration;

    use nix::sys::time::TimeSpec;
    use nix::sys::timerfd::{ClockId, Expiration, TimerFd, TimerFlags, TimerSetTimeFlags};

    #[derive(Debug)]
    pub(in crate::clock) struct Alarm(TimerFd);

    impl Alarm {
        /// One that never goes off.
        ///
        /// # Panics
        /// If the process may open no more files.
        #[allow(clippy::expect_used, reason = "as for its thread: without a timer there is no clock")]
        pub(in crate::clock) fn new() -> Self {
            let timer = TimerFd::new(ClockId::CLOCK_BOOTTIME, TimerFlags::TFD_CLOEXEC);
            Self(timer.expect("the process has a file descriptor left for a timer"))
        }

        /// One whose [`wait`](Self::wait) returns at once, for a runtime that waits for file descriptors; `None` if the process may open
        /// no more.
        pub(in crate::clock) fn that_never_blocks() -> Option<Self> {
            let flags = TimerFlags::TFD_CLOEXEC | TimerFlags::TFD_NONBLOCK;
            TimerFd::new(ClockId::CLOCK_BOOTTIME, flags).ok().map(Self)
        }

        /// Goes off at `at`, at once if that is past, or never.
        pub(in crate::clock) fn set(&self, at: Option<Duration>) {
            // Zero would switch the timer off.
            let at = at.map(|at| Expiration::OneShot(TimeSpec::from(at.max(Duration::from_nanos(1)))));
            // Neither can fail: the time is valid, and the descriptor open.
            let _ = match at {
                Some(at) => self.0.set(at, TimerSetTimeFlags::TFD_TIMER_ABSTIME),
                None => self.0.unset(),
            };
        }

        /// Waits until it goes off.
        pub(in crate::clock) fn wait(&self) {
            let _ = self.0.wait();
        }
    }

    impl AsRawFd for Alarm {
        fn as_raw_fd(&self) -> RawFd {
            self.0.as_fd().as_raw_fd()
        }
    }
}

/// A condition variable, by the standard library.
#[cfg(not(target_os = "linux"))]
mod portable {
    use std::sync::{Condvar, Mutex, PoisonError};
    use std::time::Instant;

    #[derive(Debug, Default)]
    pub(in crate::clock) struct Alarm {
        at: Mutex<Option<Instant>>,
        changed: Condvar,
    }

    impl Alarm {
        pub(in crate::clock) fn new() -> Self {
            Self::default()
        }

        pub(in crate::clock) fn set(&self, at: Option<Instant>) {
            *self.at.lock().unwrap_or_else(PoisonError::into_inner) = at;
            self.changed.notify_one();
        }

        pub(in crate::clock) fn wait(&self) {
            let mut at = self.at.lock().unwrap_or_else(PoisonError::into_inner);
            loop {
                let left = at.map(|at| at.saturating_duration_since(Instant::now()));
                at = match left {
                    Some(left) if left.is_zero() => return,
                    Some(left) => self.changed.wait_timeout(at, left).unwrap_or_else(PoisonError::into_inner).0,
                    None => self.changed.wait(at).unwrap_or_else(PoisonError::into_inner),
                };
            }
        }
    }
}
