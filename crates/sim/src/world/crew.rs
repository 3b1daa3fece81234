//! Threads that work on the stations of a world at once, each station on one of them.
//!
//! Stations are handed over by value, in parcels behind locks that no thread waits for, and come back to where they were: which
//! thread had which makes no difference to any of them. Each thread begins with its own share, since the state of a station is
//! then in its cache from the last time, and goes on with what others have not begun: a worker that the system lets wait holds up
//! no more than one parcel. A worker without work looks for more for a moment, unless that was in vain the last times, and then
//! sleeps.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread::JoinHandle;

use can::{Bitrate, Frame, Instant};

use super::member::Member;

/// Most threads that a world may have.
const MOST: usize = 64;
/// Parcels that a batch is made into, for each thread: what one is late by is a part of its share.
const PARCELS_EACH: usize = 8;
/// Looks of a worker for new work before it sleeps: some 50 us.
const LOOKS: u32 = 2_000;
/// After so many looks in vain it sleeps at once, and tries again only from time to time.
const IN_VAIN: u32 = 4;
const TRY_AGAIN: u32 = 64;

/// What is done with each station of a batch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Job {
    /// Its deadline has come.
    TimeOut,
    /// Its time is brought up to now.
    Advance,
}

/// A station on its way to a thread and back.
pub(super) struct Errand {
    pub(super) station: usize,
    pub(super) member: Member,
    /// How it is joined to the bus; `None` if its frames are not taken directly.
    pub(super) on_bus: Option<OnBus>,
    pub(super) found: JobResult,
}

/// How a station is joined to the bus.
#[derive(Clone, Copy, Debug)]
pub(super) struct OnBus {
    pub(super) bitrate: Option<Bitrate>,
    pub(super) has_room: bool,
}

/// What a station wants when the job is done.
#[derive(Clone, Copy, Debug)]
pub(super) enum JobResult {
    /// It has to be asked.
    Unknown,
    /// Nothing until then.
    Quiet(Instant),
    /// To send this, and perhaps more.
    Sends(Frame),
}

/// The threads of a world. A copy of a world begins without workers, and has its own when it needs them.
pub(super) struct Crew {
    threads: usize,
    workers: Option<Workers>,
}

struct Workers {
    /// A child of `fork` has the handles of its parent's threads, and none of the threads.
    process: u32,
    shared: Arc<CrewShared>,
    handles: Vec<JoinHandle<()>>,
}

struct CrewShared {
    threads: usize,
    /// A share for each thread, one behind the other.
    parcels: Vec<Parcel>,
    /// Parcels that are not done yet.
    left: AtomicUsize,
    /// How many batches there have been.
    batch: AtomicUsize,
    asleep: AtomicUsize,
    closed: AtomicBool,
    gate: Mutex<()>,
    bell: Condvar,
}

struct Parcel {
    /// The thread that takes this has it.
    open: AtomicBool,
    contents: Mutex<Contents>,
}

struct Contents {
    job: Job,
    now: Instant,
    errands: Vec<Errand>,
    /// A station in it has panicked.
    panicked: bool,
}

impl Crew {
    pub(super) const ALONE: Self = Self { threads: 1, workers: None };

    /// So many threads, the caller's among them; at least one, and 64 at most.
    pub(super) fn set_threads(&mut self, threads: usize) {
        *self = Self { threads: threads.clamp(1, MOST), workers: None };
    }

    pub(super) const fn threads(&self) -> usize {
        self.threads
    }

    /// Does the job on so many errands, several at once. [`take_back`](Self::take_back) follows.
    pub(super) fn work(&mut self, (job, now): (Job, Instant), count: usize, mut errands: impl Iterator<Item = Errand>) {
        let shared = &self.workers.get_or_insert_with(|| Workers::start(self.threads)).shared;
        let parcels = shared.parcels.len();
        // The same stations come to the same parcels as long as the same are due.
        let end_of = |parcel: usize| parcel * count / parcels;
        let size = |parcel: usize| end_of(parcel + 1) - end_of(parcel);
        for (number, parcel) in shared.parcels.iter().enumerate() {
            let mut contents = parcel.contents.lock().unwrap_or_else(PoisonError::into_inner);
            (contents.job, contents.now) = (job, now);
            contents.errands.extend(errands.by_ref().take(size(number)));
        }
        shared.hand_out((0..parcels).filter(|number| size(*number) > 0));
        shared.work(0);
        shared.wait_until_done();
    }

    /// The errands of the last batch in their order.
    ///
    /// # Panics
    /// If one of the stations has, once all are back.
    pub(super) fn take_back(&mut self, mut back: impl FnMut(Errand)) {
        let mut panicked = false;
        for parcel in self.workers.iter().flat_map(|workers| &workers.shared.parcels) {
            let mut contents = parcel.contents.lock().unwrap_or_else(PoisonError::into_inner);
            panicked |= std::mem::take(&mut contents.panicked);
            contents.errands.drain(..).for_each(&mut back);
        }
        assert!(!panicked, "a drive has panicked; this world cannot go on");
    }
}

