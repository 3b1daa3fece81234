//! The frames that pass, for the cases to look at.

use std::collections::VecDeque;
use std::future::poll_fn;
use std::pin::pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Poll, Waker};

use can::{BusFrame, Instant, Listen};
use master::Network;

/// Frames that wait for a case; a further one replaces the oldest.
const KEPT: usize = 1 << 14;

/// The frames of a bus, of others and of this program, since they were last taken. All clones share them.
#[derive(Clone, Debug, Default)]
pub struct Capture {
    shared: Arc<Mutex<Captured>>,
}

#[derive(Debug, Default)]
struct Captured {
    frames: VecDeque<BusFrame>,
    waker: Option<Waker>,
}

impl Capture {
    /// Nothing has passed yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// The next frame that passes, or `None` at `end`.
    pub(crate) async fn next(&self, network: &Network, end: Instant) -> Option<BusFrame> {
        let mut sleep = pin!(network.sleep(end - network.now()));
        poll_fn(|context| {
            let mut shared = self.lock();
            if let Some(frame) = shared.frames.pop_front() {
                return Poll::Ready(Some(frame));
            }
            shared.waker = Some(context.waker().clone());
            drop(shared);
            sleep.as_mut().poll(context).map(|()| None)
        })
        .await
    }

    /// A frame that has passed.
    pub(crate) fn take(&self) -> Option<BusFrame> {
        self.lock().frames.pop_front()
    }

    fn lock(&self) -> MutexGuard<'_, Captured> {
        // Nothing is half done between two frames.
        self.shared.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Listen for Capture {
    fn hear(&mut self, passed: BusFrame) {
        let mut shared = self.lock();
        if shared.frames.len() == KEPT {
            shared.frames.pop_front();
        }
        shared.frames.push_back(passed);
        let waker = shared.waker.take();
        drop(shared);
        if let Some(waker) = waker {
            waker.wake();
        }
    }
}
