//! Futures in virtual time: a future is polled, and while it waits the world moves on.
//!
//! The future's own handle is a station in the world. Nothing here knows who that is, and no runtime is involved.

use core::time::Duration;
use std::pin::pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::{Context, Poll, Wake, Waker};

use can::Instant;

use crate::World;

/// Why a future did not finish.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BlockOnError {
    /// The future waits, nothing woke it, and nothing will ever happen in the world again.
    #[error("stalled at {at} s: the future waits, but nothing is left to happen in the world")]
    Stalled {
        /// The world's time.
        at: Instant,
    },
    /// The time allowed has passed.
    #[error("not finished at {at} s of virtual time, the time allowed")]
    OutOfTime {
        /// The world's time.
        at: Instant,
    },
}

/// Runs `future` to its end, moving the world on whenever it waits.
///
/// The future talks to the world through a station in it (a handle to a master, say), which the world
/// looks at again after each poll. It is polled only when its waker was called.
///
/// # Errors
/// [`BlockOnError::Stalled`] if nothing can ever wake it. In a world where something always happens
/// (heartbeats, say) a future that waits for ever runs for ever: use [`block_on_for`] there.
pub fn block_on<F: Future>(world: &mut World, future: F) -> Result<F::Output, BlockOnError> {
    block_on_until(world, Instant::FAR_FUTURE, future)
}

/// As [`block_on`], for at most `limit` of virtual time.
///
/// # Errors
/// [`BlockOnError::OutOfTime`] when `limit` has passed; the world then stands at that time.
pub fn block_on_for<F: Future>(world: &mut World, limit: Duration, future: F) -> Result<F::Output, BlockOnError> {
    let end = world.now() + limit;
    block_on_until(world, end, future)
}

fn block_on_until<F: Future>(world: &mut World, end: Instant, future: F) -> Result<F::Output, BlockOnError> {
    let mut future = pin!(future);
    let woken = Arc::new(Woken(AtomicBool::new(true)));
    let waker = Waker::from(Arc::clone(&woken));
    let mut context = Context::from_waker(&waker);
    world.refresh();
    loop {
        if woken.0.swap(false, Ordering::AcqRel) {
            if let Poll::Ready(output) = future.as_mut().poll(&mut context) {
                world.refresh();
                return Ok(output);
            }
            world.refresh();
            continue;
        }
        match world.next_event() {
            Some(at) if at <= end => world.step(),
            Some(_) => {
                world.run_until(end);
                return Err(BlockOnError::OutOfTime { at: end });
            }
            None => return Err(BlockOnError::Stalled { at: world.now() }),
        };
    }
}

/// Remembers that the waker was called.
struct Woken(AtomicBool);

impl Wake for Woken {
    fn wake(self: Arc<Self>) {
        self.0.store(true, Ordering::Release);
    }

    fn wake_by_ref(self: &Arc<Self>) {
        self.0.store(true, Ordering::Release);
    }
}
