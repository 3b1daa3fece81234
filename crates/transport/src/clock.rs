//! The wall clock: the one file of the project that reads time.
//!
//! A [`WallClock`] counts nanoseconds since it was made, as the [`Instant`]s that stations take, and sleeps until one.
//! tokio's own timer counts whole milliseconds, which is ten CAN frames at 1 Mbit/s; so sleeping is done by a thread of
//! its own that waits for an [`Alarm`] at an absolute time and ends with the last copy of the clock.

mod alarm;
pub(crate) mod waiter;

use std::collections::BTreeMap;
use std::future::Future;
use std::pin::Pin;
#[cfg(all(test, target_os = "linux"))]
use std::sync::atomic::{AtomicU64, Ordering::SeqCst};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, Waker};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use can::Instant;

use crate::realtime::{self, RealTimeError};
use alarm::Alarm;

/// Time since this clock was made. Copies share its zero and its timer thread.
#[derive(Clone, Debug)]
pub struct WallClock {
    face: Face,
    timer: Arc<Timer>,
}

impl WallClock {
    /// A clock that reads [`Instant::ZERO`] now.
    ///
    /// # Panics
    /// If the system has no thread left for the timer.
    pub fn start() -> Self {
        let face = Face::new();
        Self { face, timer: Timer::start(face, since_epoch(), || {}) }
    }

    /// The same, with the timer's thread in real time ([`realtime`]); or why that is not allowed.
    ///
    /// # Panics
    /// If the system has no thread left for the timer.
    pub fn start_in_real_time() -> Result<Self, RealTimeError> {
        let (reported, entered) = std::sync::mpsc::channel();
        let face = Face::new();
        let timer = Timer::start(face, since_epoch(), move || drop(reported.send(realtime::enter())));
        // A thread that reports nothing has not entered anything.
        entered.recv().unwrap_or(Err(RealTimeError::NotHere))?;
        Ok(Self { face, timer })
    }

    /// Now. Never goes back.
    pub fn now(&self) -> Instant {
        self.face.now()
    }

    /// Unix time of this clock's zero: what to add to an [`Instant`] for a time stamp that other programs understand.
    pub fn unix_zero(&self) -> Duration {
        self.timer.unix_zero
    }

    /// What this clock showed when the system's clock showed the Unix time `unix`: for the time stamps of the kernel. Now
    /// for a time to come, as after the system's clock was set back.
    pub fn at_unix(&self, unix: Duration) -> Instant {
        let system_now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let age = system_now.saturating_sub(unix).as_nanos();
        let age = u64::try_from(age).unwrap_or(u64::MAX);
        Instant::from_nanos(self.now().as_nanos().saturating_sub(age))
    }

    /// Completes when [`now`](Self::now) has reached `deadline`. Dropping the future forgets it.
    pub fn sleep_until(&self, deadline: Instant) -> Sleep {
        Sleep { clock: self.clone(), deadline, ticket: None }
    }

    /// [`sleep_until`](Self::sleep_until), or forever for `None`: what [`can::Station::poll_timeout`] returns.
    pub async fn sleep_until_due(&self, deadline: Option<Instant>) {
        match deadline {
            Some(deadline) => self.sleep_until(deadline).await,
            None => std::future::pending().await,
        }
    }

    /// Completes `duration` from now.
    pub fn sleep(&self, duration: Duration) -> Sleep {
        self.sleep_until(self.now() + duration)
    }
}

/// Unix time in whole microseconds: logs have no finer ones, and two times of a bus are as far apart there as on it.
fn since_epoch() -> Duration {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    Duration::new(now.as_secs(), now.subsec_micros() * 1000)
}

/// Future of [`WallClock::sleep_until`].
#[derive(Debug)]
#[must_use = "a sleep does nothing unless awaited"]
pub struct Sleep {
    clock: WallClock,
    deadline: Instant,
    ticket: Option<u64>,
}

impl Future for Sleep {
    type Output = ();

    fn poll(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<()> {
        if self.clock.now() >= self.deadline {
            return Poll::Ready(());
        }
        let ticket = self.clock.timer.register(self.deadline, self.ticket, context.waker());
        self.ticket = Some(ticket);
        Poll::Pending
    }
}

impl Drop for Sleep {
    fn drop(&mut self) {
        if let Some(ticket) = self.ticket {
            self.clock.timer.forget(self.deadline, ticket);
        }
    }
}

/// Nanoseconds since the machine started at which this one began. The time in which a machine sleeps counts (CLOCK_BOOTTIME): a
/// drive does not sleep with it.
#[cfg(target_os = "linux")]
#[derive(Clone, Copy, Debug)]
struct Face {
    zero: Duration,
    /// How long the machine of a test has slept, in ns.
    #[cfg(test)]
    slept_ns: &'static AtomicU64,
}

#[cfg(target_os = "linux")]
impl Face {
    fn new() -> Self {
        Self {
            zero: Self::since_boot(),
            #[cfg(test)]
            slept_ns: Box::leak(Box::default()),
        }
    }

