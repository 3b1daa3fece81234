//! Who may connect, and what a socket withstands. The test takes the place of the host.

mod loaded;

use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::body::Body;
use axum::extract::ConnectInfo;
use axum::http::{Request, StatusCode};
use axum::response::Response;
use futures_util::{SinkExt, StreamExt};
use serde_json::Value;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};
use tokio_tungstenite::tungstenite::client::IntoClientRequest;
use tokio_tungstenite::tungstenite::{Error as SocketError, Message};
use tokio_tungstenite::{MaybeTlsStream, WebSocketStream};
use tower::ServiceExt;

use super::door::Visitor;
use super::{LARGEST_MESSAGE, ROUTES, app, openapi, serve};
use crate::access::{Access, Password};
use can::BusFrame;
use host::Answer;
use host::session::Authority;
use host::session::{HostHandle, Inbox, Request as HostRequest, StateUpdate, channel};
use host::trace::{Origin, Trace};
use host::{BusView, Snapshot};

/// A watchdog against hangs.
const PATIENCE: Duration = Duration::from_secs(600);

const ADDRESS: &str = "127.0.0.1:8402";

type PageSocket = WebSocketStream<MaybeTlsStream<TcpStream>>;

fn server(password: Option<&str>) -> (Router, Arc<Access>, Inbox) {
    let password = password.map(|text| Password::new(text).expect("long enough"));
    let access = Arc::new(Access::new(ADDRESS.parse().expect("an address"), password).expect("loopback"));
    let (handle, inbox) = channel(Trace::new(master::Models::default(), Origin::default()));
    (app(handle, Arc::clone(&access)), access, inbox)
}

fn token(access: &Access) -> String {
    access.url().split_once("token=").expect("it has one").1.to_owned()
}

/// A request with these headers beside Host.
async fn ask(app: &Router, method: &str, path: &str, headers: &[(&str, &str)], body: &str) -> Response {
    let request = Request::builder().method(method).uri(path);
    let host = headers.iter().all(|(name, _)| *name != "host").then_some(("host", ADDRESS));
    let request =
        headers.iter().copied().chain(host).fold(request, |request, (name, value)| request.header(name, value));
    let request = request.body(Body::from(body.to_owned())).expect("a request");
    app.clone().oneshot(request).await.expect("it answers")
}

async fn text(response: Response) -> String {
    let bytes = axum::body::to_bytes(response.into_body(), 1 << 20).await.expect("it ends");
    String::from_utf8(bytes.to_vec()).expect("text")
}

#[tokio::test]
async fn nothing_but_the_token_of_this_launch_opens_the_page() {
    let (app, access, _inbox) = server(None);
    for path in ["/", "/api/state", "/api/openapi.json", "/page/main.js", "/ws", "/login"] {
        let response = ask(&app, "GET", path, &[("origin", "http://127.0.0.1:8402")], "").await;
        assert_eq!(response.status(), StatusCode::UNAUTHORIZED, "{path}");
    }
    let wrong = ask(&app, "GET", "/?token=00000000000000000000000000000000", &[], "").await;
    assert_eq!(wrong.status(), StatusCode::UNAUTHORIZED);
    let opened = ask(&app, "GET", &format!("/?token={}", token(&access)), &[], "").await;
    assert_eq!((opened.status(), &opened.headers()["location"]), (StatusCode::SEE_OTHER, &"/".parse().expect("text")));
    let cookie = opened.headers()["set-cookie"].to_str().expect("text").to_owned();
    assert!(cookie.contains("HttpOnly") && cookie.contains("SameSite=Strict"), "{cookie}");
    assert!(!cookie.contains(&token(&access)), "the cookie is not the token");
    let cookie = cookie.split(';').next().expect("its value");
    let page = ask(&app, "GET", "/", &[("cookie", cookie)], "").await;
    assert_eq!(page.status(), StatusCode::OK);
    assert!(page.headers()["content-security-policy"].to_str().expect("text").contains("script-src 'self'"));
    assert!(text(page).await.contains("page/bundle.js"));
    let bearer = format!("Bearer {}", token(&access));
    assert_eq!(ask(&app, "GET", "/api/state", &[("authorization", &bearer)], "").await.status(), StatusCode::OK);
    let other = [("cookie", "ferrodrive_studio_8402=00000000000000000000000000000000")];
    assert_eq!(ask(&app, "GET", "/api/state", &other, "").await.status(), StatusCode::UNAUTHORIZED);
}

