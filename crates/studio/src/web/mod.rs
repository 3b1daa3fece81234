//! The web part: files of the page, a few requests, and the socket that carries the rest.
//!
//! Access is decided before anything else, in one place ([`guard`]). The handlers know nothing of drives.

mod answer;
mod bundle;
mod door;
mod guessers;
mod loaded;
mod log_file;
mod openapi;
mod page;
mod parameters;
mod recording;
mod socket;
#[cfg(test)]
mod tests;
mod trace;

use std::sync::Arc;

use axum::Router;
use axum::extract::rejection::QueryRejection;
use axum::extract::ws::WebSocketUpgrade;
use axum::extract::{DefaultBodyLimit, FromRequest, Path, Query, Request, State};
use axum::http::header::{
    ACCEPT, CACHE_CONTROL, CONTENT_LENGTH, CONTENT_SECURITY_POLICY, CONTENT_TYPE, LOCATION, REFERRER_POLICY,
    SET_COOKIE, X_CONTENT_TYPE_OPTIONS, X_FRAME_OPTIONS,
};
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method, StatusCode};
use axum::middleware::{self, Next};
use axum::response::{IntoResponse, Response};
use axum::routing::{MethodRouter, get, post};
use canlog::Format;
use serde::Deserialize;
use serde_json::json;
use tokio::sync::Semaphore;

use crate::access::Access;
use answer::{json_text, trouble};
use door::Visitor;
pub use door::serve;
use guessers::Guessers;
use host::HostHandle;
use openapi::{Operation, ROUTES};

/// The largest message or body that is read.
pub(crate) const LARGEST_MESSAGE: usize = 64 << 10;

/// Headers of every answer: only this server's own files run in the page, no site may frame it, and it sends
/// no referrer.
const HEADERS: [(HeaderName, &str); 5] = [
    (
        CONTENT_SECURITY_POLICY,
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; \
         form-action 'none'; base-uri 'none'; frame-ancestors 'none'",
    ),
    (X_CONTENT_TYPE_OPTIONS, "nosniff"),
    (X_FRAME_OPTIONS, "DENY"),
    (REFERRER_POLICY, "no-referrer"),
    (CACHE_CONTROL, "no-store"),
];

/// Shared by the handlers.
#[derive(Clone)]
struct Web {
    handle: HostHandle,
    access: Arc<Access>,
    /// Addresses that have just sent a wrong password.
    guessers: Arc<Guessers>,
    doors: trace::Doors,
    /// One record or file at a time, to bound memory.
    records: Arc<Semaphore>,
    /// The log that a page has loaded.
    logs: loaded::Logs,
}

/// The server of a studio as one router, which can be called without a socket.
pub fn app(handle: HostHandle, access: Arc<Access>) -> Router {
    let one = || Arc::new(Semaphore::new(1));
    let web = Web {
        handle,
        access,
        guessers: Arc::default(),
        doors: trace::Doors::default(),
        records: one(),
        logs: loaded::Logs::default(),
    };
    let api = ROUTES.iter().fold(Router::new(), |router, route| router.route(route.path, handler(route.operation)));
    api.route("/", get(async |asked: HeaderMap| page::file("index.html", &asked)))
        .route("/page/{file}", get(async |Path(file): Path<String>, asked: HeaderMap| page::file(&file, &asked)))
        .route("/login", get(async |asked: HeaderMap| page::file("login.html", &asked)))
        .fallback(async || trouble(StatusCode::NOT_FOUND, "not_found", "there is nothing at this path"))
        .layer(DefaultBodyLimit::max(LARGEST_MESSAGE))
        .layer(middleware::from_fn_with_state(web.clone(), guard))
        .with_state(web)
}

