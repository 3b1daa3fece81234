//! What the master does in a world: futures that are polled while the world moves.

use std::pin::Pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::{Context, Wake, Waker};

use pyo3::PyResult;

use crate::failure::wrong_use;

/// A piece of the master's work. It leaves its result where its owner finds it.
pub(crate) type Job = Pin<Box<dyn Future<Output = ()> + Send>>;

/// The jobs of one world, in the order in which they were begun.
#[derive(Default)]
pub(crate) struct Jobs {
    running: Vec<Running>,
    begun: u64,
    /// A master is in the world. It is shared with every copy, so there must be none.
    has_master: bool,
}

struct Running {
    number: u64,
    /// Whose it is.
    owner: usize,
    job: Job,
    woken: Arc<Woken>,
}

impl Jobs {
    /// A master has joined the world.
    pub(crate) fn note_master(&mut self) {
        self.has_master = true;
    }

    /// Begins a job of this owner; returns its number.
    pub(crate) fn begin(&mut self, owner: usize, job: Job) -> u64 {
        self.begun += 1;
        self.running.push(Running { number: self.begun, owner, job, woken: Arc::new(Woken(AtomicBool::new(true))) });
        self.begun
    }

    /// Gives a job up: what it asked for is taken back.
    pub(crate) fn cancel(&mut self, number: u64) {
        self.running.retain(|running| running.number != number);
    }

    /// Gives every job of this owner up.
    pub(crate) fn cancel_all_of(&mut self, owner: usize) {
        self.running.retain(|running| running.owner != owner);
    }

    /// Polls every job that was woken, until none is; returns the first that has ended.
    pub(super) fn poll(&mut self, world: &mut sim::World) -> Option<u64> {
        while let Some(at) = self.running.iter().position(|running| running.woken.0.swap(false, Ordering::AcqRel)) {
            let running = &mut self.running[at];
            let waker = Waker::from(Arc::clone(&running.woken));
            let ended = running.job.as_mut().poll(&mut Context::from_waker(&waker)).is_ready();
            world.refresh();
            if ended {
                return Some(self.running.remove(at).number);
            }
        }
        None
    }

    /// An error if a copy of the world would share something with it.
    pub(super) fn check_copyable(&self) -> PyResult<()> {
        if !self.has_master {
            return Ok(());
        }
        Err(wrong_use(
            "a world with a master in it cannot be copied or restored: the master would be in both; \
             take the snapshot before Network(world)",
        ))
    }
}

/// Remembers that the waker was called.
struct Woken(AtomicBool);

impl Wake for Woken {
    fn wake(self: Arc<Self>) {
        self.0.store(true, Ordering::Release);
    }
}
