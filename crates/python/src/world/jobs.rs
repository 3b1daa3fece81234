//! What the master does in a world: futures that are polled while the world moves.

use std::pin::Pin;

use pyo3::PyResult;
use sim::task::Task;

use crate::failure::wrong_use;

/// A piece of the master's work. It leaves its result where its owner finds it.
pub(crate) type Job = Pin<Box<dyn Future<Output = ()> + Send>>;

/// The jobs of one world, in the order in which they were begun.
#[derive(Default)]
pub(crate) struct Jobs {
    running: Vec<RunningJob>,
    begun: u64,
    /// A master is in the world. It is shared with every copy, so there must be none.
    has_master: bool,
}

struct RunningJob {
    number: u64,
    /// Whose it is.
    owner: usize,
    task: Task<Job>,
}

impl Jobs {
    /// A master has joined the world.
    pub(crate) fn note_master(&mut self) {
        self.has_master = true;
    }

    /// Begins a job of this owner; returns its number.
    pub(crate) fn begin(&mut self, owner: usize, job: Job) -> u64 {
        self.begun += 1;
        self.running.push(RunningJob { number: self.begun, owner, task: Task::new(job) });
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
        while let Some((at, polled)) = self.running.iter_mut().enumerate().find_map(|(at, running)| {
            let polled = running.task.poll_if_woken()?;
            Some((at, polled))
        }) {
            world.refresh();
            if polled.is_ready() {
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