fn handler(operation: Operation) -> MethodRouter<Web> {
    match operation {
        Operation::State => get(state),
        Operation::PowerStates => get(async || json_text(host::page::power_states())),
        Operation::OpenApi => get(async || json_text(openapi::document().to_string())),
        Operation::Stop => post(stop),
        Operation::Login => post(login),
        Operation::Socket => get(socket),
        Operation::Faults => get(faults),
        Operation::Trace => get(async |State(web): State<Web>, asked| trace::lines(web.handle, web.doors, asked).await),
        Operation::TraceLoad => post(async |State(web): State<Web>, asked, body: axum::body::Bytes| {
            loaded::load(web.handle, web.records, web.logs, asked, body).await
        })
        .layer(DefaultBodyLimit::max(recording::LARGEST)),
        Operation::Loaded => get(async |State(web): State<Web>, Path(number), asked| {
            trace::loaded_lines(web.logs.held(number), web.doors, asked).await
        }),
        Operation::LoadedIdentifiers => get(async |State(web): State<Web>, Path(number), asked| {
            trace::loaded_identifiers(web.logs.held(number), web.doors, asked).await
        }),
        Operation::Series => {
            get(async |State(web): State<Web>, asked| trace::series(web.handle, web.doors, asked).await)
        }
        Operation::TraceLog => get(async |State(web): State<Web>, asked| trace::log(web.handle, &web.doors, asked)),
        Operation::TraceAsc => saved_trace(Format::Asc),
        Operation::TraceBlf => saved_trace(Format::Blf),
        Operation::TracePcapng => saved_trace(Format::Pcapng),
        Operation::Identifiers => {
            get(async |State(web): State<Web>, asked| trace::identifiers(web.handle, web.doors, asked).await)
        }
        Operation::RecordingMcap => {
            post(async |State(web): State<Web>, body: axum::body::Bytes| recording::mcap(web.records, body).await)
                .layer(DefaultBodyLimit::max(recording::LARGEST))
        }
        Operation::Recording => post(async |State(web): State<Web>, asked, body: axum::body::Bytes| {
            recording::values(web.handle, web.records, asked, body).await
        })
        .layer(DefaultBodyLimit::max(recording::LARGEST)),
        Operation::Identified => post(async |State(web): State<Web>, asked, body: axum::body::Bytes| {
            recording::identified(web.handle, web.records, asked, body).await
        })
        .layer(DefaultBodyLimit::max(recording::LARGEST)),
        Operation::ParametersToml => post(async |State(web): State<Web>, asked, body: axum::body::Bytes| {
            parameters::toml(web.records, asked, body).await
        })
        .layer(DefaultBodyLimit::max(parameters::LARGEST)),
    }
}

fn saved_trace(format: Format) -> MethodRouter<Web> {
    get(async move |State(web): State<Web>, asked| trace::saved(web.handle, &web.doors, asked, format).await)
}

/// Access control, and the headers of every answer.
async fn guard(State(web): State<Web>, request: Request, next: Next) -> Response {
    let wants_page = request.method() == Method::GET && accepts_html(request.headers());
    let mut response = match refuse(&web.access, &request) {
        // Shown to a person: for instance in a tab from an earlier launch.
        Some(refusal) => refusal.answer(wants_page),
        None => in_json(next.run(request).await),
    };
    for (name, value) in HEADERS {
        // A file of the page may be kept if it is asked for again.
        response.headers_mut().entry(name).or_insert(HeaderValue::from_static(value));
    }
    response
}

#[derive(Deserialize)]
struct TokenQuery {
    token: Option<String>,
}

