//! A page without a browser: a session of a program that runs in the same process as the host, in the messages and pictures
//! that a page has. What holds for a page holds for it: its motions stop when it is dropped or says nothing.

use std::sync::Arc;

use serde_json::Value;
use tokio::sync::{broadcast, watch};

use crate::handle::{HostHandle, Session, StateUpdate};
use crate::message::{Answer, Command};

/// A session, its pictures and its news.
#[derive(Debug)]
pub struct LocalClient {
    session: Session,
    seq: u64,
    pictures: watch::Receiver<StateUpdate>,
    news: broadcast::Receiver<Arc<str>>,
}

/// What a host has to show.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Shown {
    /// The state of everything, as JSON: `/api/state`.
    State(Arc<str>),
    /// Something that happened, as JSON: `{"type":"news","node":4,"text":".."}`.
    News(Arc<str>),
    /// So many news were missed by whoever did not fetch them in time.
    Missed(u64),
    /// There is no host any more.
    Over,
}

impl LocalClient {
    /// A new session; `None` if there are too many, or the host has ended.
    pub async fn take(handle: &HostHandle) -> Option<Self> {
        let session = handle.join().await?;
        Some(Self { session, seq: 0, pictures: handle.pictures(), news: handle.news() })
    }

    /// Its number: whether the state names it as the one that has control.
    pub const fn number(&self) -> u64 {
        self.session.id().0
    }

    /// Says a message of the page's, without its number and session: `{"do":"enable","node":4}`. The answer, as JSON, comes
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
            // Strings, numbers and flags alone: there is nothing in it that JSON cannot say.
            serde_json::to_value(answer).unwrap_or_default()
        }
    }

    /// What there is to show next. Of states only the newest.
    pub async fn shown(&mut self) -> Shown {
        tokio::select! {
            changed = self.pictures.changed() => match changed {
                Ok(()) => Shown::State(self.pictures.borrow_and_update().json.clone()),
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

/// The host has ended with the question in its hands.
fn gone(seq: u64) -> Answer {
    Answer::failed(Some(seq), "over", "the host is ending")
}
