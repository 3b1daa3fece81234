//! What is open, as its jobs share it: a group or a base, which one job steps in each cycle and others command.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use master::base::Base;
use master::group::Group;
use master::{Exchange, Network};

use super::job::Trouble;
use super::value::Value;

/// What is stepped in each cycle.
pub(super) trait Stepped: Send + 'static {
    fn step_once(&mut self, io: &mut Exchange<'_>);

    /// Has it come to rest, from the next cycle on.
    fn stop(&mut self);
}

impl Stepped for Group {
    fn step_once(&mut self, io: &mut Exchange<'_>) {
        self.step(io);
    }

    fn stop(&mut self) {
        self.start_stop();
    }
}

impl Stepped for Base {
    fn step_once(&mut self, io: &mut Exchange<'_>) {
        self.step(io);
    }

    fn stop(&mut self) {
        if !self.is_stopping() {
            self.start_stop();
        }
    }
}

/// A group or a base, as the jobs share it.
pub(super) struct Slot<T> {
    inner: Arc<Inner<T>>,
}

struct Inner<T> {
    /// Empty before it was opened, and once it was closed.
    open: Mutex<Option<T>>,
    closed: AtomicBool,
}

impl<T> Clone for Slot<T> {
    fn clone(&self) -> Self {
        Self { inner: Arc::clone(&self.inner) }
    }
}

impl<T: Stepped> Slot<T> {
    pub(super) fn empty() -> Self {
        Self { inner: Arc::new(Inner { open: Mutex::new(None), closed: AtomicBool::new(false) }) }
    }

    fn lock(&self) -> MutexGuard<'_, Option<T>> {
        self.inner.open.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What was opened, to be commanded from here on.
    pub(super) fn fill(&self, opened: T) {
        *self.lock() = Some(opened);
    }

    /// Does something with what is open.
    pub(super) fn with<R>(&self, ask: impl FnOnce(&mut T) -> Result<R, Trouble>) -> Result<R, Trouble> {
        self.lock().as_mut().map_or_else(
            || Err(Trouble::Said("it was closed: open it again, network.group(..) or network.base(..)".into())),
            ask,
        )
    }

    /// Has it come to rest when this is dropped: however a job ends that moves it, done, failed or given up.
    pub(super) fn stop_on_drop(&self) -> StopOnDrop<'_, T> {
        StopOnDrop(self)
    }

    pub(super) fn close(&self) -> Option<T> {
        self.inner.closed.store(true, Ordering::Relaxed);
        self.lock().take()
    }

    /// One cycle after the other, until it is closed or SYNC ends: then the master has stopped the drives.
    pub(super) async fn keep(self, core: Network) -> Result<Value, Trouble> {
        while core.next_sync().await.is_ok() && !self.inner.closed.load(Ordering::Relaxed) {
            if let Some(open) = self.lock().as_mut() {
                core.exchange(|io| open.step_once(io));
            }
        }
        Ok(Value::None)
    }
}

/// Made by [`Slot::stop_on_drop`].
pub(super) struct StopOnDrop<'a, T: Stepped>(&'a Slot<T>);

impl<T: Stepped> Drop for StopOnDrop<'_, T> {
    fn drop(&mut self) {
        if let Some(open) = self.0.lock().as_mut() {
            open.stop();
        }
    }
}
