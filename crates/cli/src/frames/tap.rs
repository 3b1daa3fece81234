//! The frames that a command sends and hears: shown as they pass (`--verbose`), handed to a command that watches, and those of
//! others alone to any part of a command that listens.

use std::collections::VecDeque;
use std::future::poll_fn;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Poll, Waker};
use std::time::Duration;

use can::{BusFrame, Listen};
use master::decode::Decoder;
use tokio::sync::broadcast;

use super::stamp::Stamps;
use crate::progress::Progress;
use plot::Paint;

/// Frames kept for a command that does not come to take them; a further one replaces the oldest.
const KEPT: usize = 1 << 16;
/// Frames of others that wait for a listener; one that is slower misses the oldest.
const HEARD: usize = 1024;

/// What passes the network of a command.
#[derive(Clone)]
pub(crate) struct Traffic {
    passing: Arc<Mutex<Passing>>,
    others: broadcast::Sender<BusFrame>,
}

#[derive(Default)]
struct Passing {
    /// Unix time of the bus's zero.
    unix_zero: Duration,
    shown: Option<ShownFrames>,
    heard: Option<HeardFrames>,
    further: Option<Box<dyn Listen + Send>>,
}

/// Where frames are shown.
struct ShownFrames {
    decoder: Decoder,
    stamps: Stamps,
    progress: Progress,
}

/// Frames for a command.
#[derive(Default)]
struct HeardFrames {
    frames: VecDeque<BusFrame>,
    waker: Option<Waker>,
}

impl Default for Traffic {
    /// The traffic of a bus whose time begins at zero.
    fn default() -> Self {
        Self::since(Duration::ZERO)
    }
}

impl Traffic {
    /// The traffic of a bus whose time began at this Unix time.
    pub(crate) fn since(unix_zero: Duration) -> Self {
        let passing = Arc::new(Mutex::new(Passing { unix_zero, ..Passing::default() }));
        Self { passing, others: broadcast::channel(HEARD).0 }
    }

    /// Unix time of the bus's zero.
    pub(crate) fn unix_zero(&self) -> Duration {
        self.lock().unix_zero
    }

    /// Shows each frame in words on standard error from now on.
    pub(crate) fn show(&self, decoder: Decoder, stamps: Stamps, progress: Progress) {
        self.lock().shown = Some(ShownFrames { decoder, stamps, progress });
    }

    /// The frames that others send from now on, with their times.
    pub(crate) fn of_others(&self) -> broadcast::Receiver<BusFrame> {
        self.others.subscribe()
    }

    /// Keeps frames for [`next`](Self::next) from now on.
    pub(crate) fn listen(&self) {
        self.lock().heard.get_or_insert_default();
    }

    /// Has another listener hear each frame from now on, before this program acts on it.
    pub(crate) fn hand_on(&self, listener: impl Listen + Send + 'static) {
        self.lock().further = Some(Box::new(listener));
    }

    /// The next frame on the bus, of others or of this command, and when it came.
    pub(crate) async fn next(&self) -> BusFrame {
        poll_fn(|context| {
            let mut passing = self.lock();
            let heard = passing.heard.get_or_insert_default();
            match heard.frames.pop_front() {
                Some(passed) => Poll::Ready(passed),
                None => {
                    heard.waker = Some(context.waker().clone());
                    Poll::Pending
                }
            }
        })
        .await
    }

    /// The next frame that has passed, if there is one; as [`next`](Self::next).
    pub(crate) fn take(&self) -> Option<BusFrame> {
        self.lock().heard.as_mut()?.frames.pop_front()
    }

    fn note(&self, passed: BusFrame) {
        let mut passing = self.lock();
        if let Some(ShownFrames { decoder, stamps, progress }) = &mut passing.shown {
            let paint = Paint::for_stream(&std::io::stderr());
            let BusFrame { at, frame, .. } = passed;
            let text = decoder.decode(&frame).to_string();
            progress.line(&format!("{} {:<20}  {text}", paint.dim(&stamps.text(at)), frame.to_string()));
        }
        if let Some(further) = &mut passing.further {
            further.hear(passed);
        }
        let Some(heard) = &mut passing.heard else { return };
        if heard.frames.len() == KEPT {
            heard.frames.pop_front();
        }
        heard.frames.push_back(passed);
        let waker = heard.waker.take();
        drop(passing);
        if let Some(waker) = waker {
            waker.wake();
        }
    }

    fn lock(&self) -> MutexGuard<'_, Passing> {
        // Nothing is half done between two frames, whichever thread panicked.
        self.passing.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Listen for Traffic {
    fn hear(&mut self, passed: BusFrame) {
        self.note(passed);
        if !passed.own && self.others.receiver_count() > 0 {
            // The receiver may have gone.
            let _ = self.others.send(passed);
        }
    }
}
