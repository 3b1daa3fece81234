use core::fmt;
use core::future::{Future, poll_fn};
use core::pin::{Pin, pin};
use core::task::{Context, Poll};
use std::time::Duration;

use can::Instant;
use canopen::{Mux, NodeId};

use super::handle::{Network, NetworkState, Slot, Watcher};
use crate::core::{Command, Core, NodeFacts, Outcome, Received, Request, Ticket};

/// A request or timer that is started by the first poll. Dropping it cancels it: an SDO transfer that is on the
/// wire is aborted.
#[must_use = "futures do nothing unless awaited"]
pub(super) struct Pending {
    network: Network,
    state: RequestState,
}

enum RequestState {
    Unstarted(Box<Start>),
    Started(Ticket),
    Finished,
}

enum Start {
    Request(Request),
    Timer(Duration),
}

impl Pending {
    pub(super) fn request(network: Network, request: Request) -> Self {
        Self { network, state: RequestState::Unstarted(Box::new(Start::Request(request))) }
    }

    pub(super) fn timer(network: Network, duration: Duration) -> Self {
        Self { network, state: RequestState::Unstarted(Box::new(Start::Timer(duration))) }
    }
}

impl Future for Pending {
    type Output = Outcome;

    fn poll(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Outcome> {
        match core::mem::replace(&mut self.state, RequestState::Finished) {
            RequestState::Unstarted(start) => {
                let ticket = self.network.lock().start(context);
                self.state = RequestState::Started(ticket);
                self.network.submit(match *start {
                    Start::Request(request) => Command::Request(ticket, request),
                    Start::Timer(duration) => Command::Timer(ticket, duration),
                });
                Poll::Pending
            }
            RequestState::Started(ticket) => {
                let outcome = self.network.lock().poll_slot(ticket, context);
                if outcome.is_pending() {
                    self.state = RequestState::Started(ticket);
                }
                outcome
            }
            // Polled after it had finished: nothing more will come.
            RequestState::Finished => Poll::Pending,
        }
    }
}

impl Drop for Pending {
    fn drop(&mut self) {
        if let RequestState::Started(ticket) = self.state {
            self.network.withdraw(ticket);
        }
    }
}

impl NetworkState {
    fn start(&mut self, context: &mut Context<'_>) -> Ticket {
        let ticket = self.core.ticket();
        self.slots.insert(ticket, Slot::Waiting(context.waker().clone()));
        ticket
    }

    fn poll_slot(&mut self, ticket: Ticket, context: &mut Context<'_>) -> Poll<Outcome> {
        if let Some(Slot::Waiting(waker)) = self.slots.get_mut(&ticket) {
            // Mostly the same one again.
            waker.clone_from(context.waker());
            return Poll::Pending;
        }
        match self.slots.remove(&ticket) {
            Some(Slot::Done(outcome)) => Poll::Ready(outcome),
            _ => Poll::Pending,
        }
    }
}

impl Network {
    /// Waits this long, in the time of the bus.
    pub fn sleep(&self, duration: Duration) -> Sleep {
        Sleep(Pending::timer(self.clone(), duration))
    }

    /// Awaits something for at most this long, in the time of the bus; `None` if it takes longer, and it is given up then.
    pub(crate) async fn within<T>(&self, time: Duration, what: impl Future<Output = T>) -> Option<T> {
        let (mut what, mut end) = (pin!(what), pin!(self.sleep(time)));
        poll_fn(|context| match what.as_mut().poll(context) {
            Poll::Ready(output) => Poll::Ready(Some(output)),
            Poll::Pending => end.as_mut().poll(context).map(|()| None),
        })
        .await
    }
}

/// Ends when its time has passed on the bus. See [`Network::sleep`].
#[must_use = "futures do nothing unless awaited"]
pub struct Sleep(Pending);

impl Future for Sleep {
    type Output = ();

    fn poll(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<()> {
        Pin::new(&mut self.0).poll(context).map(|_| ())
    }
}

impl fmt::Debug for Sleep {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Sleep").finish_non_exhaustive()
    }
}

/// Waits until a condition on a node's facts holds: `Ok` with its value, `Err` when the time is over.
/// See [`super::Node::wait`].
#[must_use = "futures do nothing unless awaited"]
pub struct Wait<F> {
    network: Network,
    node: NodeId,
    condition: F,
    ticket: Ticket,
    timer: Pending,
}

impl<F> Wait<F> {
    pub(super) fn new(network: Network, node: NodeId, condition: F, timeout: Duration) -> Self {
        let ticket = network.lock().core.ticket();
        let timer = Pending::timer(network.clone(), timeout);
        Self { network, node, condition, ticket, timer }
    }
}

/// The time given to a [`Wait`] is over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Elapsed;

/// What a condition sees of the node that it waits for.
#[derive(Clone, Copy, Debug)]
pub struct NodeView<'a> {
    /// What has been seen of it.
    pub facts: &'a NodeFacts,
    node: NodeId,
    core: &'a Core,
}

impl NodeView<'_> {
    /// The newest value of an object that it sends by PDO.
    pub fn received(&self, mux: Mux) -> Option<Received> {
        self.core.image().value(self.node, mux)
    }

    /// The latest time that the runner has passed.
    pub const fn now(&self) -> Instant {
        self.core.now()
    }
}

impl<T, F: FnMut(&NodeView<'_>) -> Option<T> + Unpin> Future for Wait<F> {
    type Output = Result<T, Elapsed>;

    fn poll(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Self::Output> {
        let this = self.get_mut();
        {
            let mut shared = this.network.lock();
            let view = NodeView { facts: shared.core.facts(this.node), node: this.node, core: &shared.core };
            if let Some(value) = (this.condition)(&view) {
                return Poll::Ready(Ok(value));
            }
            let waker = context.waker().clone();
            shared.watchers.retain(|watcher| watcher.ticket != this.ticket);
            shared.watchers.push(Watcher { node: this.node, ticket: this.ticket, waker });
        }
        Pin::new(&mut this.timer).poll(context).map(|_| Err(Elapsed))
    }
}

impl<F> Drop for Wait<F> {
    fn drop(&mut self) {
        self.network.lock().watchers.retain(|watcher| watcher.ticket != self.ticket);
    }
}

impl<F> fmt::Debug for Wait<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Wait").field("node", &self.node).finish_non_exhaustive()
    }
}
