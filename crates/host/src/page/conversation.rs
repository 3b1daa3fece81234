//! The conversation with one page: its messages are passed on at once, and it waits for no other page.
//!
//! Reading and writing are concurrent, so that a page that reads slowly can still send a stop. It is sent the newest
//! state, and the number of states that it missed; its answers and news are bounded. A page that reads nothing at all is disconnected,
//! and what it moved is stopped, as with any end of a connection.

use std::pin::pin;

use futures_util::stream::FuturesUnordered;
use futures_util::{Stream, StreamExt};
use serde_json::json;
use tokio::sync::broadcast::error::RecvError;
use tokio::sync::{mpsc, oneshot};

use super::message::{MalformedMessage, PageMessage};
use crate::session::{HostHandle, Session};
use crate::{Answer, Command, JOG_SPAN, PRESENCE_SPAN};

/// Pending requests per page.
const UNDER_WAY: usize = 64;

/// Answers queued per page.
const ANSWERS: usize = 2 * UNDER_WAY;

/// What a connection brings from its page.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Said {
    /// A text, which should be a message.
    Text(String),
    /// Anything else.
    Binary,
}

/// The word that every message of a session has to show, of a conversation.
#[derive(Debug)]
pub struct Word {
    /// The word.
    pub text: String,
    /// Whether two words are the same; where others could guess, in constant time.
    pub is_same: fn(&str, &str) -> bool,
}

/// Serves a page in a session of the host, until `said` ends or nothing receives from `sent` any more. Where that is to hold back
/// what is newer than the page has read, `sent` has room for one.
pub async fn serve(
    handle: &HostHandle,
    session: Session,
    word: Word,
    said: impl Stream<Item = Said>,
    sent: mpsc::Sender<String>,
) {
    let welcome = json!({
        "type": "welcome",
        "session": session.id(),
        "word": word.text,
        "jog_span_ms": JOG_SPAN.as_millis() as u64,
        "presence_span_ms": PRESENCE_SPAN.as_millis() as u64,
    });
    let (answers, waiting) = mpsc::channel(ANSWERS);
    tokio::select! {
        () = read(said, &session, &word, answers) => {}
        () = write(sent, handle, welcome.to_string(), waiting) => {}
    }
}

/// Passes on the messages of the page. Ends with the connection, and when the page does not read its answers.
async fn read(said: impl Stream<Item = Said>, session: &Session, word: &Word, answers: mpsc::Sender<String>) {
    let mut said = pin!(said);
    let mut under_way = FuturesUnordered::new();
    loop {
        let answer = tokio::select! {
            said = said.next() => match said {
                Some(Said::Text(text)) => match take(&text, session, word, under_way.len() >= UNDER_WAY) {
                    Ok(answered) => {
                        under_way.push(answered);
                        continue;
                    }
                    Err(answer) => answer,
                },
                Some(Said::Binary) => Answer::failed(None, "malformed", "expected text, one JSON object per message"),
                None => return,
            },
            Some(answered) = under_way.next(), if !under_way.is_empty() => match answered {
                Ok(answer) => answer,
                // The host has ended.
                Err(_) => return,
            },
        };
        if answers.try_send(answer.json()).is_err() {
            return;
        }
    }
}

fn take(text: &str, session: &Session, word: &Word, is_full: bool) -> Result<oneshot::Receiver<Answer>, Answer> {
    let PageMessage { seq, word: shown, command } =
        PageMessage::parse(text).map_err(|MalformedMessage { seq, why }| Answer::failed(seq, "malformed", why))?;
    if !(word.is_same)(&shown, &word.text) {
        let text = "wrong session word: the message was meant for another session";
        return Err(Answer::failed(Some(seq), "foreign_session", text));
    }
    // A stop is always accepted.
    if is_full && command != Command::STOP_ALL {
        return Err(Answer::failed(
            Some(seq),
            "busy",
            "too many pending requests of this page: wait for their answers",
        ));
    }
    session.ask(seq, command)
}

/// Sends states, news and answers to the page. Ends when sending fails.
async fn write(sent: mpsc::Sender<String>, handle: &HostHandle, welcome: String, mut answers: mpsc::Receiver<String>) {
    let send = async |text| sent.send(text).await.is_ok();
    let (mut states, mut news) = (handle.states(), handle.news());
    let mut last = states.borrow_and_update().snapshot().number;
    if !send(welcome).await {
        return;
    }
    loop {
        let is_sent = tokio::select! {
            biased;
            Some(answer) = answers.recv() => send(answer).await,
            heard = news.recv() => match heard {
                // Only a time, a number and a text: serialising cannot fail.
                Ok(news) => send(serde_json::to_string(&news).unwrap_or_default()).await,
                Err(RecvError::Lagged(missed)) => send(dropped("news", missed)).await,
                Err(RecvError::Closed) => return,
            },
            changed = states.changed() => {
                if changed.is_err() {
                    return;
                }
                let state = states.borrow_and_update().clone();
                let number = state.snapshot().number;
                let missed = number.saturating_sub(last + 1);
                last = number;
                let is_sent = missed == 0 || send(dropped("pictures", missed)).await;
                is_sent && send(state.json().to_string()).await
            }
        };
        if !is_sent {
            return;
        }
    }
}

/// What a slow reader missed.
fn dropped(what: &str, count: u64) -> String {
    json!({ "type": "dropped", "what": what, "count": count }).to_string()
}