    fn now(self) -> Instant {
        let shown = Instant::ZERO + (Self::since_boot() - self.zero);
        #[cfg(test)]
        let shown = shown.plus_nanos(self.slept_ns.load(SeqCst));
        shown
    }

    /// When `at` is, by CLOCK_BOOTTIME.
    fn absolute(self, at: Instant) -> Duration {
        let since_boot = self.zero + (at - Instant::ZERO);
        #[cfg(test)]
        let since_boot = since_boot.saturating_sub(Duration::from_nanos(self.slept_ns.load(SeqCst)));
        since_boot
    }

    fn since_boot() -> Duration {
        let now = rustix::time::clock_gettime(rustix::time::ClockId::Boottime);
        Duration::new(now.tv_sec.unsigned_abs(), now.tv_nsec.unsigned_abs() as u32)
    }
}

#[cfg(not(target_os = "linux"))]
#[derive(Clone, Copy, Debug)]
struct Face {
    zero: std::time::Instant,
}

#[cfg(not(target_os = "linux"))]
impl Face {
    fn new() -> Self {
        Self { zero: std::time::Instant::now() }
    }

    fn now(self) -> Instant {
        Instant::ZERO + self.zero.elapsed()
    }

    /// When `at` is, by the standard library's clock.
    fn absolute(self, at: Instant) -> std::time::Instant {
        self.zero + (at - Instant::ZERO)
    }
}

/// Handle of the timer thread; dropping it ends the thread.
#[derive(Debug)]
struct Timer {
    unix_zero: Duration,
    queue: Arc<Queue>,
}

/// Wakers are woken and dropped with the lock released: either may end a task, and with it other sleeps.
#[derive(Debug)]
struct Queue {
    sleepers: Mutex<Sleepers>,
    alarm: Alarm,
    face: Face,
}

#[derive(Debug, Default)]
struct Sleepers {
    wakers: BTreeMap<(Instant, u64), Waker>,
    next_ticket: u64,
    closed: bool,
}

impl Timer {
    fn start(face: Face, unix_zero: Duration, first: impl FnOnce() + Send + 'static) -> Arc<Self> {
        let queue = Arc::new(Queue { sleepers: Mutex::default(), alarm: Alarm::new(), face });
        let served = Arc::clone(&queue);
        std::thread::spawn(move || {
            first();
            served.serve();
        });
        Arc::new(Self { unix_zero, queue })
    }

    fn register(&self, deadline: Instant, ticket: Option<u64>, waker: &Waker) -> u64 {
        let mut sleepers = self.queue.lock();
        let ticket = ticket.unwrap_or_else(|| {
            sleepers.next_ticket += 1;
            sleepers.next_ticket
        });
        let replaced = sleepers.wakers.insert((deadline, ticket), waker.clone());
        if sleepers.wakers.first_key_value().is_some_and(|(key, _)| *key == (deadline, ticket)) {
            self.queue.alarm.set(Some(self.queue.face.absolute(deadline)));
        }
        drop(sleepers);
        drop(replaced);
        ticket
    }