#[tokio::test]
async fn a_page_of_another_site_changes_nothing_even_with_the_cookie() {
    let (app, access, mut inbox) = server(None);
    let bearer = format!("Bearer {}", token(&access));
    let of = |origin: &'static str| [("authorization", bearer.clone()), ("origin", origin.to_owned())];
    for origin in [
        "http://evil.example",
        "http://127.0.0.1:8403",
        "https://127.0.0.1:8402",
        "http://127.0.0.1:8402.evil.example",
        "http://localhost:8402",
        "null",
        "",
    ] {
        let headers = of(origin);
        let headers: Vec<_> = headers.iter().map(|(name, value)| (*name, value.as_str())).collect();
        for (method, path) in [("POST", "/api/stop"), ("GET", "/ws")] {
            let response = ask(&app, method, path, &headers, "").await;
            assert_eq!(response.status(), StatusCode::FORBIDDEN, "{origin} {path}");
        }
    }
    let without = ask(&app, "POST", "/api/stop", &[("authorization", &bearer)], "").await;
    assert_eq!(without.status(), StatusCode::FORBIDDEN, "no Origin at all");
    assert!(!inbox.stops.has_changed().expect("there is a handle"), "nothing was stopped");
    let own = of("http://127.0.0.1:8402");
    let own: Vec<_> = own.iter().map(|(name, value)| (*name, value.as_str())).collect();
    assert_eq!(ask(&app, "POST", "/api/stop", &own, "").await.status(), StatusCode::ACCEPTED);
    assert!(inbox.stops.has_changed().expect("there is a handle"));
    inbox.stops.mark_unchanged();
    let renamed = [("authorization", bearer.as_str()), ("host", "evil.example:8402")];
    assert_eq!(ask(&app, "GET", "/api/state", &renamed, "").await.status(), StatusCode::FORBIDDEN);
}

#[tokio::test]
async fn a_get_moves_and_stops_nothing() {
    let (app, access, inbox) = server(None);
    let bearer = format!("Bearer {}", token(&access));
    let headers = [("authorization", bearer.as_str()), ("origin", "http://127.0.0.1:8402")];
    let stop = ask(&app, "GET", "/api/stop", &headers, "").await;
    assert_eq!(stop.status(), StatusCode::METHOD_NOT_ALLOWED);
    assert!(!inbox.stops.has_changed().expect("there is a handle"));
}

#[tokio::test]
async fn the_document_lists_exactly_the_requests_that_exist() {
    let (app, access, _inbox) = server(None);
    let bearer = format!("Bearer {}", token(&access));
    let headers = [("authorization", bearer.as_str()), ("origin", "http://127.0.0.1:8402")];
    let document = text(ask(&app, "GET", "/api/openapi.json", &headers, "").await).await;
    let document: Value = serde_json::from_str(&document).expect("JSON");
    assert_eq!(document, openapi::document());
    let paths = document["paths"].as_object().expect("paths");
    assert_eq!(paths.len(), ROUTES.len());
    for (path, operations) in paths {
        for (method, operation) in operations.as_object().expect("operations") {
            let response = ask(&app, &method.to_uppercase(), path, &headers, "").await;
            let status = response.status();
            assert!(status != StatusCode::NOT_FOUND && status != StatusCode::METHOD_NOT_ALLOWED, "{method} {path}");
            let got = operation["responses"].as_object().expect("responses");
            // A plain request cannot become a socket.
            assert!(path == "/ws" || got.contains_key(status.as_str()), "{method} {path}: {status}");
        }
        let other = ask(&app, "PUT", path, &headers, "").await;
        assert_eq!(other.status(), StatusCode::METHOD_NOT_ALLOWED, "{path}");
    }
    assert_eq!(ask(&app, "GET", "/api/move", &headers, "").await.status(), StatusCode::NOT_FOUND);
}

