//! The socket of one page: its messages are passed on at once, and it waits for no other page.
//!
//! Reading and writing are concurrent, so that a page that reads slowly can still send a stop. It is sent the newest
//! state, and the number of states that it missed; its answers and news are bounded. A page that reads nothing at all is disconnected,
//! and what it moved is stopped, as with any end of a connection.

use std::time::Duration;

use axum::extract::ws::{CloseFrame, Message as Frame, Utf8Bytes, WebSocket, close_code};
use futures_util::stream::{FuturesUnordered, SplitSink, SplitStream};
use futures_util::{SinkExt, StreamExt};
use serde_json::json;
use tokio::sync::broadcast::error::RecvError;
use tokio::sync::{mpsc, oneshot};

use crate::access::{is_same, secret};
use crate::message::{MalformedMessage, PageMessage};
use host::session::{HostHandle, Session};
use host::{Answer, Command};
use host::{JOG_SPAN, PRESENCE_SPAN};

/// Pending requests per page.
const UNDER_WAY: usize = 64;

/// Answers queued per page.
const ANSWERS: usize = 2 * UNDER_WAY;

/// How long a page may take to read one message.
const READING_PATIENCE: Duration = Duration::from_secs(10);

type Sink = SplitSink<WebSocket, Frame>;

/// Serves a page until its connection ends.
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

/// Passes on the messages of the page. Ends with the connection, and when the page does not read its answers.
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
                Some(Ok(Frame::Binary(_))) => Answer::failed(None, "malformed", "expected text, one JSON object per message"),
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
    let PageMessage { seq, word: shown, command } =
        PageMessage::parse(text).map_err(|MalformedMessage { seq, why }| Answer::failed(seq, "malformed", why))?;
    if !is_same(&shown, word) {
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
async fn write(mut sink: Sink, handle: &HostHandle, welcome: String, mut answers: mpsc::Receiver<String>) {
    let (mut states, mut news) = (handle.states(), handle.news());
    let mut last = states.borrow_and_update().snapshot().number;
    if !send(&mut sink, welcome).await {
        return;
    }
    loop {
        let sent = tokio::select! {
            biased;
            Some(answer) = answers.recv() => send(&mut sink, answer).await,
            heard = news.recv() => match heard {
                // Only a time, a number and a text: serialising cannot fail.
                Ok(news) => send(&mut sink, serde_json::to_string(&news).unwrap_or_default()).await,
                Err(RecvError::Lagged(missed)) => send(&mut sink, dropped("news", missed)).await,
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
                let sent = missed == 0 || send(&mut sink, dropped("pictures", missed)).await;
                sent && send(&mut sink, state.json().to_string()).await
            }
        };
        if !sent {
            return;
        }
    }
}

/// What a slow reader missed.
fn dropped(what: &str, count: u64) -> String {
    json!({ "type": "dropped", "what": what, "count": count }).to_string()
}

/// False if the page does not read it.
async fn send(sink: &mut Sink, text: String) -> bool {
    let sending = sink.send(Frame::Text(Utf8Bytes::from(text)));
    matches!(tokio::time::timeout(READING_PATIENCE, sending).await, Ok(Ok(())))
}