    fn forget(&self, deadline: Instant, ticket: u64) {
        let mut sleepers = self.queue.lock();
        let forgotten = sleepers.wakers.remove(&(deadline, ticket));
        drop(sleepers);
        drop(forgotten);
    }
}

impl Drop for Timer {
    fn drop(&mut self) {
        let mut sleepers = self.queue.lock();
        sleepers.closed = true;
        self.queue.alarm.set(Some(self.queue.face.absolute(Instant::ZERO)));
    }
}

impl Queue {
    fn lock(&self) -> MutexGuard<'_, Sleepers> {
        self.sleepers.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The timer thread: wakes who is due, then waits for the next deadline or a change. The alarm is set with the lock held,
    /// so that the last one to set it is the one who saw the sleepers last.
    fn serve(&self) {
        let mut sleepers = self.lock();
        while !sleepers.closed {
            let next = sleepers.wakers.first_key_value().map(|((deadline, _), _)| *deadline);
            match next {
                Some(deadline) if deadline <= self.face.now() => {
                    let due = sleepers.wakers.pop_first();
                    drop(sleepers);
                    if let Some((_, waker)) = due {
                        waker.wake();
                    }
                }
                next => {
                    self.alarm.set(next.map(|deadline| self.face.absolute(deadline)));
                    drop(sleepers);
                    self.alarm.wait();
                }
            }
            sleepers = self.lock();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn sleeps_at_least_until_the_deadline_and_in_order() {
        let clock = WallClock::start();
        let start = clock.now();
        let order = Mutex::new(Vec::new());
        let nap = async |millis: u64| {
            let deadline = start + Duration::from_millis(millis);
            clock.sleep_until(deadline).await;
            assert!(clock.now() >= deadline);
            order.lock().unwrap().push(millis);
        };
        tokio::join!(nap(30), nap(10), nap(20), nap(0));
        assert_eq!(*order.lock().unwrap(), [0, 10, 20, 30]);
    }

    #[test]
    fn a_stamp_of_the_system_is_as_old_here_as_there() {
        let clock = WallClock::start();
        let unix = || SystemTime::now().duration_since(UNIX_EPOCH).unwrap();
        let before = clock.now();
        let stamp = unix();
        let after = clock.now();
        let at = clock.at_unix(stamp);
        // The two clocks are read one after the other; a machine that is busy may do something else in between.
        let slack = clock.now() - before + Duration::from_millis(1);
        assert!(at + slack >= before && at <= after + slack, "{before:?} {at:?} {after:?}");
        assert!(clock.at_unix(unix() + Duration::from_secs(3600)) <= clock.now());
        assert_eq!(clock.at_unix(Duration::ZERO), Instant::ZERO);
    }

    #[tokio::test]
    async fn a_dropped_sleep_leaves_nothing_behind() {
        let clock = WallClock::start();
        let far = clock.sleep(Duration::from_secs(3600));
        tokio::select! {
            () = far => unreachable!("an hour has not passed"),
            () = clock.sleep(Duration::from_millis(1)) => {}
        }
        assert!(clock.timer.queue.lock().wakers.is_empty());
    }

    #[tokio::test]
    async fn an_earlier_sleep_comes_before_one_that_the_timer_already_waits_for() {
        let clock = WallClock::start();
        let late = clock.clone();
        let (woken, mut order) = tokio::sync::mpsc::unbounded_channel();
        let far = tokio::spawn(async move { late.sleep(Duration::from_secs(3600)).await });
        // By then the timer waits for the far one.
        tokio::time::sleep(Duration::from_millis(20)).await;
        clock.sleep(Duration::from_millis(1)).await;
        woken.send(()).unwrap();
        assert_eq!(order.recv().await, Some(()));
        assert!(!far.is_finished());
        far.abort();
    }

    /// The system's clock that goes on while a machine sleeps is ahead when it wakes, and so is what was due meanwhile: a master
    /// that is handed this time finds that it was held up (`ferrodrive_master`, `core::presence`).
    #[cfg(target_os = "linux")]
    #[tokio::test]
    async fn the_time_in_which_the_machine_slept_has_passed_and_what_was_due_in_it_is_late() {
        const HOUR: Duration = Duration::from_secs(3600);
        let clock = WallClock::start();
        let (due, far) = (clock.sleep(HOUR / 2), clock.sleep(HOUR * 2));
        let (mut due, mut far) = (std::pin::pin!(due), std::pin::pin!(far));
        tokio::select! {
            () = &mut due => unreachable!("half an hour has not passed"),
            () = clock.sleep(Duration::from_millis(1)) => {}
        }
        clock.face.slept_ns.store(HOUR.as_nanos() as u64, SeqCst);
        // The kernel's timer goes off when the machine wakes; here another one does.
        clock.timer.queue.alarm.set(Some(Duration::ZERO));
        due.await;
        assert!(clock.now() >= Instant::ZERO + HOUR, "{:?}", clock.now());
        tokio::select! {
            () = &mut far => unreachable!("two hours have not passed"),
            () = clock.sleep(Duration::from_millis(1)) => {}
        }
    }

    #[tokio::test]
    async fn the_thread_ends_with_the_last_copy() {
        let clock = WallClock::start();
        let queue = Arc::downgrade(&clock.timer.queue);
        clock.clone().sleep(Duration::from_millis(1)).await;
        drop(clock);
        let patience = std::time::Instant::now();
        while queue.strong_count() > 0 {
            assert!(patience.elapsed() < Duration::from_secs(600), "timer thread still runs");
            std::thread::yield_now();
        }
    }
}
