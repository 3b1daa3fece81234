//! A future that is polled beside a world: only when its waker was called.

use std::pin::Pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::{Context, Poll, Wake, Waker};

/// A future that the mover of a [`World`](crate::World) polls between its steps. `F` is a pinned pointer to it, a `Box` where
/// it is kept.
///
/// After a poll the world has to look again at the stations whose handles the future has: [`World::refresh`](crate::World::refresh).
#[derive(Debug)]
pub struct Task<F> {
    future: F,
    woken: Arc<Woken>,
}

impl<F: Future + ?Sized, P: core::ops::DerefMut<Target = F>> Task<Pin<P>> {
    /// A task that is due to be polled a first time.
    pub fn new(future: Pin<P>) -> Self {
        Self { future, woken: Arc::new(Woken(AtomicBool::new(true))) }
    }

    /// Polls the future if its waker was called since the last poll; `None` if it was not.
    pub fn poll_if_woken(&mut self) -> Option<Poll<F::Output>> {
        let due = self.woken.0.swap(false, Ordering::AcqRel);
        due.then(|| {
            let waker = Waker::from(Arc::clone(&self.woken));
            self.future.as_mut().poll(&mut Context::from_waker(&waker))
        })
    }
}

/// Remembers that the waker was called.
#[derive(Debug)]
struct Woken(AtomicBool);

impl Wake for Woken {
    fn wake(self: Arc<Self>) {
        self.wake_by_ref();
    }

    fn wake_by_ref(self: &Arc<Self>) {
        self.0.store(true, Ordering::Release);
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;
    use std::future::poll_fn;
    use std::pin::pin;

    use super::*;

    #[test]
    fn a_future_is_polled_once_for_each_wake() {
        let (polls, waker) = (Cell::new(0), Cell::new(None));
        let future = pin!(poll_fn(|context: &mut Context<'_>| {
            polls.set(polls.get() + 1);
            waker.set(Some(context.waker().clone()));
            if polls.get() < 3 { Poll::Pending } else { Poll::Ready(7) }
        }));
        let mut task = Task::new(future);
        assert_eq!(task.poll_if_woken(), Some(Poll::Pending), "begun");
        assert_eq!((task.poll_if_woken(), polls.get()), (None, 1), "nothing has woken it");
        let wake = || waker.take().unwrap().wake();
        wake();
        assert_eq!((task.poll_if_woken(), task.poll_if_woken(), polls.get()), (Some(Poll::Pending), None, 2));
        wake();
        assert_eq!(task.poll_if_woken(), Some(Poll::Ready(7)));
    }
}