/// The answer to a request that is not served.
enum Refusal {
    /// A redirect with this cookie.
    Elsewhere(&'static str, Option<String>),
    /// A refusal with its reason.
    Trouble(StatusCode, &'static str, &'static str),
}

impl Refusal {
    /// As a page for a person, or as JSON for a program.
    fn answer(self, wants_page: bool) -> Response {
        match self {
            Self::Elsewhere(to, None) => ([(LOCATION, to)], StatusCode::SEE_OTHER).into_response(),
            Self::Elsewhere(to, Some(cookie)) => {
                ([(SET_COOKIE, cookie), (LOCATION, to.into())], StatusCode::SEE_OTHER).into_response()
            }
            Self::Trouble(status, _, text) if wants_page => page::refused(status, text),
            Self::Trouble(status, kind, text) => trouble(status, kind, text),
        }
    }
}

fn accepts_html(headers: &HeaderMap) -> bool {
    headers.get(ACCEPT).and_then(|value| value.to_str().ok()).is_some_and(|types| types.contains("text/html"))
}

/// Rewrites an error text of the router in the form of all others.
fn in_json(response: Response) -> Response {
    let status = response.status();
    let is_json = response.headers().get(CONTENT_TYPE).is_some_and(|kind| kind == "application/json");
    if !status.is_client_error() || is_json {
        return response;
    }
    let (kind, text) = match status {
        StatusCode::PAYLOAD_TOO_LARGE => ("too_large", "the body is larger than this path takes"),
        StatusCode::METHOD_NOT_ALLOWED => {
            ("method_not_allowed", "this path takes another method: see /api/openapi.json")
        }
        _ => ("malformed", "the request cannot be read"),
    };
    let mut answer = trouble(status, kind, text);
    // The head stays: it has the allowed methods, or the headers of a socket.
    for (name, value) in
        response.headers().iter().filter(|(name, _)| **name != CONTENT_TYPE && **name != CONTENT_LENGTH)
    {
        answer.headers_mut().insert(name, value.clone());
    }
    answer
}

fn refuse(access: &Access, request: &Request) -> Option<Refusal> {
    let (headers, path) = (request.headers(), request.uri().path());
    if !access.is_for_us(headers) {
        let text = "unknown host name: open the server by its address, or start it with --host NAME";
        return Some(Refusal::Trouble(StatusCode::FORBIDDEN, "foreign_host", text));
    }
    let changes = request.method() != Method::GET && request.method() != Method::HEAD;
    if (changes || path == "/ws") && !access.is_from_us(headers) {
        let text = "foreign origin: expected an Origin of http:// followed by the Host";
        return Some(Refusal::Trouble(StatusCode::FORBIDDEN, "foreign_origin", text));
    }
    let token = Query::<TokenQuery>::try_from_uri(request.uri()).ok().and_then(|Query(asked)| asked.token);
    if path == "/" && token.is_some_and(|token| access.is_token(&token)) {
        // Keeps the token out of the address bar and the history.
        Visitor::of(request).into_iter().for_each(Visitor::admit);
        return Some(Refusal::Elsewhere("/", Some(access.cookie())));
    }
    if access.lets_in(headers) {
        Visitor::of(request).into_iter().for_each(Visitor::admit);
        return None;
    }
    // Needed for the password page.
    let open = ["/login", "/api/login", "/page/login.js", "/page/style.css"];
    if access.has_password() && open.contains(&path) {
        return None;
    }
    if access.has_password() && path == "/" {
        return Some(Refusal::Elsewhere("/login", None));
    }
    let text = if access.has_password() {
        "give the password anew (reload this page), or open the address that `ferrodrive studio` printed on its own machine"
    } else {
        "open the address that `ferrodrive studio` printed: it has the token of this launch"
    };
    Some(Refusal::Trouble(StatusCode::UNAUTHORIZED, "no_token", text))
}

async fn state(State(web): State<Web>) -> Response {
    let json = web.handle.states().borrow().json().to_string();
    json_text(json)
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Since {
    #[serde(default)]
    since: u64,
}

/// The timeline of the drives.
async fn faults(State(web): State<Web>, asked: Result<Query<Since>, QueryRejection>) -> Response {
    match asked {
        // Only numbers and texts: serialising cannot fail.
        Ok(Query(Since { since })) => {
            json_text(serde_json::to_string(&web.handle.timeline().since(since)).unwrap_or_default())
        }
        Err(rejection) => trouble(StatusCode::BAD_REQUEST, "malformed", &rejection.body_text()),
    }
}

/// Needs no control, as the button of the page.
async fn stop(State(web): State<Web>) -> Response {
    if web.handle.stop_all() {
        (StatusCode::ACCEPTED, json_text(json!({ "ok": true }).to_string())).into_response()
    } else {
        trouble(StatusCode::SERVICE_UNAVAILABLE, "over", "the studio is ending: use the emergency stop")
    }
}

#[derive(Deserialize)]
struct Credentials {
    password: String,
}

async fn login(State(web): State<Web>, request: Request) -> Response {
    let visitor = Visitor::of(&request).cloned();
    let body = match String::from_request(request, &web).await {
        Ok(body) => body,
        Err(rejection) => return rejection.into_response(),
    };
    let Ok(Credentials { password }) = serde_json::from_str(&body) else {
        return trouble(StatusCode::BAD_REQUEST, "malformed", r#"expected {"password":".."}"#);
    };
    let from = Visitor::origin(visitor.as_ref());
    if web.guessers.has(from) {
        return trouble(
            StatusCode::TOO_MANY_REQUESTS,
            "busy",
            "a wrong password came from your address: try again in a second",
        );
    }
    if web.access.is_password(&password) {
        visitor.iter().for_each(Visitor::admit);
        return ([(SET_COOKIE, web.access.cookie())], json_text(json!({ "ok": true }).to_string())).into_response();
    }
    Arc::clone(&web.guessers).pay(from).await;
    trouble(StatusCode::UNAUTHORIZED, "wrong_password", "wrong password")
}

async fn socket(State(web): State<Web>, upgrade: WebSocketUpgrade) -> Response {
    let handle = web.handle;
    let upgrade = upgrade.max_message_size(LARGEST_MESSAGE).max_frame_size(LARGEST_MESSAGE);
    upgrade.on_upgrade(async move |socket| socket::serve(socket, handle).await)
}
