//! The world around virtual drives: what is asked of whoever moves it, who answers between two of its steps.
//!
//! Bounded: a question that finds no room is refused. One that nobody answers any more ends with the world.

use serde_json::Value;
use tokio::sync::{mpsc, oneshot};

/// Questions that may wait; they are answered each millisecond.
const MOST_WAITING: usize = 64;

/// The world around virtual drives, as a host sees it: in words and values.
pub trait Around {
    /// Every form of a line that changes something.
    fn forms(&self) -> Vec<&'static str>;

    /// Every drive as it truly is, in `nodes`, and the names of the machines that several of them move, in `bodies`.
    fn look(&mut self) -> Value;

    /// Does what a line says.
    ///
    /// # Errors
    /// Why not, in a word that programs may rely on, and in words; nothing is changed then.
    fn change(&mut self, line: &str) -> Result<Changed, (&'static str, String)>;
}

/// What a line has done.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Changed {
    /// The node that it is about, by the number under which it was added.
    pub node: Option<u8>,
    /// The line as it was understood.
    pub line: String,
    /// What takes it back, where that does not depend on what was before.
    pub back: Option<String>,
    /// What will come of it, where a person may not expect it.
    pub note: Option<String>,
}

/// Where the host asks.
#[derive(Clone, Debug)]
pub struct WorldDoor(mpsc::Sender<Ask>);

/// What has been asked, for whoever moves the world.
#[derive(Debug)]
pub struct WorldAsks(mpsc::Receiver<Ask>);

/// A way to ask a world, and what is asked.
pub fn world_door() -> (WorldDoor, WorldAsks) {
    let (asks, asked) = mpsc::channel(MOST_WAITING);
    (WorldDoor(asks), WorldAsks(asked))
}

/// A question, and who waits for its answer.
#[derive(Debug)]
enum Ask {
    Forms(oneshot::Sender<Vec<&'static str>>),
    Look(oneshot::Sender<Value>),
    Change(String, oneshot::Sender<Result<Changed, (&'static str, String)>>),
}

/// There is no world any more, or too much is asked of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct NoAnswer;

impl WorldDoor {
    /// What may be said.
    pub(crate) fn forms(&self) -> impl Future<Output = Result<Vec<&'static str>, NoAnswer>> + use<> {
        self.ask(Ask::Forms)
    }

    /// How everything is.
    pub(crate) fn look(&self) -> impl Future<Output = Result<Value, NoAnswer>> + use<> {
        self.ask(Ask::Look)
    }

    /// Does what a line says, whether or not somebody waits for the answer.
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
        let sent = self.0.try_send(ask(answer)).map_err(|_| NoAnswer);
        async move {
            sent?;
            answered.await.map_err(|_| NoAnswer)
        }
    }
}

impl WorldAsks {
    /// Waits for a question in a thread that may wait, and answers it; false when nobody will ask any more.
    pub fn answer_next(&mut self, around: &mut impl Around) -> bool {
        self.0.blocking_recv().map(|ask| ask.answer(around)).is_some()
    }

    /// Answers what has been asked since.
    pub fn answer(&mut self, around: &mut impl Around) {
        while let Ok(ask) = self.0.try_recv() {
            ask.answer(around);
        }
    }
}

impl Ask {
    fn answer(self, around: &mut impl Around) {
        // Who asked may have gone.
        match self {
            Self::Forms(answer) => drop(answer.send(around.forms())),
            Self::Look(answer) => drop(answer.send(around.look())),
            Self::Change(line, answer) => drop(answer.send(around.change(&line))),
        }
    }
}
