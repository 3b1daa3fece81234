//! Work for all cores: threads take the numbers of pieces of work, and one place takes the results.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError, mpsc};

use crate::session::runtime;
use crate::signals::{Signal, asked_to_end};

/// Results that may wait to be taken: a piece of work may be much faster than another.
const WAITING: usize = 256;

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

    /// Does the pieces 0 to `count`, and hands the result of each to `take` with its number, in the order in which they end.
    pub(super) fn work<T: Send>(&self, count: u64, work: impl Fn(u64) -> T + Sync, mut take: impl FnMut(u64, T)) {
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let jobs = self.jobs.unwrap_or(cores).min(usize::try_from(count).unwrap_or(usize::MAX));
        let next = AtomicU64::new(0);
        let (results, incoming) = mpsc::sync_channel(WAITING);
        std::thread::scope(|scope| {
            for _ in 0..jobs {
                let results = results.clone();
                let (next, work) = (&next, &work);
                scope.spawn(move || {
                    while !self.stop.load(Ordering::Acquire) {
                        let number = next.fetch_add(1, Ordering::Relaxed);
                        if number >= count || results.send((number, work(number))).is_err() {
                            return;
                        }
                    }
                });
            }
            drop(results);
            incoming.into_iter().for_each(|(number, result)| take(number, result));
        });
    }
}
