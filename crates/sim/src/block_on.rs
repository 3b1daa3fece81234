//! Futures in virtual time: a future is polled, and while it waits the world moves on.
//!
//! The future's own handle is a station in the world. Nothing here knows who that is, and no runtime is involved.

use core::time::Duration;
use std::future::poll_fn;
use std::pin::{Pin, pin};
use std::task::Poll;

use can::Instant;

use crate::World;
use crate::task::Task;

/// Virtual time after which [`run_beside`] and [`pass_beside`] give way: with a motor's electrical model some tenths of a millisecond of
/// a desktop's time.
const SLICE: Duration = Duration::from_millis(10);

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
        if let Some(output) = turn(world, &mut task, end)? {
            return Ok(output);
        }
    }
}

/// Polls the future if it was woken, else moves the world on by its next event; the output once there is one.
fn turn<F: Future>(
    world: &mut World,
    task: &mut Task<Pin<&mut F>>,
    end: Instant,
) -> Result<Option<F::Output>, BlockOnError> {
    if let Some(polled) = task.poll_if_woken() {
        world.refresh();
        return Ok(match polled {
            Poll::Ready(output) => Some(output),
            Poll::Pending => None,
        });
    }
    match world.next_event() {
        Some(at) if at <= end => world.step(),
        Some(_) => {
            world.run_until(end);
            return Err(BlockOnError::OutOfTime { at: end });
        }
        None => return Err(BlockOnError::Stalled { at: world.now() }),
    };
    Ok(None)
}

/// As [`block_on`], and gives way to what else runs on the same thread after each 10 ms of virtual time: a world that is computed
/// beside a live bus must not keep signs of life and stops waiting.
///
/// # Errors
/// See [`block_on`].
pub async fn run_beside<F: Future>(world: &mut World, future: F) -> Result<F::Output, BlockOnError> {
    let future = pin!(future);
    let mut task = Task::new(future);
    let mut gave_way = world.now();
    world.refresh();
    loop {
        if let Some(output) = turn(world, &mut task, Instant::FAR_FUTURE)? {
            return Ok(output);
        }
        if world.now() - gave_way >= SLICE {
            gave_way = world.now();
            give_way().await;
        }
    }
}

/// As [`World::run_for`], and gives way like [`run_beside`].
pub async fn pass_beside(world: &mut World, time: Duration) {
    let end = world.now() + time;
    while world.now() < end {
        world.run_until((world.now() + SLICE).min(end));
        give_way().await;
    }
}

/// Once to the executor and back.
async fn give_way() {
    let mut gave_way = false;
    poll_fn(|context| {
        if std::mem::replace(&mut gave_way, true) {
            return Poll::Ready(());
        }
        context.waker().wake_by_ref();
        Poll::Pending
    })
    .await;
}

#[cfg(test)]
mod tests {
    use can::Bitrate;

    use super::*;

    #[test]
    fn a_world_beside_gives_way_after_each_slice_and_moves_as_one_that_is_waited_for() {
        let mut world = World::new(Bitrate::M1, 1);
        let mut polls = 0;
        {
            let mut passing = pin!(pass_beside(&mut world, Duration::from_millis(95)));
            let mut task = Task::new(passing.as_mut());
            while let Some(Poll::Pending) = task.poll_if_woken() {
                polls += 1;
            }
        }
        assert_eq!(polls, 10, "ten slices, of which the last is half a one");
        assert_eq!(world.now(), Instant::from_millis(95));
        // Nothing can wake it, and nothing happens in this world.
        let stalled = block_on(&mut World::new(Bitrate::M1, 1), run_beside(&mut world, std::future::pending::<()>()));
        assert!(matches!(stalled, Ok(Err(BlockOnError::Stalled { .. }))), "{stalled:?}");
    }
}
