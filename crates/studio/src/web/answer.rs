//! Answers as JSON.

use axum::http::header::CONTENT_TYPE;
use axum::http::{HeaderMap, HeaderValue, StatusCode};
use axum::response::{IntoResponse, Response};
use serde_json::json;

/// Why a request is refused.
pub(super) fn trouble(status: StatusCode, kind: &str, message: &str) -> Response {
    let body = json!({ "ok": false, "error": { "kind": kind, "message": message } });
    (status, json_text(body.to_string())).into_response()
}

/// A text that is JSON.
pub(super) fn json_text(json: String) -> Response {
    (json_headers(), json).into_response()
}

fn json_headers() -> HeaderMap {
    HeaderMap::from_iter([(CONTENT_TYPE, HeaderValue::from_static("application/json"))])
}
