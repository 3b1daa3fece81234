//! The world around virtual drives: requests to its run loop, which answers between two steps.
//!
//! Bounded: a request that finds no room is refused. Unanswered ones end with the world.

use crate::around::{self, Around, Changed};
use serde_json::Value;
use sim::recorder::LiveValues;
use tokio::sync::{mpsc, oneshot};

/// Queued requests.
const MOST_WAITING: usize = 64;

/// The host's end.
#[derive(Clone, Debug)]
pub struct WorldDoor {
    asks: mpsc::Sender<Ask>,
    values: Option<LiveValues>,
}

/// The end of the world's run loop.
#[derive(Debug)]
pub struct WorldAsks(mpsc::Receiver<Ask>);

/// Both ends of the channel to a world; with what can be sampled of it, where it is one of this program.
pub fn world_door(values: Option<LiveValues>) -> (WorldDoor, WorldAsks) {
    let (asks, asked) = mpsc::channel(MOST_WAITING);
    (WorldDoor { asks, values }, WorldAsks(asked))
}

/// A request, and the sender of its answer.
#[derive(Debug)]
pub struct Asked(Ask);

#[derive(Debug)]
enum Ask {
    Forms(oneshot::Sender<Vec<&'static str>>),
    Look(oneshot::Sender<Value>),
    Change(String, oneshot::Sender<Result<Changed, (&'static str, String)>>),
}

/// The world has ended, or too many requests are queued.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct NoAnswer;

impl WorldDoor {
    /// What can be sampled of the world while it runs.
    pub const fn values(&self) -> Option<&LiveValues> {
        self.values.as_ref()
    }

    /// The usage texts.
    pub(crate) fn forms(&self) -> impl Future<Output = Result<Vec<&'static str>, NoAnswer>> + use<> {
        self.ask(Ask::Forms)
    }

    /// The true state of everything.
    pub(crate) fn look(&self) -> impl Future<Output = Result<Value, NoAnswer>> + use<> {
        self.ask(Ask::Look)
    }

    /// Executes a command line, whether or not the answer is awaited.
    pub(crate) fn change(
        &self,
        line: String,
    ) -> impl Future<Output = Result<Result<Changed, (&'static str, String)>, NoAnswer>> + use<> {
        self.ask(|answer| Ask::Change(line, answer))
    }

    fn ask<T, A>(&self, ask: A) -> impl Future<Output = Result<T, NoAnswer>> + use<T, A>
    where
        A: FnOnce(oneshot::Sender<T>) -> Ask,
    {
        let (answer, answered) = oneshot::channel();
        let sent = self.asks.try_send(ask(answer)).map_err(|_| NoAnswer);
        async move {
            sent?;
            answered.await.map_err(|_| NoAnswer)
        }
    }
}

impl WorldAsks {
    /// Waits for a request (blocks the thread) and answers it; false when no host is left.
    pub fn answer_next(&mut self, world: &mut impl Around) -> bool {
        self.0.blocking_recv().map(|ask| ask.answer(world)).is_some()
    }

    /// The next request; `None` when no host is left.
    pub async fn next(&mut self) -> Option<Asked> {
        self.0.recv().await.map(Asked)
    }

    /// Answers the queued requests.
    pub fn answer(&mut self, world: &mut impl Around) {
        while let Ok(ask) = self.0.try_recv() {
            ask.answer(world);
        }
    }
}

impl Asked {
    /// Answers it.
    pub fn answer(self, world: &mut impl Around) {
        self.0.answer(world);
    }
}

impl Ask {
    fn answer(self, world: &mut impl Around) {
        // The requester may have gone.
        match self {
            Self::Forms(answer) => drop(answer.send(around::forms())),
            Self::Look(answer) => drop(answer.send(world.look())),
            Self::Change(line, answer) => drop(answer.send(world.change(&line))),
        }
    }
}
