//! Work for all cores: threads take the numbers of pieces of work, and one place takes the results.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError, mpsc};
use std::time::Duration;

use can::Instant;
use transport::WallClock;

use crate::session::runtime;
use crate::signals::{Signal, asked_to_end};

/// Pieces that may be begun before the first that is not done: one may take as long as thousands of others.
const AHEAD: u64 = 1024;

/// How long a thread keeps results. Of pieces of a few milliseconds each one would wake the thread that takes them, and find the lock of
/// the queue taken by it.
const KEPT: Duration = Duration::from_millis(20);

/// Threads that do work, and whether a signal has asked them to end.
pub(super) struct Crew {
    jobs: Option<usize>,
    stop: Arc<AtomicBool>,
    heard: Arc<Mutex<Option<Signal>>>,
}

impl Crew {
    /// So many threads, or one for each core. A signal ends the work from here on, after the pieces that are begun; a second one ends
    /// the process.
    pub(super) fn new(jobs: Option<u16>) -> Self {
        let crew = Self { jobs: jobs.map(usize::from), stop: Arc::default(), heard: Arc::default() };
        let (stop, heard) = (Arc::clone(&crew.stop), Arc::clone(&crew.heard));
        std::thread::spawn(move || {
            if let Ok(runtime) = runtime() {
                let signal = runtime.block_on(asked_to_end());
                *heard.lock().unwrap_or_else(PoisonError::into_inner) = Some(signal);
                stop.store(true, Ordering::Release);
                // Who asks twice does not want to wait for the runs that are on their way.
                let signal = runtime.block_on(asked_to_end());
                std::process::exit(signal.status() as i32);
            }
        });
        crew
    }

    /// The signal that has ended the work early, if one has.
    pub(super) fn signal(&self) -> Option<Signal> {
        *self.heard.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Begins no further piece.
    pub(super) fn end(&self) {
        self.stop.store(true, Ordering::Release);
    }

    /// Does the pieces 0 to `count`, and hands the result of each to `take` with its number, in the order of the numbers. Of work
    /// that ends early that is all from the first on without a gap.
    pub(super) fn work<T: Send>(&self, count: u64, work: impl Fn(u64) -> T + Sync, mut take: impl FnMut(u64, T)) {
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let jobs = self.jobs.unwrap_or(cores).min(usize::try_from(count).unwrap_or(usize::MAX));
        let next = AtomicU64::new(0);
        let taken = TakenCount::default();
        let clock = WallClock::start();
        let (results, incoming) = mpsc::channel();
        std::thread::scope(|scope| {
            for _ in 0..jobs {
                let results = results.clone();
                let (next, taken, work, clock) = (&next, &taken, &work, &clock);
                scope.spawn(move || {
                    let _ends = taken.on_panic(&self.stop);
                    let mut batch = Batch { results, done: Vec::new(), since: Instant::ZERO };
                    while !self.stop.load(Ordering::Acquire) {
                        let number = next.fetch_add(1, Ordering::Relaxed);
                        if number >= count {
                            break;
                        }
                        let wanted = number.saturating_sub(AHEAD - 1);
                        if !taken.has(wanted) {
                            // What it keeps may be what all others wait for.
                            batch.hand_over();
                            taken.wait_for(wanted);
                        }
                        batch.make(number, work, clock);
                    }
                    batch.hand_over();
                });
            }
            drop(results);
            // A panic of `take` ends the work too: what the others would go on to make is not taken any more.
            let _ends = taken.on_panic(&self.stop);
            let mut early = BTreeMap::new();
            let mut first = 0;
            for batch in incoming {
                early.extend(batch);
                while let Some(result) = early.remove(&first) {
                    take(first, result);
                    first += 1;
                }
                taken.show(first);
            }
        });
    }
}

/// Results of one thread on their way to the one that takes them.
struct Batch<T> {
    results: mpsc::Sender<Vec<(u64, T)>>,
    done: Vec<(u64, T)>,
    /// When the first of them was begun.
    since: Instant,
}

impl<T> Batch<T> {
    /// Makes a piece, and hands over what has been kept long enough.
    fn make(&mut self, number: u64, work: impl Fn(u64) -> T, clock: &WallClock) {
        if self.done.is_empty() {
            self.since = clock.now();
        }
        self.done.push((number, work(number)));
        if clock.now() - self.since >= KEPT {
            self.hand_over();
        }
    }

