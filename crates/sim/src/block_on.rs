//! Futures in virtual time: a future is polled, and while it waits the world moves on.
//!
//! The future's own handle is a station in the world. Nothing here knows who that is, and no runtime is involved.

use core::time::Duration;
use std::pin::pin;
use std::task::Poll;

use can::Instant;

use crate::World;
use crate::task::Task;

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
    let future = pin!(future);
    let mut task = Task::new(future);
    world.refresh();
    loop {
        if let Some(polled) = task.poll_if_woken() {
            world.refresh();
            match polled {
                Poll::Ready(output) => return Ok(output),
                Poll::Pending => continue,
            }
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
