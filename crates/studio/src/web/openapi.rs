//! The requests that are answered, as a table: the router is made of it, and so is the document at `/api/openapi.json`.

use serde_json::{Map, Value, json};

/// What a request does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Operation {
    State,
    PowerStates,
    OpenApi,
    Stop,
    Login,
    Socket,
}

/// One request.
pub(super) struct Route {
    pub(super) path: &'static str,
    pub(super) method: &'static str,
    pub(super) operation: Operation,
    summary: &'static str,
    /// Each status that it is answered with, and what it means.
    answers: &'static [(&'static str, &'static str)],
}

const LET_IN: (&str, &str) = ("401", "Neither cookie nor token");
const FOREIGN: (&str, &str) = ("403", "The Origin or the Host is not this server's");

/// All of them. None that is a GET changes anything; none moves a drive: motion goes through the socket, where it is held.
pub(super) const ROUTES: [Route; 6] = [
    Route {
        path: "/api/state",
        method: "get",
        operation: Operation::State,
        summary: "The bus, its nodes, and what each drive says of itself",
        answers: &[("200", "The newest picture"), LET_IN],
    },
    Route {
        path: "/api/power-states",
        method: "get",
        operation: Operation::PowerStates,
        summary: "The power drive state machine (CiA 402-2, 8.2): states and transitions",
        answers: &[("200", "States and transitions"), LET_IN],
    },
    Route {
        path: "/api/openapi.json",
        method: "get",
        operation: Operation::OpenApi,
        summary: "This document",
        answers: &[("200", "OpenAPI 3.1"), LET_IN],
    },
    Route {
        path: "/api/stop",
        method: "post",
        operation: Operation::Stop,
        summary: "Quick-stop every drive; needs no control",
        answers: &[("202", "The drives are being stopped"), LET_IN, FOREIGN, ("503", "The studio is ending")],
    },
    Route {
        path: "/api/login",
        method: "post",
        operation: Operation::Login,
        summary: "Exchange the password for a cookie, where there is one",
        answers: &[
            ("200", "The cookie is set"),
            ("400", "The body is not {\"password\":\"..\"}"),
            ("401", "Wrong password"),
            FOREIGN,
            ("429", "Another one is being looked at"),
        ],
    },
    Route {
        path: "/ws",
        method: "get",
        operation: Operation::Socket,
        summary: "A WebSocket: pictures and news out, what a page asks for in, one JSON object a message",
        answers: &[("101", "Welcome"), LET_IN, FOREIGN],
    },
];

/// The document.
pub(super) fn document() -> Value {
    let mut paths = Map::new();
    for route in &ROUTES {
        let answers: Map<String, Value> =
            route.answers.iter().map(|(status, text)| ((*status).to_owned(), json!({ "description": text }))).collect();
        let operation = json!({
            "operationId": format!("{:?}", route.operation),
            "summary": route.summary,
            "responses": answers,
        });
        let path = paths.entry(route.path).or_insert_with(|| json!({}));
        path[route.method] = operation;
    }
    json!({
        "openapi": "3.1.0",
        "info": { "title": "Ferrodrive studio", "version": env!("CARGO_PKG_VERSION") },
        "paths": paths,
        "components": { "securitySchemes": {
            "cookie": { "type": "apiKey", "in": "cookie", "name": "ferrodrive_studio_PORT" },
            "token": { "type": "http", "scheme": "bearer" },
        } },
        "security": [{ "cookie": [] }, { "token": [] }],
    })
}
