//! Who may connect: programs of a person, and pages that the person has opened for this.
//!
//! A browser lets any page connect to a port of its own machine, and says by `Origin` which page it is; a page cannot forge that.
//! What is to be seen here moves nothing, but belongs to the person who started the server: pages of the Foxglove application, pages served by this
//! machine and those named at the start are let in, any other is refused. Programs that are not browsers send no origin, or one of
//! their own scheme (`file:`, `app:`).

use std::net::IpAddr;

use tokio_tungstenite::tungstenite::handshake::server::{Callback, ErrorResponse, Request, Response};
use tokio_tungstenite::tungstenite::http::header::{ORIGIN, SEC_WEBSOCKET_PROTOCOL};
use tokio_tungstenite::tungstenite::http::{HeaderMap, HeaderValue, StatusCode};

use crate::protocol::SUBPROTOCOLS;

/// The page of Foxglove's application.
const FOXGLOVE: &str = "https://app.foxglove.dev";

/// Decides on the handshake of a client.
pub(crate) struct Handshake<'a> {
    /// Further origins that are let in.
    pub(crate) origins: &'a [String],
}

impl Callback for Handshake<'_> {
    #[allow(clippy::result_large_err, reason = "the library's type")]
    fn on_request(self, request: &Request, mut response: Response) -> Result<Response, ErrorResponse> {
        let refused = |status: StatusCode, text: String| {
            let mut response = ErrorResponse::new(Some(text));
            *response.status_mut() = status;
            response
        };
        if let Some(origin) = request.headers().get(ORIGIN) {
            let origin = String::from_utf8_lossy(origin.as_bytes());
            if !is_let_in(&origin, self.origins) {
                let text = format!(
                    "pages of {origin} are not let in: start with --foxglove-origin {origin} if they are yours"
                );
                return Err(refused(StatusCode::FORBIDDEN, text));
            }
        }
        let Some(protocol) = subprotocol(request.headers()) else {
            let text = format!("expected Sec-WebSocket-Protocol: {}", SUBPROTOCOLS.join(" or "));
            return Err(refused(StatusCode::BAD_REQUEST, text));
        };
        response.headers_mut().insert(SEC_WEBSOCKET_PROTOCOL, HeaderValue::from_static(protocol));
        Ok(response)
    }
}

/// The first that a client offers and that is spoken here.
fn subprotocol(headers: &HeaderMap) -> Option<&'static str> {
    let offered = headers.get_all(SEC_WEBSOCKET_PROTOCOL).iter().filter_map(|value| value.to_str().ok());
    let mut offered = offered.flat_map(|value| value.split(',')).map(str::trim);
    offered.find_map(|name| SUBPROTOCOLS.into_iter().find(|known| *known == name))
}

fn is_let_in(origin: &str, named: &[String]) -> bool {
    if origin == FOXGLOVE || named.iter().any(|own| own.trim_end_matches('/') == origin) {
        return true;
    }
    match origin.split_once("://") {
        Some(("http" | "https", place)) => is_this_machine(place),
        Some(_) => true,
        // "null": a page that hides where it comes from.
        None => false,
    }
}

/// Whether `HOST[:PORT]` is this machine.
fn is_this_machine(place: &str) -> bool {
    let host = match place.rsplit_once(':') {
        Some((host, port)) if port.bytes().all(|byte| byte.is_ascii_digit()) => host,
        _ => place,
    };
    let address = host.trim_start_matches('[').trim_end_matches(']').parse::<IpAddr>();
    host == "localhost" || address.is_ok_and(|address| address.is_loopback())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pages_of_this_machine_of_foxglove_and_named_ones_are_let_in() {
        let named = ["https://lichtblick.example/".to_owned()];
        for origin in [
            "http://localhost:8080",
            "https://127.0.0.1",
            "http://[::1]:3000",
            "https://app.foxglove.dev",
            "https://lichtblick.example",
            "file://",
            "app://lichtblick",
        ] {
            assert!(is_let_in(origin, &named), "{origin}");
        }
        for origin in [
            "https://evil.example",
            "http://localhost.evil.example",
            "https://app.foxglove.dev.evil.example",
            "http://127.0.0.1.evil.example:80",
            "http://10.0.0.1",
            "null",
            "",
        ] {
            assert!(!is_let_in(origin, &named), "{origin}");
        }
    }

    #[test]
    fn the_first_protocol_that_is_spoken_is_taken() {
        let chosen = |offered: &[&str]| {
            let mut headers = HeaderMap::new();
            for it in offered {
                headers.append(SEC_WEBSOCKET_PROTOCOL, it.parse().expect("a value"));
            }
            subprotocol(&headers)
        };
        assert_eq!(chosen(&["foxglove.websocket.v1, foxglove.sdk.v1"]), Some("foxglove.websocket.v1"));
        assert_eq!(chosen(&["chat", "foxglove.sdk.v1"]), Some("foxglove.sdk.v1"));
        assert_eq!((chosen(&[]), chosen(&["foxglove.websocket.v2"])), (None, None));
    }
}