impl Clone for Crew {
    fn clone(&self) -> Self {
        Self { threads: self.threads, workers: None }
    }
}

impl Workers {
    fn start(threads: usize) -> Self {
        let parcel = |_| {
            let contents = Contents { job: Job::Advance, now: Instant::ZERO, errands: Vec::new(), panicked: false };
            Parcel { open: AtomicBool::new(false), contents: Mutex::new(contents) }
        };
        let shared = Arc::new(CrewShared {
            threads,
            parcels: (0..threads * PARCELS_EACH).map(parcel).collect(),
            left: AtomicUsize::new(0),
            batch: AtomicUsize::new(0),
            asleep: AtomicUsize::new(0),
            closed: AtomicBool::new(false),
            gate: Mutex::new(()),
            bell: Condvar::new(),
        });
        // A system that gives fewer threads gets the same results, later.
        let start = |number| {
            let shared = Arc::clone(&shared);
            std::thread::Builder::new().name(format!("world {number}")).spawn(move || shared.help(number)).ok()
        };
        let handles = (1..threads).filter_map(start).collect();
        Self { process: std::process::id(), shared, handles }
    }
}

impl Drop for Workers {
    fn drop(&mut self) {
        if self.process != std::process::id() {
            // No thread to wait for, and the gate may be held for ever.
            return std::mem::forget(std::mem::take(&mut self.handles));
        }
        self.shared.closed.store(true, Ordering::SeqCst);
        self.shared.wake();
        self.handles.drain(..).for_each(|handle| drop(handle.join()));
    }
}

impl CrewShared {
    fn hand_out(&self, parcels: impl Iterator<Item = usize> + Clone) {
        self.left.store(parcels.clone().count(), Ordering::Relaxed);
        parcels.for_each(|number| self.parcels[number].open.store(true, Ordering::Release));
        // In one order with `asleep`: a worker that goes to sleep now sees this, or is seen.
        self.batch.fetch_add(1, Ordering::SeqCst);
        if self.asleep.load(Ordering::SeqCst) > 0 {
            self.wake();
        }
    }

    fn wake(&self) {
        drop(self.gate.lock());
        self.bell.notify_all();
    }

    /// Does the share of a thread, and then of the others what they come to last.
    fn work(&self, thread: usize) {
        for other in 0..self.threads {
            let share = &self.parcels[(thread + other) % self.threads * PARCELS_EACH..][..PARCELS_EACH];
            if other == 0 {
                share.iter().for_each(|parcel| self.take(parcel));
            } else {
                share.iter().rev().for_each(|parcel| self.take(parcel));
            }
        }
    }

    fn take(&self, parcel: &Parcel) {
        if !parcel.open.load(Ordering::Relaxed) || !parcel.open.swap(false, Ordering::Acquire) {
            return;
        }
        let mut contents = parcel.contents.lock().unwrap_or_else(PoisonError::into_inner);
        let Contents { job, now, ref mut errands, ref mut panicked } = *contents;
        // The batch is finished whatever one of its stations does, so that all of them come back; the world then ends there.
        let work = || errands.iter_mut().for_each(|errand| errand.found = errand.member.work(job, now, errand.on_bus));
        *panicked |= catch_unwind(AssertUnwindSafe(work)).is_err();
        drop(contents);
        self.left.fetch_sub(1, Ordering::Release);
    }

    /// What others have begun is nearly done. Where they have lost their processor it is given to them.
    fn wait_until_done(&self) {
        let mut looks = 0;
        while self.left.load(Ordering::Acquire) > 0 {
            looks += 1;
            if looks < LOOKS { std::hint::spin_loop() } else { std::thread::yield_now() }
        }
    }

    fn help(&self, thread: usize) {
        let (mut seen, mut in_vain) = (0, 0);
        while !self.closed.load(Ordering::SeqCst) {
            let batch = self.batch.load(Ordering::SeqCst);
            if batch != seen {
                seen = batch;
                self.work(thread);
                continue;
            }
            if in_vain < IN_VAIN || in_vain % TRY_AGAIN == 0 {
                let found = (0..LOOKS).any(|_| {
                    std::hint::spin_loop();
                    self.has_news(seen)
                });
                if found {
                    in_vain = 0;
                    continue;
                }
            }
            in_vain += 1;
            self.sleep(seen);
        }
    }

    fn has_news(&self, seen: usize) -> bool {
        self.batch.load(Ordering::SeqCst) != seen || self.closed.load(Ordering::SeqCst)
    }

    fn sleep(&self, seen: usize) {
        let mut gate = self.gate.lock().unwrap_or_else(PoisonError::into_inner);
        self.asleep.fetch_add(1, Ordering::SeqCst);
        while !self.has_news(seen) {
            gate = self.bell.wait(gate).unwrap_or_else(PoisonError::into_inner);
        }
        self.asleep.fetch_sub(1, Ordering::SeqCst);
    }
}