#[tokio::test(start_paused = true)]
async fn a_password_opens_and_a_wrong_one_costs_time() {
    let (app, _access, _inbox) = server(Some("correct horse battery"));
    let origin = [("origin", "http://127.0.0.1:8402")];
    let page = ask(&app, "GET", "/", &[], "").await;
    assert_eq!((page.status(), &page.headers()["location"]), (StatusCode::SEE_OTHER, &"/login".parse().expect("text")));
    assert_eq!(ask(&app, "GET", "/login", &[], "").await.status(), StatusCode::OK);
    let guess = ask(&app, "POST", "/api/login", &origin, r#"{"password":"correct horse"}"#);
    let mut guess = std::pin::pin!(guess);
    let at_once = tokio::time::timeout(Duration::from_millis(500), guess.as_mut()).await;
    assert!(at_once.is_err(), "guessing is slow");
    let meanwhile = ask(&app, "POST", "/api/login", &origin, r#"{"password":"correct horse battery"}"#).await;
    assert_eq!(guess.await.status(), StatusCode::UNAUTHORIZED);
    assert_eq!(meanwhile.status(), StatusCode::TOO_MANY_REQUESTS, "and one at a time");
    assert_eq!(ask(&app, "POST", "/api/login", &origin, "password=x").await.status(), StatusCode::BAD_REQUEST);
    let foreign = [("origin", "http://evil.example")];
    let body = r#"{"password":"correct horse battery"}"#;
    assert_eq!(ask(&app, "POST", "/api/login", &foreign, body).await.status(), StatusCode::FORBIDDEN);
    let right = ask(&app, "POST", "/api/login", &origin, body).await;
    assert_eq!(right.status(), StatusCode::OK);
    let cookie = right.headers()["set-cookie"].to_str().expect("text").split(';').next().expect("a value").to_owned();
    assert_eq!(ask(&app, "GET", "/api/state", &[("cookie", &cookie)], "").await.status(), StatusCode::OK);
    let large = "x".repeat(LARGEST_MESSAGE + 1);
    let refused = ask(&app, "POST", "/api/login", &origin, &large).await;
    assert_eq!(refused.status(), StatusCode::PAYLOAD_TOO_LARGE);
    let refused: Value = serde_json::from_str(&text(refused).await).expect("JSON, as all other refusals");
    assert_eq!(refused["error"]["kind"], "too_large");
}

#[tokio::test(start_paused = true)]
async fn guessing_from_one_address_delays_no_other_address() {
    let (app, _access, _inbox) = server(Some("correct horse battery"));
    let login = async |from: [u8; 4], password: &str| {
        let body = serde_json::json!({ "password": password }).to_string();
        let request = Request::builder().method("POST").uri("/api/login").header("host", ADDRESS);
        let mut request = request.header("origin", "http://127.0.0.1:8402").body(Body::from(body)).expect("a request");
        request.extensions_mut().insert(ConnectInfo(Visitor::new((from, 5000).into())));
        app.clone().oneshot(request).await.expect("it answers").status()
    };
    let guesser = [10, 0, 0, 66];
    {
        let mut guess = std::pin::pin!(login(guesser, "incorrect horse"));
        let at_once = tokio::time::timeout(Duration::from_millis(100), guess.as_mut()).await;
        assert!(at_once.is_err());
        // Closing the connection does not shorten the wait.
    }
    assert_eq!(login(guesser, "correct horse battery").await, StatusCode::TOO_MANY_REQUESTS);
    assert_eq!(login([10, 0, 0, 1], "correct horse battery").await, StatusCode::OK, "the owner is admitted");
    tokio::time::sleep(Duration::from_secs(1)).await;
    assert_eq!(login(guesser, "correct horse battery").await, StatusCode::OK);
}

#[tokio::test]
async fn elsewhere_a_name_has_to_be_one_that_was_said() {
    let password = Password::new("correct horse battery").expect("long enough");
    let access = Access::new("0.0.0.0:8402".parse().expect("an address"), Some(password)).expect("with a password");
    let here = access.url();
    assert!(here.starts_with("http://127.0.0.1:8402/?token="), "an address that can be opened: {here}");
    let access = Arc::new(access.with_hosts(vec!["drives.local".to_owned()]));
    let (handle, _inbox) = channel(Trace::new(master::Models::default(), Origin::default()));
    let app = app(handle, access);
    for host in
        ["192.168.1.5:8402", "[2001:db8::1]:8402", "[::1]", "localhost:8402", "drives.local:8402", "Drives.LOCAL"]
    {
        let page = ask(&app, "GET", "/login", &[("host", host)], "").await;
        assert_eq!(page.status(), StatusCode::OK, "{host}");
    }
    let origin = ("origin", "http://evil.example:8402");
    for host in ["evil.example:8402", "drives.local.evil.example", "192.168.1.5.evil.example:8402", ""] {
        let body = r#"{"password":"correct horse battery"}"#;
        let login = ask(&app, "POST", "/api/login", &[("host", host), origin], body).await;
        assert_eq!(login.status(), StatusCode::FORBIDDEN, "{host}");
    }
}

#[tokio::test]
async fn a_person_without_a_token_reads_what_to_do_and_a_program_gets_json() {
    let (app, access, _inbox) = server(None);
    let browser = ("accept", "text/html,application/xhtml+xml,*/*;q=0.8");
    for headers in [&[browser][..], &[browser, ("cookie", "ferrodrive_studio_8402=of an earlier launch")]] {
        let page = ask(&app, "GET", "/", headers, "").await;
        assert_eq!(page.status(), StatusCode::UNAUTHORIZED);
        assert!(page.headers()["content-type"].to_str().expect("text").starts_with("text/html"));
        let page = text(page).await;
        assert!(page.contains("open the address that `ferrodrive studio` printed") && page.contains("emergency stop"));
        assert!(!page.contains(&token(&access)));
    }
    let program = text(ask(&app, "GET", "/api/state", &[], "").await).await;
    assert!(program.contains("no_token"), "{program}");
    let bearer = format!("Bearer {}", token(&access));
    let wrong =
        ask(&app, "PUT", "/api/state", &[("authorization", &bearer), ("origin", "http://127.0.0.1:8402")], "").await;
    assert_eq!(
        (wrong.status(), &wrong.headers()["allow"]),
        (StatusCode::METHOD_NOT_ALLOWED, &"GET,HEAD".parse().expect("text"))
    );
    assert!(text(wrong).await.contains("method_not_allowed"));
}

#[tokio::test]
async fn a_client_with_the_token_is_served_however_many_connections_are_silent() {
    let (access, _handle, _states) = listening().await;
    let mut silent = Vec::new();
    for _ in 0..200 {
        let mut stream = TcpStream::connect(host_of(&access)).await.expect("it takes connections");
        stream.write_all(b"GET / HTTP/1.1\r\nHost: ").await.expect("half a header");
        silent.push(stream);
    }
    // The socket of an open page is authenticated.
    let mut page = open(&access, &format!("http://{}", host_of(&access))).await.expect("it is admitted");
    let mut rest = [0; 1];
    let ended = tokio::time::timeout(PATIENCE, silent[0].read(&mut rest)).await.expect("it is disconnected");
    assert!(matches!(ended, Ok(0) | Err(_)), "{ended:?}");
    for _ in 0..200 {
        silent.push(TcpStream::connect(host_of(&access)).await.expect("it takes connections"));
    }
    page.send(Message::text(r#"{"seq":1,"op":"stop_all"}"#)).await.expect("it is open");
    assert!(matches!(page.next().await, Some(Ok(_))), "and answered");
}

#[tokio::test(start_paused = true)]
async fn half_a_header_has_five_seconds() {
    let (access, _handle, _states) = listening().await;
    let mut stream = TcpStream::connect(host_of(&access)).await.expect("it takes connections");
    stream.write_all(b"GET / HTTP/1.1\r\nHost: ").await.expect("half a header");
    let mut rest = Vec::new();
    let ended = tokio::time::timeout(Duration::from_millis(4900), stream.read_to_end(&mut rest)).await;
    assert!(ended.is_err(), "it may still come");
    let ended = tokio::time::timeout(Duration::from_millis(200), stream.read_to_end(&mut rest)).await;
    assert!(ended.is_ok() && rest.is_empty(), "it did not come: {ended:?}");
}

#[tokio::test]
async fn the_trace_is_saved_with_the_same_frames_in_each_form() {
    let (app, access, inbox) = server(None);
    let bearer = format!("Bearer {}", token(&access));
    let headers = [("authorization", bearer.as_str())];
    let sent = ["704#05", "604#4041600000000000", "584#4B41600050020000"];
    for (at, text) in sent.iter().enumerate() {
        let at = can::Instant::from_millis(at as u64);
        inbox.trace.append(BusFrame { at, frame: text.parse().expect("a frame"), own: false });
    }
    for (ending, format) in [
        ("log", canlog::Format::Candump),
        ("asc", canlog::Format::Asc),
        ("blf", canlog::Format::Blf),
        ("pcapng", canlog::Format::Pcapng),
    ] {
        let saved = ask(&app, "GET", &format!("/api/trace.{ending}"), &headers, "").await;
        assert_eq!(saved.status(), StatusCode::OK, "{ending}");
        let bytes = axum::body::to_bytes(saved.into_body(), 1 << 20).await.expect("it ends");
        let entries = canlog::LogReader::new(&bytes[..], format).map(|entry| entry.expect("it is read"));
        let frames: Vec<String> = entries
            .filter_map(|entry| match entry {
                canlog::Entry::Record(canlog::Record { content: canlog::Content::Frame(frame), .. }) => {
                    Some(frame.to_string())
                }
                _ => None,
            })
            .collect();
        assert_eq!(frames, sent, "{ending}");
    }
}

#[tokio::test]
async fn the_trace_is_asked_for_in_parts_and_saved_by_few_at_a_time() {
    let (app, access, inbox) = server(None);
    let bearer = format!("Bearer {}", token(&access));
    let headers = [("authorization", bearer.as_str())];
    let frames = 10_000;
    for number in 0..frames {
        let at = can::Instant::from_millis(number);
        inbox.trace.append(BusFrame { at, frame: "704#05".parse().expect("a frame"), own: false });
    }
    let part = text(ask(&app, "GET", "/api/trace?after=9990&node=4&kind=heartbeat", &headers, "").await).await;
    let part: Value = serde_json::from_str(&part).expect("JSON");
    assert_eq!((&part["from"], &part["to"], &part["skipped"]), (&9990.into(), &frames.into(), &0.into()));
    assert_eq!(part["lines"].as_array().expect("lines").len(), 10);
    for wrong in ["after=x", "node=0", "kind=heartbeats", "nodes=4", "from_s=NaN"] {
        let refused = ask(&app, "GET", &format!("/api/trace?{wrong}"), &headers, "").await;
        assert_eq!(refused.status(), StatusCode::BAD_REQUEST, "{wrong}");
    }
    let mut saving = Vec::new();
    while saving.len() < 100 {
        let log = ask(&app, "GET", "/api/trace.log", &headers, "").await;
        if log.status() == StatusCode::TOO_MANY_REQUESTS {
            break;
        }
        saving.push(log);
    }
    assert!((1..100).contains(&saving.len()), "a download holds frames that are no longer kept");
    for log in saving {
        let log = text(log).await;
        assert_eq!(log.lines().count() as u64, frames);
        assert_eq!(log.lines().last(), Some("(0000000009.999000) can0 704#05 R"));
    }
    assert_eq!(ask(&app, "GET", "/api/trace.log", &headers, "").await.status(), StatusCode::OK, "there is room again");
}

/// A server at its own port, whose host answers every request with success.
async fn listening() -> (Arc<Access>, HostHandle, tokio::sync::watch::Sender<StateUpdate>) {
    let listener = TcpListener::bind("127.0.0.1:0").await.expect("a free port");
    let access = Arc::new(Access::new(listener.local_addr().expect("bound"), None).expect("loopback"));
    let (handle, inbox) = channel(Trace::new(master::Models::default(), Origin::default()));
    let Inbox { mut requests, states, .. } = inbox;
    let served = app(handle.clone(), Arc::clone(&access));
    tokio::spawn(serve(listener, served));
    tokio::spawn(async move {
        let mut authority = Authority::default();
        while let Some(request) = requests.recv().await {
            match request {
                HostRequest::Join { liveness, welcome } => {
                    let _ = welcome.send(authority.join());
                    drop(liveness);
                }
                HostRequest::Do { session, seq, answer, .. } => {
                    let _ = answer.send(match authority.accept(session, seq) {
                        Ok(()) => Answer::done(seq, Vec::new()),
                        Err(refusal) => Answer::failed(Some(seq), refusal.kind(), refusal.to_string()),
                    });
                }
            }
        }
    });
    (access, handle, states)
}

fn host_of(access: &Access) -> String {
    access.url().trim_start_matches("http://").split('/').next().expect("a host").to_owned()
}

async fn open(access: &Access, origin: &str) -> Result<PageSocket, SocketError> {
    let mut request = format!("ws://{}/ws", host_of(access)).into_client_request().expect("an address");
    let bearer = format!("Bearer {}", token(access));
    request.headers_mut().insert("authorization", bearer.parse().expect("text"));
    request.headers_mut().insert("origin", origin.parse().expect("text"));
    let opened = tokio::time::timeout(PATIENCE, tokio_tungstenite::connect_async(request)).await;
    opened.expect("it answers").map(|(socket, _)| socket)
}

async fn page(access: &Access) -> (PageSocket, Value) {
    let mut socket = open(access, &format!("http://{}", host_of(access))).await.expect("it is admitted");
    let welcome = next(&mut socket).await.expect("a welcome");
    assert_eq!(welcome["type"], "welcome");
    (socket, welcome)
}

/// The next message; `None` at the end of the connection.
async fn next(socket: &mut PageSocket) -> Option<Value> {
    loop {
        match tokio::time::timeout(PATIENCE, socket.next()).await.expect("something comes")? {
            Ok(Message::Text(text)) => return Some(serde_json::from_str(&text).expect("JSON")),
            Ok(Message::Close(_)) | Err(_) => return None,
            Ok(_) => {}
        }
    }
}

async fn send(socket: &mut PageSocket, text: String) -> Option<Value> {
    socket.send(Message::Text(text.into())).await.ok()?;
    next(socket).await
}

#[tokio::test]
async fn a_socket_is_for_pages_of_this_server() {
    let (access, _handle, _states) = listening().await;
    for origin in ["http://evil.example", "http://127.0.0.1", "null"] {
        let Err(SocketError::Http(response)) = open(&access, origin).await else { panic!("{origin} was admitted") };
        assert_eq!(response.status(), StatusCode::FORBIDDEN, "{origin}");
    }
}

#[tokio::test]
async fn malformed_messages_are_answered_and_the_next_one_is_processed() {
    let (access, _handle, _states) = listening().await;
    let (mut socket, welcome) = page(&access).await;
    let (_, elsewhere) = page(&access).await;
    let message = |seq: u64, word: &Value| format!(r#"{{"seq":{seq},"session":{word},"do":"alive"}}"#);
    for (text, kind) in [
        (String::new(), "malformed"),
        ("\u{0}".into(), "malformed"),
        ("[".repeat(5000), "malformed"),
        (message(1, &"x".into()), "foreign_session"),
        (message(1, &elsewhere["word"]), "foreign_session"),
    ] {
        let answer = send(&mut socket, text).await.expect("it is answered");
        assert_eq!((&answer["ok"], &answer["error"]["kind"]), (&false.into(), &kind.into()));
    }
    let heard = send(&mut socket, message(1, &welcome["word"])).await.expect("it is answered");
    assert_eq!((&heard["ok"], &heard["seq"]), (&true.into(), &1.into()));
    let again = send(&mut socket, message(1, &welcome["word"])).await.expect("it is answered");
    assert_eq!(again["error"]["kind"], "replayed");
    socket.send(Message::Binary(vec![0; 9].into())).await.expect("sent");
    assert_eq!(next(&mut socket).await.expect("answered")["error"]["kind"], "malformed");
}

#[tokio::test]
async fn a_message_that_is_too_large_ends_its_connection() {
    let (access, _handle, _states) = listening().await;
    let (mut socket, _) = page(&access).await;
    assert_eq!(send(&mut socket, " ".repeat(LARGEST_MESSAGE + 1)).await, None);
}

#[tokio::test]
async fn two_hundred_pages_all_get_the_newest_state() {
    let (access, _handle, states) = listening().await;
    let mut pages = Vec::new();
    for _ in 0..200 {
        pages.push(page(&access).await.0);
    }
    states.send_replace(Snapshot { number: 7, ..Snapshot::default() }.into());
    for socket in &mut pages {
        // States from before the page connected are not missed ones.
        let got = next(socket).await.expect("a state");
        let shown = if got["type"] == "dropped" { next(socket).await.expect("a state") } else { got };
        assert_eq!(shown["number"], 7);
    }
}

#[tokio::test]
async fn a_page_that_reads_slowly_gets_the_number_of_missed_states_and_costs_no_more_memory() {
    let (access, handle, states) = listening().await;
    let (mut socket, _) = page(&access).await;
    // Far more than the buffers of two sockets hold.
    let filling = "x".repeat(256 << 10);
    let count = 200;
    for number in 1..=count {
        let bus = BusView { name: filling.clone(), ..BusView::default() };
        states.send_replace(Snapshot { number, bus, ..Snapshot::default() }.into());
        tokio::task::yield_now().await;
    }
    assert_eq!(handle.states().borrow().snapshot().number, count, "the host did not wait for the page");
    let (mut shown, mut missed) = (0, 0);
    loop {
        let got = next(&mut socket).await.expect("a state, or how many were missed");
        match got["type"].as_str() {
            Some("dropped") => missed += got["count"].as_u64().expect("a number"),
            _ => {
                shown += 1;
                if got["number"] == count {
                    break;
                }
            }
        }
    }
    assert_eq!(shown + missed, count, "each is shown or counted");
    assert!(missed > 0, "states are not queued");
}

/// A client that never reads does not keep its place: its download ends.
#[tokio::test(start_paused = true)]
async fn a_client_that_does_not_read_its_log_loses_its_place() {
    let (app, access, inbox) = server(None);
    let bearer = format!("Bearer {}", token(&access));
    let headers = [("authorization", bearer.as_str())];
    for number in 0..10_000 {
        let at = can::Instant::from_millis(number);
        inbox.trace.append(BusFrame { at, frame: "704#05".parse().expect("a frame"), own: false });
    }
    let mut idle = Vec::new();
    loop {
        let log = ask(&app, "GET", "/api/trace.log", &headers, "").await;
        if log.status() == StatusCode::TOO_MANY_REQUESTS {
            break;
        }
        assert!(idle.len() < 100, "places are few");
        idle.push(log);
    }
    tokio::time::sleep(std::time::Duration::from_secs(25)).await;
    let log = ask(&app, "GET", "/api/trace.log", &headers, "").await;
    assert_eq!(text(log).await.lines().count(), 10_000);
    for log in idle {
        assert_eq!(text(log).await, "", "it has ended");
    }
}

#[tokio::test]
async fn values_kept_in_a_page_become_mcap() {
    let (app, access, _inbox) = server(None);
    let bearer = format!("Bearer {}", token(&access));
    let headers = [("authorization", bearer.as_str()), ("origin", "http://127.0.0.1:8402")];
    let csv = "t_s,4.velocity_rpm,4.606C_00,mark\n0.5,60,,\n0.625,,600,world: 4 cable cut\n";
    let made = ask(&app, "POST", "/api/recording.mcap", &headers, csv).await;
    assert_eq!(made.status(), StatusCode::OK);
    let file = axum::body::to_bytes(made.into_body(), usize::MAX).await.expect("bytes");
    let recorded = recording::read(recording::Kind::Mcap, &file).expect("MCAP");
    let points = |signal: &str| {
        let series = recorded.series.iter().find(|series| series.column.signal == signal).expect("a series");
        series.points.iter().copied().filter(|(_, value)| !value.is_nan()).collect::<Vec<_>>()
    };
    assert_eq!((points("velocity_rpm"), points("606C_00")), (vec![(0.5, 60.0)], vec![(0.625, 600.0)]));
    assert_eq!(recorded.marks[0].text, "world: 4 cable cut");
    let wrong = ask(&app, "POST", "/api/recording.mcap", &headers, "speed\n60\n").await;
    assert_eq!(wrong.status(), StatusCode::BAD_REQUEST);
    assert!(text(wrong).await.contains("t_s"));
    let foreign = [("authorization", bearer.as_str()), ("origin", "http://evil.example")];
    assert_eq!(ask(&app, "POST", "/api/recording.mcap", &foreign, csv).await.status(), StatusCode::FORBIDDEN);
    let large = "1".repeat((32 << 20) + 1);
    assert_eq!(
        ask(&app, "POST", "/api/recording.mcap", &headers, &large).await.status(),
        StatusCode::PAYLOAD_TOO_LARGE
    );
}

#[tokio::test]
async fn a_dcf_that_a_page_has_chosen_becomes_toml() {
    let (app, access, _inbox) = server(None);
    let bearer = format!("Bearer {}", token(&access));
    let headers = [("authorization", bearer.as_str()), ("origin", "http://127.0.0.1:8402")];
    // CiA 306-1, 4.6.2 and 4.9: $NODEID in a value, and the node-ID of the DCF.
    let dcf = |node: &str| {
        format!(
            "[FileInfo]\nFileName=a.dcf\n[DeviceInfo]\nVendorNumber=0\n[DeviceComissioning]\n{node}\n\
             [MandatoryObjects]\nSupportedObjects=1\n1=0x1000\n[OptionalObjects]\nSupportedObjects=1\n1=0x2008\n\
             [1000]\nParameterName=Type\nObjectType=7\nDataType=7\nAccessType=ro\nPDOMapping=0\n\
             [2008]\nParameterName=Start\nObjectType=7\nDataType=6\nAccessType=rw\nPDOMapping=0\nParameterValue=$NODEID+0x20\n"
        )
    };
    let post = async |path: &str, body: &str| {
        let answer = ask(&app, "POST", path, &headers, body).await;
        (answer.status(), text(answer).await)
    };
    for (path, node, value) in [
        ("/api/parameters.toml?node=4", "NodeID=5", "hex:2500"),
        ("/api/parameters.toml?node=4", "NetNumber=1", "hex:2400"),
    ] {
        let (status, toml) = post(path, &dcf(node)).await;
        assert_eq!(status, StatusCode::OK, "{toml}");
        assert!(toml.contains(&format!("\"2008:00\" = \"{value}\"")), "{toml}");
    }
    for (path, body, why) in [
        ("/api/parameters.toml?node=128", dcf("NodeID=5"), "1 to 127"),
        ("/api/parameters.toml?nodes=4", dcf("NodeID=5"), "nodes"),
        ("/api/parameters.toml", "[values]\n\"2008\" = 1\n".to_owned(), "data sheet"),
        ("/api/parameters.toml", dcf("NodeID=5").replace("$NODEID+0x20", "70000"), "line"),
    ] {
        let (status, said) = post(path, &body).await;
        assert_eq!(status, StatusCode::BAD_REQUEST, "{said}");
        assert!(said.contains(why), "{said}");
    }
    let (status, _) = post("/api/parameters.toml", &";".repeat((1 << 20) + 1)).await;
    assert_eq!(status, StatusCode::PAYLOAD_TOO_LARGE);
}
