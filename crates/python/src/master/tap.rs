//! The frames that pass a master, for those of its jobs that listen. While none listens a frame costs a look at a counter.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use can::{Frame, Instant, Station};
use master::Network;

/// Frames that are kept for a job that does not come to take them; a further one replaces the oldest.
const KEPT: usize = 1 << 16;

/// A network whose frames are heard as they pass.
#[derive(Clone)]
pub(crate) struct Tap {
    network: Network,
    traffic: Traffic,
}

/// What passes a [`Tap`].
#[derive(Clone, Default)]
pub(crate) struct Traffic(Arc<Shared>);

#[derive(Default)]
struct Shared {
    listening: AtomicUsize,
    ears: Mutex<Vec<Arc<Ear>>>,
}

struct Ear {
    /// The frames of this program too, not of others alone.
    own: bool,
    frames: Mutex<VecDeque<(Instant, Frame)>>,
}

/// A listener, until it is dropped.
pub(crate) struct Listener {
    traffic: Traffic,
    ear: Arc<Ear>,
}

impl Tap {
    /// A station that is `network`, and whose frames pass `traffic`.
    pub(crate) fn new(network: Network, traffic: Traffic) -> Self {
        Self { network, traffic }
    }
}

impl Traffic {
    /// Listens to the frames of others from now on, and with `own` to those of this program.
    pub(crate) fn listen(&self, own: bool) -> Listener {
        let ear = Arc::new(Ear { own, frames: Mutex::default() });
        self.ears().push(Arc::clone(&ear));
        self.0.listening.fetch_add(1, Ordering::Relaxed);
        Listener { traffic: self.clone(), ear }
    }

    fn ears(&self) -> MutexGuard<'_, Vec<Arc<Ear>>> {
        self.0.ears.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn note(&self, frame: &Frame, now: Instant, own: bool) {
        if self.0.listening.load(Ordering::Relaxed) == 0 {
            return;
        }
        for ear in self.ears().iter().filter(|ear| ear.own || !own) {
            let mut frames = ear.frames();
            if frames.len() == KEPT {
                frames.pop_front();
            }
            frames.push_back((now, *frame));
        }
    }
}

impl Ear {
    fn frames(&self) -> MutexGuard<'_, VecDeque<(Instant, Frame)>> {
        self.frames.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Listener {
    /// The next frame that was heard and not taken yet.
    pub(crate) fn take(&self) -> Option<(Instant, Frame)> {
        self.ear.frames().pop_front()
    }
}

impl Drop for Listener {
    fn drop(&mut self) {
        self.traffic.0.listening.fetch_sub(1, Ordering::Relaxed);
        self.traffic.ears().retain(|ear| !Arc::ptr_eq(ear, &self.ear));
    }
}

impl Station for Tap {
    fn handle_frame(&mut self, frame: &Frame, now: Instant) {
        self.traffic.note(frame, now, false);
        self.network.handle_frame(frame, now);
    }

    fn handle_timeout(&mut self, now: Instant) {
        self.network.handle_timeout(now);
    }

    fn poll_transmit(&mut self) -> Option<Frame> {
        self.network.poll_transmit()
    }

    fn poll_timeout(&self) -> Option<Instant> {
        self.network.poll_timeout()
    }

    fn handle_bus_off(&mut self, off: bool, now: Instant) {
        self.network.handle_bus_off(off, now);
    }

    fn handle_transmitted(&mut self, frame: &Frame, now: Instant) {
        self.traffic.note(frame, now, true);
        self.network.handle_transmitted(frame, now);
    }
}
