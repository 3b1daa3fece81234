//! A master on a real bus: a thread that runs it, and the jobs it is given.
//!
//! The thread ends with its handle. Before it does, what it was asked is given up, every drive that this program has set in
//! motion is quick-stopped, the guards of those that stand are released, and what captures have changed is put back.

use can::Tap;
use host::capture::WaysBack;
use host::stopping::{still_moving, stop};
use master::Network;
use serve::live::{LiveBus, LostBus};
use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use tokio::sync::mpsc;
use tokio::task::{JoinSet, LocalSet};
use transport::{BusNotes, BusSpec, Note};
use words::failure::with_causes;

use crate::master::tap::Traffic;
use crate::world::Job;

/// What the bus says that may wait for a program: each kind comes once, only a connection may come and go for ever.
const MOST_WAITING: usize = 64;

/// A master that a thread runs.
pub(crate) struct Live {
    jobs: Option<mpsc::UnboundedSender<Job>>,
    thread: Option<JoinHandle<()>>,
    said: Arc<ThreadMessages>,
}

/// What the thread reports of its bus.
struct ThreadMessages(Mutex<Words>);

struct Words {
    notes: BusNotes,
    /// What no program has taken yet.
    waiting: VecDeque<String>,
    /// Why the bus is gone.
    ended: Option<String>,
    /// What was not seen to stand when the thread ended.
    moving: Vec<String>,
}

impl ThreadMessages {
    fn of(spec: &BusSpec) -> Self {
        Self(Mutex::new(Words { notes: BusNotes::of(spec), waiting: VecDeque::new(), ended: None, moving: Vec::new() }))
    }

    fn lock(&self) -> MutexGuard<'_, Words> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn note(&self, note: &Note) {
        let mut words = self.lock();
        let Some(text) = words.notes.news(note) else { return };
        if words.waiting.len() == MOST_WAITING {
            words.waiting.pop_front();
        }
        words.waiting.push_back(text);
    }
}

/// How the opening of a bus went, once that is known.
type Opened = Arc<(Mutex<Option<Result<(), String>>>, Condvar)>;

impl Live {
    /// Opens a bus and runs the master on it.
    ///
    /// # Errors
    /// Why the bus does not open.
    pub(crate) fn open(spec: BusSpec, network: Network, traffic: Traffic, ways_back: WaysBack) -> Result<Self, String> {
        let (jobs, incoming) = mpsc::unbounded_channel();
        let opened = Opened::default();
        let said = Arc::new(ThreadMessages::of(&spec));
        let (reported, noted) = (Arc::clone(&opened), Arc::clone(&said));
        let thread = thread::Builder::new().name("ferrodrive master".into());
        let thread = thread.spawn(move || run(&spec, (network, traffic, ways_back), incoming, &reported, &noted));
        let thread = thread.map_err(|error| format!("cannot start a thread: {error}"))?;
        let mut result = opened.0.lock().unwrap_or_else(PoisonError::into_inner);
        let result = loop {
            match result.take() {
                Some(result) => break result,
                None => result = opened.1.wait(result).unwrap_or_else(PoisonError::into_inner),
            }
        };
        result.map(|()| Self { jobs: Some(jobs), thread: Some(thread), said })
    }

    /// Begins a job.
    ///
    /// # Errors
    /// Why the bus is gone.
    pub(crate) fn begin(&self, job: Job) -> Result<(), String> {
        let refusal = || self.lost().unwrap_or_else(|| "the network is closed".into());
        self.jobs.as_ref().ok_or_else(refusal)?.send(job).map_err(|_| refusal())
    }

    /// Why there is no bus: it was closed after an error, or its connection is being made again.
    pub(crate) fn lost(&self) -> Option<String> {
        let words = self.said.lock();
        words.ended.clone().or_else(|| words.notes.lost().map(str::to_owned))
    }

    /// What the bus has said beside frames since the last call, with what to do about it.
    pub(crate) fn take_notes(&self) -> Vec<String> {
        self.said.lock().waiting.drain(..).collect()
    }

    /// Stops what moves and ends the thread; what was not seen to stand, in words.
    pub(crate) fn close(&mut self) -> Vec<String> {
        self.jobs = None;
        if let Some(thread) = self.thread.take() {
            // A thread that panicked has nothing left to say.
            let _ = thread.join();
        }
        std::mem::take(&mut self.said.lock().moving)
    }
}

impl Drop for Live {
    fn drop(&mut self) {
        self.close();
    }
}

/// The thread: opens the bus, says how that went, and runs until the handle is gone or the bus is lost.
fn run(
    spec: &BusSpec,
    (network, traffic, ways_back): (Network, Traffic, WaysBack),
    incoming: mpsc::UnboundedReceiver<Job>,
    opened: &Opened,
    said: &ThreadMessages,
) {
    let report = |result: Result<(), String>| {
        *opened.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(result);
        opened.1.notify_all();
    };
    let runtime = match tokio::runtime::Builder::new_current_thread().enable_all().build() {
        Ok(runtime) => runtime,
        Err(error) => return report(Err(format!("cannot start the runtime: {error}"))),
    };
    let local = LocalSet::new();
    runtime.block_on(local.run_until(async {
        let bus = match LiveBus::open(spec, false).await {
            Ok(bus) => bus,
            Err(error) => return report(Err(with_causes(&error))),
        };
        report(Ok(()));
        let station = Tap::new(network.clone(), traffic);
        let work = work_through(&network, &ways_back, incoming);
        match bus.run((&network, THIS), station, work, |_, note| said.note(note)).await {
            Ok(moving) => said.lock().moving = moving,
            Err(LostBus { error, moving }) => {
                let mut words = said.lock();
                (words.moving, words.ended) = (still_moving(moving), Some(with_causes(&error)));
            }
        }
    }));
}

/// Does the jobs that come, side by side, until no sender is left; then drops them and stops what moves.
async fn work_through(
    network: &Network,
    ways_back: &WaysBack,
    mut incoming: mpsc::UnboundedReceiver<Job>,
) -> Vec<String> {
    let mut running = JoinSet::new();
    loop {
        tokio::select! {
            job = incoming.recv() => match job {
                Some(job) => drop(running.spawn_local(job)),
                None => break,
            },
            // What has ended needs no place.
            Some(_) = running.join_next() => {}
        }
    }
    running.shutdown().await;
    let mut left = stop_what_moves(network).await;
    left.extend(ways_back.restore().await);
    left
}

/// Who lets go of drives here.
const THIS: &str = "this program";

/// Stops what moves; what was not seen to stand, in words.
pub(crate) async fn stop_what_moves(network: &Network) -> Vec<String> {
    still_moving(stop(network, THIS).await)
}
