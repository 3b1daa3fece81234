//! A page without a browser: a session for a program in the same process as the host, with the messages and states
//! of a page. The rules for a page hold for it: its motions stop when it is dropped or silent.

use std::sync::Arc;

use serde_json::Value;
use tokio::sync::{broadcast, watch};

use crate::answer::Answer;
use crate::command::Command;
use crate::session::authority::SessionId;
use crate::session::handle::{HostHandle, Session, StateUpdate};
use crate::snapshot::{News, Snapshot};

/// A session, its states and its news.
#[derive(Debug)]
pub struct LocalClient {
    session: Session,
    seq: u64,
    states: watch::Receiver<StateUpdate>,
    news: broadcast::Receiver<News>,
}

/// An output of the host.
#[derive(Clone, Debug, PartialEq)]
pub enum Shown {
    /// The state of everything.
    State(Arc<Snapshot>),
    /// Something that happened.
    News(News),
    /// Number of news that were missed because they were not fetched in time.
    Missed(u64),
    /// The host has ended.
    Over,
}

impl LocalClient {
    /// A new session; `None` if there are too many, or the host has ended.
    pub async fn take(handle: &HostHandle) -> Option<Self> {
        let session = handle.join().await?;
        Some(Self { session, seq: 0, states: handle.states(), news: handle.news() })
    }

    /// Its session, to be compared with the controller in the state.
    pub const fn id(&self) -> SessionId {
        self.session.id()
    }

    /// Sends a message as a page does, without its number and session: `{"do":"enable","node":4}`. The answer, as JSON, comes
    /// when it is done: `{"ok":false,"error":{"kind":"..","message":".."}}`.
    pub fn say(&mut self, message: Value) -> impl Future<Output = Value> + Send + 'static + use<> {
        self.seq += 1;
        let asked = match serde_json::from_value::<Command>(message) {
            Ok(command) => self.session.ask(self.seq, command),
            Err(error) => Err(Answer::failed(Some(self.seq), "malformed", error.to_string())),
        };
        let seq = self.seq;
        async move {
            let answer = match asked {
                Ok(answered) => answered.await.unwrap_or_else(|_| gone(seq)),
                Err(answer) => answer,
            };
            // Only strings, numbers and flags: serialising cannot fail.
            serde_json::to_value(answer).unwrap_or_default()
        }
    }

    /// The next output. Of states only the newest.
    pub async fn shown(&mut self) -> Shown {
        tokio::select! {
            changed = self.states.changed() => match changed {
                Ok(()) => Shown::State(self.states.borrow_and_update().snapshot()),
                Err(_) => Shown::Over,
            },
            news = self.news.recv() => match news {
                Ok(news) => Shown::News(news),
                Err(broadcast::error::RecvError::Lagged(missed)) => Shown::Missed(missed),
                Err(broadcast::error::RecvError::Closed) => Shown::Over,
            },
        }
    }
}

/// The host has ended before it answered.
fn gone(seq: u64) -> Answer {
    Answer::failed(Some(seq), "over", "the host is ending")
}
