//! Values kept in a page, as a record file.

use std::sync::Arc;

use axum::body::Bytes;
use axum::http::StatusCode;
use axum::http::header::CONTENT_TYPE;
use axum::response::{IntoResponse, Response};
use recording::mcap_of_csv;
use tokio::sync::Semaphore;

use super::answer::trouble;

/// The largest accepted record in bytes: a minute of twelve objects at 1 kHz has about half of it.
pub(super) const LARGEST: usize = 32 << 20;

/// Converts a CSV to MCAP, in another thread than the task that moves drives.
pub(super) async fn mcap(records: Arc<Semaphore>, csv: Bytes) -> Response {
    let Ok(_permit) = records.try_acquire() else {
        return trouble(StatusCode::TOO_MANY_REQUESTS, "busy", "another record is being converted: try again");
    };
    match tokio::task::spawn_blocking(move || mcap_of_csv(&csv)).await {
        Ok(Ok(file)) => ([(CONTENT_TYPE, "application/octet-stream")], file).into_response(),
        Ok(Err(why)) => trouble(StatusCode::BAD_REQUEST, "malformed", &why),
        Err(_) => trouble(StatusCode::SERVICE_UNAVAILABLE, "over", "the studio is ending"),
    }
}
