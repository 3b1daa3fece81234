//! One page's socket: what it says is handed on at once, what it is told waits for nobody else.
//!
//! Reading and writing go on side by side, so that a page that reads slowly can still say stop. It is told the newest
//! picture, and how many it missed; its answers and news are bounded. A page that reads nothing at all is let go, and what
//! it moved is stopped, as with any end of a connection.

use std::sync::Arc;
use std::time::Duration;

use axum::extract::ws::{CloseFrame, Message as Frame, Utf8Bytes, WebSocket, close_code};
use futures_util::stream::{FuturesUnordered, SplitSink, SplitStream};
use futures_util::{SinkExt, StreamExt};
use serde_json::json;
use tokio::sync::broadcast::error::RecvError;
use tokio::sync::{mpsc, oneshot};

use crate::access::{is_same, secret};
use crate::handle::{HostHandle, Session};
use crate::host::{JOG_SPAN, PRESENCE_SPAN};
use crate::message::{Answer, Command, Malformed, Message};

/// Requests of one page that may be under way.
const UNDER_WAY: usize = 64;

/// Answers that may wait for a page.
const ANSWERS: usize = 2 * UNDER_WAY;

/// How long one message may take to be read by a page.
const READING_PATIENCE: Duration = Duration::from_secs(10);

type Sink = SplitSink<WebSocket, Frame>;

/// Serves a page until it goes.
pub(super) async fn serve(mut socket: WebSocket, handle: HostHandle) {
    let (Some(session), Ok(word)) = (handle.join().await, secret()) else {
        let close = CloseFrame { code: close_code::AGAIN, reason: "too many pages are open".into() };
        let _ = socket.send(Frame::Close(Some(close))).await;
        return;
    };
    let welcome = json!({
        "type": "welcome",
        "session": session.id(),
        "word": word,
        "jog_span_ms": JOG_SPAN.as_millis() as u64,
        "presence_span_ms": PRESENCE_SPAN.as_millis() as u64,
    });
    let (sink, stream) = socket.split();
    let (answers, waiting) = mpsc::channel(ANSWERS);
    tokio::select! {
        () = read(stream, &session, &word, answers) => {}
        () = write(sink, &handle, welcome.to_string(), waiting) => {}
    }
}

/// Hands on what the page says. Ends with the connection, and when the page leaves its answers lying.
async fn read(mut stream: SplitStream<WebSocket>, session: &Session, word: &str, answers: mpsc::Sender<String>) {
    let mut under_way = FuturesUnordered::new();
    loop {
        let answer = tokio::select! {
            said = stream.next() => match said {
                Some(Ok(Frame::Text(text))) => match take(&text, session, word, under_way.len() >= UNDER_WAY) {
                    Ok(answered) => {
                        under_way.push(answered);
                        continue;
                    }
                    Err(answer) => answer,
                },
                Some(Ok(Frame::Binary(_))) => Answer::failed(None, "malformed", "expected text, one JSON object a message"),
                Some(Ok(Frame::Ping(_) | Frame::Pong(_))) => continue,
                Some(Ok(Frame::Close(_)) | Err(_)) | None => return,
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

fn take(text: &str, session: &Session, word: &str, is_full: bool) -> Result<oneshot::Receiver<Answer>, Answer> {
    let Message { seq, word: shown, command } =
        Message::parse(text).map_err(|Malformed { seq, why }| Answer::failed(seq, "malformed", why))?;
    if !is_same(&shown, word) {
        let text = "the word is not that of this session: the message was meant for another";
        return Err(Answer::failed(Some(seq), "foreign_session", text));
    }
    // A stop finds room always.
    if is_full && command != (Command::StopAll {}) {
        return Err(Answer::failed(Some(seq), "busy", "too many of this page's requests are under way"));
    }
    session.ask(seq, command)
}

/// Tells the page what it is to know. Ends when that cannot be told.
async fn write(mut sink: Sink, handle: &HostHandle, welcome: String, mut answers: mpsc::Receiver<String>) {
    let (mut pictures, mut news) = (handle.pictures(), handle.news());
    let mut last = pictures.borrow_and_update().number;
    if !send(&mut sink, welcome).await {
        return;
    }
    loop {
        let told = tokio::select! {
            biased;
            Some(answer) = answers.recv() => send(&mut sink, answer).await,
            heard = news.recv() => match heard {
                Ok(text) => send(&mut sink, text.to_string()).await,
                Err(RecvError::Lagged(missed)) => send(&mut sink, dropped("news", missed)).await,
                Err(RecvError::Closed) => return,
            },
            changed = pictures.changed() => {
                if changed.is_err() {
                    return;
                }
                let picture = pictures.borrow_and_update().clone();
                let missed = picture.number.saturating_sub(last + 1);
                last = picture.number;
                let told = missed == 0 || send(&mut sink, dropped("pictures", missed)).await;
                told && send(&mut sink, Arc::clone(&picture.json).to_string()).await
            }
        };
        if !told {
            return;
        }
    }
}

/// What a slow reader missed.
fn dropped(what: &str, count: u64) -> String {
    json!({ "type": "dropped", "what": what, "count": count }).to_string()
}

/// False if the page does not take it.
async fn send(sink: &mut Sink, text: String) -> bool {
    let sending = sink.send(Frame::Text(Utf8Bytes::from(text)));
    matches!(tokio::time::timeout(READING_PATIENCE, sending).await, Ok(Ok(())))
}
