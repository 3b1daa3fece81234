//! The frames that pass a master, for those of its jobs that listen. While none listens a frame costs a look at a counter.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use can::{BusFrame, Listen};

/// Frames that are kept for a job that does not come to take them; a further one replaces the oldest.
const KEPT: usize = 1 << 16;

/// What passes a master.
#[derive(Clone, Default)]
pub(crate) struct Traffic(Arc<TapState>);

#[derive(Default)]
struct TapState {
    listening: AtomicUsize,
    ears: Mutex<Vec<Arc<Ear>>>,
}

struct Ear {
    /// The frames of this program too, not of others alone.
    own: bool,
    frames: Mutex<VecDeque<BusFrame>>,
}

/// A listener, until it is dropped.
pub(crate) struct Listener {
    traffic: Traffic,
    ear: Arc<Ear>,
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
}

impl Listen for Traffic {
    fn hear(&mut self, passed: BusFrame) {
        if self.0.listening.load(Ordering::Relaxed) == 0 {
            return;
        }
        for ear in self.ears().iter().filter(|ear| ear.own || !passed.own) {
            let mut frames = ear.frames();
            if frames.len() == KEPT {
                frames.pop_front();
            }
            frames.push_back(passed);
        }
    }
}

impl Ear {
    fn frames(&self) -> MutexGuard<'_, VecDeque<BusFrame>> {
        self.frames.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Listener {
    /// The next frame that was heard and not taken yet.
    pub(crate) fn take(&self) -> Option<BusFrame> {
        self.ear.frames().pop_front()
    }
}

impl Drop for Listener {
    fn drop(&mut self) {
        self.traffic.0.listening.fetch_sub(1, Ordering::Relaxed);
        self.traffic.ears().retain(|ear| !Arc::ptr_eq(ear, &self.ear));
    }
}
