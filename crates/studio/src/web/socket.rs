//! The socket of one page. A page that does not read is disconnected.

use std::future::ready;
use std::time::Duration;

use axum::extract::ws::{CloseFrame, Message as Frame, Utf8Bytes, WebSocket, close_code};
use futures_util::{SinkExt, StreamExt};
use host::HostHandle;
use host::page::{self, Said, Word};
use tokio::sync::mpsc;

use crate::access::{is_same, secret};

/// How long a page may take to read one message.
const READING_PATIENCE: Duration = Duration::from_secs(10);

/// Serves a page until its connection ends.
pub(super) async fn serve(mut socket: WebSocket, handle: HostHandle) {
    let (Some(session), Ok(word)) = (handle.join().await, secret()) else {
        let close = CloseFrame { code: close_code::AGAIN, reason: "too many pages are open".into() };
        let _ = socket.send(Frame::Close(Some(close))).await;
        return;
    };
    let (mut sink, stream) = socket.split();
    let open = stream.take_while(|frame| ready(!matches!(frame, Ok(Frame::Close(_)) | Err(_))));
    let said = open.filter_map(|frame| {
        ready(match frame {
            Ok(Frame::Text(text)) => Some(Said::Text(text.to_string())),
            Ok(Frame::Binary(_)) => Some(Said::Binary),
            _ => None,
        })
    });
    let (sent, mut waiting) = mpsc::channel(1);
    let send = async {
        while let Some(text) = waiting.recv().await {
            let sending = sink.send(Frame::Text(Utf8Bytes::from(text)));
            if !matches!(tokio::time::timeout(READING_PATIENCE, sending).await, Ok(Ok(()))) {
                return;
            }
        }
    };
    tokio::select! {
        () = page::serve(&handle, session, Word { text: word, is_same }, said, sent) => {}
        () = send => {}
    }
}
