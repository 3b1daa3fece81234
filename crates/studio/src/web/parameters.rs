//! Parameter files chosen in a page, converted to the form that its requests carry.

use std::sync::Arc;

use axum::body::Bytes;
use axum::extract::Query;
use axum::extract::rejection::QueryRejection;
use axum::http::StatusCode;
use axum::http::header::CONTENT_TYPE;
use axum::response::{IntoResponse, Response};
use canopen::NodeId;
use machine::parameters::{of_dcf, sheet};
use serde::Deserialize;
use tokio::sync::Semaphore;

use super::answer::trouble;

/// The largest accepted DCF in bytes: one with 500 objects has a fifth of it.
pub(super) const LARGEST: usize = 1 << 20;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct NodeQuery {
    node: Option<u8>,
}

/// The TOML of a DCF, read in another thread than the task that moves drives.
pub(super) async fn toml(
    files: Arc<Semaphore>,
    asked: Result<Query<NodeQuery>, QueryRejection>,
    dcf: Bytes,
) -> Response {
    let malformed = |why: &str| trouble(StatusCode::BAD_REQUEST, "malformed", why);
    let node = match asked {
        Ok(Query(asked)) => NodeId::new(asked.node.unwrap_or(1)),
        Err(rejection) => return malformed(&rejection.body_text()),
    };
    let Some(node) = node else { return malformed("expected a node-ID from 1 to 127") };
    let Ok(permit) = files.try_acquire_owned() else {
        return trouble(StatusCode::TOO_MANY_REQUESTS, "busy", "another file is being read: try again");
    };
    let work = move || {
        // It goes on if the client goes away, and so does its turn.
        let _permit = permit;
        of_dcf(&dcf, node)
    };
    match tokio::task::spawn_blocking(work).await {
        Ok(Ok(parameters)) => ([(CONTENT_TYPE, "application/toml")], sheet::print(&parameters, None)).into_response(),
        Ok(Err(why)) => malformed(&why),
        Err(_) => trouble(StatusCode::SERVICE_UNAVAILABLE, "over", "the studio is ending"),
    }
}
