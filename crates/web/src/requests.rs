//! What the views of the page request beside their messages: the paths of the studio's server, without one.

use canopen::NodeId;
use host::HostHandle;
use host::trace::{Asked, AskedSeries};
use machine::parameters::{of_dcf, sheet};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::json;

const JSON: &str = "application/json";

/// A request, without its body.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
pub struct Request {
    /// Path and query: `/api/trace?count=500`.
    pub path: String,
}

/// Its answer, as HTTP has them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Response {
    /// The status.
    pub status: u16,
    /// The type of the content.
    pub kind: &'static str,
    /// The content.
    pub body: Vec<u8>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Since {
    #[serde(default)]
    since: u64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct OfNode {
    node: Option<u8>,
}

/// The answer to a request that needs no host.
pub(crate) fn respond_without_host(request: &Request) -> Option<Response> {
    let path = request.path.split('?').next();
    (path == Some("/api/power-states")).then(|| of_text(JSON, host::page::power_states()))
}

pub(crate) fn respond(handle: &HostHandle, request: &Request, body: &[u8]) -> Response {
    if let Some(response) = respond_without_host(request) {
        return response;
    }
    let (path, query) = request.path.split_once('?').unwrap_or((&request.path, ""));
    let answered = match path {
        "/api/state" => Ok(of_text(JSON, handle.states().borrow().json().to_string())),
        "/api/faults" => parameters::<Since>(query).map(|Since { since }| of_json(&handle.timeline().since(since))),
        "/api/trace" => trace(handle, query),
        "/api/trace/identifiers" => parameters::<Asked>(query)
            .and_then(Asked::understand)
            .map(|query| of_json(&query.identifiers(&handle.trace().held()))),
        "/api/trace.log" => log(handle, query),
        "/api/series" => {
            let asked = parameters::<AskedSeries>(query).and_then(AskedSeries::understand);
            asked.map(|query| of_json(&query.values(&handle.trace().held())))
        }
        "/api/parameters.toml" => parameters::<OfNode>(query).and_then(|OfNode { node }| {
            let node = NodeId::new(node.unwrap_or(1)).ok_or("expected a node-ID from 1 to 127")?;
            of_dcf(body, node).map(|parameters| of_text("application/toml", sheet::print(&parameters, None)))
        }),
        "/api/stop" => {
            handle.stop_all();
            Ok(of_json(&json!({ "ok": true })))
        }
        "/api/recording.mcap" => return not_here("does not make MCAP files: save a CSV"),
        "/api/recording" | "/api/recording/identified" | "/api/trace/load" => {
            return not_here("does not read records and logs: the studio does (ferrodrive studio)");
        }
        "/api/trace.asc" | "/api/trace.blf" | "/api/trace.pcapng" => {
            return not_here("saves the trace as a candump log only; ferrodrive convert makes the other forms of it");
        }
        _ => return trouble(404, "not_found", "there is nothing at this path"),
    };
    answered.unwrap_or_else(|why| trouble(400, "malformed", &why))
}

fn not_here(why: &str) -> Response {
    trouble(501, "not_here", &format!("a page without a server {why}"))
}

fn trace(handle: &HostHandle, query: &str) -> Result<Response, String> {
    let query = parameters::<Asked>(query).and_then(Asked::understand)?;
    Ok(of_json(&query.select(&handle.trace().held())))
}

fn log(handle: &HostHandle, query: &str) -> Result<Response, String> {
    let query = parameters::<Asked>(query).and_then(Asked::understand)?;
    let trace = handle.trace();
    trace.note_saved();
    let held = trace.held();
    let (mut text, mut next) = (String::new(), 0);
    while let Some(part) = query.log_part(&held, trace.origin(), next) {
        text += &part.text;
        next = part.next;
    }
    Ok(of_text("text/plain; charset=utf-8", text))
}

fn parameters<T: DeserializeOwned>(query: &str) -> Result<T, String> {
    serde_urlencoded::from_str(query).map_err(|error| error.to_string())
}

fn of_text(kind: &'static str, text: String) -> Response {
    Response { status: 200, kind, body: text.into_bytes() }
}

fn of_json(value: &impl Serialize) -> Response {
    // Only names, numbers and lists: serialising cannot fail.
    of_text(JSON, serde_json::to_string(value).unwrap_or_default())
}

fn trouble(status: u16, kind: &str, message: &str) -> Response {
    let body = json!({ "ok": false, "error": { "kind": kind, "message": message } });
    Response { status, ..of_json(&body) }
}