    /// Who takes them stays until the last thread has ended, or panics: then nothing is taken any more.
    fn hand_over(&mut self) {
        if !self.done.is_empty() {
            let _ = self.results.send(std::mem::take(&mut self.done));
        }
    }
}

/// How many results have been taken. Threads that are not far ahead look at it without a lock, which would have them wait for the one
/// thread that takes results.
#[derive(Default)]
struct TakenCount {
    count: AtomicU64,
    waiting: AtomicU64,
    lock: Mutex<()>,
    more: Condvar,
}

impl TakenCount {
    /// Whether so many have been taken.
    fn has(&self, wanted: u64) -> bool {
        self.count.load(Ordering::SeqCst) >= wanted
    }

    /// Returns when so many have been taken; the thread with the first piece that is not done never waits.
    fn wait_for(&self, wanted: u64) {
        self.waiting.fetch_add(1, Ordering::SeqCst);
        let lock = self.lock.lock().unwrap_or_else(PoisonError::into_inner);
        drop(self.more.wait_while(lock, |()| self.count.load(Ordering::SeqCst) < wanted));
        self.waiting.fetch_sub(1, Ordering::SeqCst);
    }

    /// While this lives, a panic of its thread ends the work, and has no other one wait for a result that never comes.
    fn on_panic<'a>(&'a self, stop: &'a AtomicBool) -> OnPanic<'a> {
        OnPanic(self, stop)
    }

    /// So many have been taken. Either it sees who waits, or they see the count: both are in one order (SeqCst).
    fn show(&self, count: u64) {
        self.count.fetch_max(count, Ordering::SeqCst);
        if self.waiting.load(Ordering::SeqCst) > 0 {
            drop(self.lock.lock().unwrap_or_else(PoisonError::into_inner));
            self.more.notify_all();
        }
    }
}

/// See [`TakenCount::on_panic`].
struct OnPanic<'a>(&'a TakenCount, &'a AtomicBool);

impl Drop for OnPanic<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            // First, since those who wait go on with what they have begun and look at it after.
            self.1.store(true, Ordering::Release);
            self.0.show(u64::MAX);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn crew(jobs: usize) -> Crew {
        Crew { jobs: Some(jobs), stop: Arc::default(), heard: Arc::default() }
    }

    #[test]
    fn results_come_in_the_order_of_their_numbers_and_no_thread_runs_far_ahead_of_a_slow_piece() {
        let count = 3 * AHEAD;
        let most = AtomicU64::new(0);
        let piece = |number: u64| {
            // The first piece ends when the others have come as far as they may.
            while number == 0 && most.load(Ordering::Acquire) < AHEAD - 1 {
                std::thread::yield_now();
            }
            let before = most.fetch_max(number, Ordering::AcqRel);
            assert!(number != 0 || before == AHEAD - 1, "{before} was begun");
            number
        };
        let mut seen = Vec::new();
        crew(3).work(count, piece, |number, result| seen.push((number, result)));
        assert_eq!(seen, (0..count).map(|number| (number, number)).collect::<Vec<_>>());
    }

    #[test]
    #[should_panic(expected = "a scoped thread panicked")]
    fn a_piece_that_panics_ends_the_work_and_does_not_hang_it() {
        crew(3).work(1 << 40, |number| assert_ne!(number, 0, "the first piece panics"), |_, ()| {});
    }

    #[test]
    #[should_panic(expected = "the first result is refused")]
    fn a_panic_of_who_takes_the_results_ends_the_work() {
        crew(3).work(1 << 40, |_| (), |number, ()| assert_ne!(number, 0, "the first result is refused"));
    }

    #[test]
    fn work_that_ends_early_has_all_results_up_to_a_number() {
        let crew = crew(2);
        let mut seen = Vec::new();
        let take = |number, ()| {
            seen.push(number);
            if number == 5 {
                crew.end();
            }
        };
        crew.work(1 << 40, |_| (), take);
        assert!(seen.len() > 5 && seen.iter().copied().eq(0..seen.len() as u64), "{seen:?}");
    }
}
