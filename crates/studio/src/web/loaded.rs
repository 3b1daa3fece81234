//! A log of frames that a page has loaded, shown as the trace of the bus is: the same lines, by the models of this bus's nodes.
//!
//! The studio keeps the newest one, which pages ask for by its number; a page whose log was replaced by that of another page is
//! answered with 404, and loads it again.

use std::sync::{Arc, Mutex, PoisonError};

use axum::body::Bytes;
use axum::extract::Query;
use axum::extract::rejection::QueryRejection;
use axum::http::StatusCode;
use axum::response::Response;
use host::HostHandle;
use host::trace::Held;
use serde_json::json;
use tokio::sync::Semaphore;

use super::answer::{json_text, trouble};
use super::log_file::{LogFile, format_of};
use super::recording::Named;

/// The log that is kept, and its number.
#[derive(Clone, Default)]
pub(super) struct Logs(Arc<Mutex<Option<(u64, Held)>>>);

impl Logs {
    /// The frames of the log with this number, if it is still kept.
    pub(super) fn held(&self, number: u64) -> Option<Held> {
        let kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        kept.as_ref().filter(|(of, _)| *of == number).map(|(_, held)| held.clone())
    }

    fn keep(&self, held: Held) -> u64 {
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let number = kept.as_ref().map_or(1, |(before, _)| before + 1);
        *kept = Some((number, held));
        number
    }
}

/// Loads a log, in another thread than the task that moves drives.
pub(super) async fn load(
    handle: HostHandle,
    records: Arc<Semaphore>,
    logs: Logs,
    asked: Result<Query<Named>, QueryRejection>,
    file: Bytes,
) -> Response {
    let name = match asked {
        Ok(Query(Named { name })) => name,
        Err(rejection) => return trouble(StatusCode::BAD_REQUEST, "malformed", &rejection.body_text()),
    };
    let Ok(permit) = records.try_acquire_owned() else {
        return trouble(StatusCode::TOO_MANY_REQUESTS, "busy", "another file is being read: try again");
    };
    let work = move || {
        let _permit = permit;
        loaded(&handle, &logs, &name, &file)
    };
    match tokio::task::spawn_blocking(work).await {
        Ok(Ok(answer)) => json_text(answer.to_string()),
        Ok(Err(why)) => trouble(StatusCode::BAD_REQUEST, "malformed", &why),
        Err(_) => trouble(StatusCode::SERVICE_UNAVAILABLE, "over", "the studio is ending"),
    }
}

fn loaded(handle: &HostHandle, logs: &Logs, name: &str, bytes: &[u8]) -> Result<serde_json::Value, String> {
    let format = format_of(name, bytes)
        .ok_or_else(|| format!("{name}: expected a log of frames (candump, ASC, BLF, TRC, pcap, pcapng)"))?;
    let mut file = LogFile::new(bytes, format);
    let held = handle.trace().of_log(&mut file).held();
    let (frames, oldest, remark) = (held.next(), held.oldest(), file.remark());
    if frames == 0 {
        let why = if remark.is_empty() { String::new() } else { format!(": {remark}") };
        return Err(format!("{name} has no frames{why}"));
    }
    Ok(json!({ "number": logs.keep(held), "frames": frames, "oldest": oldest, "remark": remark }))
}

/// The answer where another log was loaded since.
pub(super) fn replaced() -> Response {
    trouble(StatusCode::NOT_FOUND, "not_found", "this log is not kept any more: load it again")
}
