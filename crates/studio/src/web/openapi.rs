//! The table of requests, from which the router and the document at `/api/openapi.json` are made.

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
    Faults,
    Series,
    Trace,
    TraceLog,
    TraceAsc,
    TraceBlf,
    TracePcapng,
    Identifiers,
    TraceLoad,
    Loaded,
    LoadedIdentifiers,
    RecordingMcap,
    Recording,
    Identified,
    ParametersToml,
}

/// One request.
pub(super) struct Route {
    pub(super) path: &'static str,
    pub(super) method: &'static str,
    pub(super) operation: Operation,
    summary: &'static str,
    /// Each status of its answers, with its meaning.
    answers: &'static [(&'static str, &'static str)],
}

const LET_IN: (&str, &str) = ("401", "Neither a cookie nor a token");
const MALFORMED: (&str, &str) = ("400", "A parameter is not valid");
const OVER: (&str, &str) = ("503", "The studio is ending");
const FOREIGN: (&str, &str) = ("403", "The Origin or the Host is not that of this server");

const REPLACED: (&str, &str) = ("404", "Another log was loaded since");

/// The answers to a request for a log in a form that is made as a whole.
const SAVED: &[(&str, &str)] =
    &[("200", "The frames of the chosen nodes and kinds"), MALFORMED, LET_IN, ("429", "Others are fetching it"), OVER];

/// All requests. No GET changes anything, and no request moves a drive: motion goes through the socket, where it is held.
pub(super) const ROUTES: [Route; 21] = [
    Route {
        path: "/api/state",
        method: "get",
        operation: Operation::State,
        summary: "The bus, its nodes, and the values of each drive",
        answers: &[("200", "The newest state"), LET_IN],
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
        answers: &[("202", "The drives are being stopped"), LET_IN, FOREIGN, OVER],
    },
    Route {
        path: "/api/login",
        method: "post",
        operation: Operation::Login,
        summary: "Exchange the password for a cookie, if a password is set",
        answers: &[
            ("200", "The cookie is set"),
            ("400", "The body is not {\"password\":\"..\"}"),
            ("401", "Wrong password"),
            FOREIGN,
            ("429", "Another password is being checked"),
        ],
    },
    Route {
        path: "/ws",
        method: "get",
        operation: Operation::Socket,
        summary: "A WebSocket: states and news to the page, commands from it, one JSON object per message",
        answers: &[("101", "Welcome"), LET_IN, FOREIGN],
    },
    Route {
        path: "/api/faults",
        method: "get",
        operation: Operation::Faults,
        summary: "What has happened to the drives: emergency messages, faults with remedies, states",
        answers: &[("200", "New and changed entries since a revision, oldest first"), MALFORMED, LET_IN],
    },
    Route {
        path: "/api/series",
        method: "get",
        operation: Operation::Series,
        summary: "Values of objects over time, from the kept PDOs and SDO transfers; without objects, the list of objects",
        answers: &[
            ("200", "Times of the bus in s, and values in the unit of the object's row"),
            MALFORMED,
            LET_IN,
            OVER,
        ],
    },
    Route {
        path: "/api/trace",
        method: "get",
        operation: Operation::Trace,
        summary: "The newest kept frames, in words",
        answers: &[("200", "Lines, oldest first, and the range of frames that they cover"), MALFORMED, LET_IN, OVER],
    },
    Route {
        path: "/api/trace.log",
        method: "get",
        operation: Operation::TraceLog,
        summary: "All kept frames, as a candump log; text, transfers and quiet are ignored",
        answers: &[("200", "One frame per line"), MALFORMED, LET_IN, ("429", "Others are fetching it"), OVER],
    },
    Route {
        path: "/api/trace.asc",
        method: "get",
        operation: Operation::TraceAsc,
        summary: "All kept frames, as Vector ASCII",
        answers: SAVED,
    },
    Route {
        path: "/api/trace.blf",
        method: "get",
        operation: Operation::TraceBlf,
        summary: "All kept frames, in the binary form of Vector",
        answers: SAVED,
    },
    Route {
        path: "/api/trace.pcapng",
        method: "get",
        operation: Operation::TracePcapng,
        summary: "All kept frames, for Wireshark",
        answers: SAVED,
    },
    Route {
        path: "/api/trace/identifiers",
        method: "get",
        operation: Operation::Identifiers,
        summary: "The kept frames by identifier: how many, how far apart, and the last one in words; transfers and count are ignored",
        answers: &[
            ("200", "A row for each identifier, of the newest frames after the given one"),
            MALFORMED,
            LET_IN,
            OVER,
        ],
    },
    Route {
        path: "/api/trace/load",
        method: "post",
        operation: Operation::TraceLoad,
        summary: "Load a log of frames, the body, in any form that ferrodrive reads; the newest one is kept",
        answers: &[
            ("200", "Its number, its frames, the number of the first one that is kept, and what was not read"),
            ("400", "The body is not such a log"),
            LET_IN,
            FOREIGN,
            ("413", "More than 32 MB"),
            ("429", "Another file is being read"),
            OVER,
        ],
    },
    Route {
        path: "/api/trace/loaded/{log}",
        method: "get",
        operation: Operation::Loaded,
        summary: "Frames of a loaded log, as those of /api/trace; times are from its first frame on",
        answers: &[
            ("200", "Lines, oldest first, and the range of frames that they cover"),
            MALFORMED,
            LET_IN,
            REPLACED,
            OVER,
        ],
    },
    Route {
        path: "/api/trace/loaded/{log}/identifiers",
        method: "get",
        operation: Operation::LoadedIdentifiers,
        summary: "Frames of a loaded log by identifier, as those of /api/trace/identifiers",
        answers: &[("200", "A row for each identifier"), MALFORMED, LET_IN, REPLACED, OVER],
    },
    Route {
        path: "/api/recording.mcap",
        method: "post",
        operation: Operation::RecordingMcap,
        summary: "A record as MCAP; the body is the record as CSV: t_s, a column for each signal such as 4.velocity_rpm, mark",
        answers: &[
            ("200", "MCAP"),
            ("400", "The body is not such a CSV"),
            LET_IN,
            FOREIGN,
            ("413", "More than 32 MB"),
            ("429", "Another record is being converted"),
            OVER,
        ],
    },
    Route {
        path: "/api/recording",
        method: "post",
        operation: Operation::Recording,
        summary: "The values of a file, the body: a record (MCAP, CSV), or a log of frames in any form that ferrodrive reads",
        answers: &[
            ("200", "Columns with times in s and values, what happened, and what was not read"),
            ("400", "The body is not such a file"),
            LET_IN,
            FOREIGN,
            ("413", "More than 32 MB"),
            ("429", "Another record is being read"),
            OVER,
        ],
    },
    Route {
        path: "/api/recording/identified",
        method: "post",
        operation: Operation::Identified,
        summary: "What a file shows of a drive, as `ferrodrive tune --capture`: frequency response, masses, speed loop; the body is as for /api/recording",
        answers: &[
            ("200", "What was found"),
            ("400", "The body is not such a file, or what it lacks"),
            LET_IN,
            FOREIGN,
            ("413", "More than 32 MB"),
            ("429", "Another record is being read"),
            OVER,
        ],
    },
    Route {
        path: "/api/parameters.toml",
        method: "post",
        operation: Operation::ParametersToml,
        summary: "The parameters of a DCF (CiA 306-1), the body, as the TOML of `ferrodrive params`",
        answers: &[
            ("200", "TOML"),
            ("400", "The body is not a complete DCF"),
            LET_IN,
            FOREIGN,
            ("413", "More than 1 MB"),
            ("429", "Another file is being read"),
            OVER,
        ],
    },
];

/// The query parameters of a request: name, JSON type, meaning.
const fn parameters(operation: Operation) -> &'static [(&'static str, &'static str, &'static str)] {
    match operation {
        Operation::Trace
        | Operation::TraceLog
        | Operation::TraceAsc
        | Operation::TraceBlf
        | Operation::TracePcapng
        | Operation::Identifiers
        | Operation::Loaded
        | Operation::LoadedIdentifiers => &[
            ("after", "integer", "Only frames from this number on"),
            ("before", "integer", "Only frames below this number"),
            ("from_s", "number", "Only frames from this time of the bus on"),
            ("until_s", "number", "Only frames before this time of the bus"),
            ("count", "integer", "Most lines, 1 to 2000; default 500"),
            ("node", "string", "Only lines about these node-IDs, separated by commas"),
            (
                "kind",
                "string",
                "Only nmt, sync, time, emcy, pdo, sdo, heartbeat, lss, other; several separated by commas",
            ),
            ("text", "string", "Only lines that have all these words, separated by commas"),
            ("transfers", "boolean", "One line for each SDO transfer, not for each of its frames"),
            ("quiet", "boolean", "Without the SDO transfers of the studio itself"),
        ],
        Operation::Series => &[
            (
                "objects",
                "string",
                "Objects, as NODE:INDEX:SUB in hexadecimal, separated by commas: 4:606C:00,4:6064:00",
            ),
            ("after", "integer", "Only frames from this number on"),
        ],
        Operation::Recording | Operation::TraceLoad => {
            &[("name", "string", "Name of the file: its ending shows what it is")]
        }
        Operation::Identified => &[
            ("name", "string", "Name of the file: its ending shows what it is"),
            ("node", "integer", "The node, 1 to 127, where the file has several"),
        ],
        Operation::ParametersToml => &[("node", "integer", "The node-ID to use if the file has none, 1 to 127")],
        Operation::Faults => &[("since", "integer", "The revision of the last answer; 0 for everything")],
        _ => &[],
    }
}

/// The document.
pub(super) fn document() -> Value {
    let mut paths = Map::new();
    for route in &ROUTES {
        let answers: Map<String, Value> =
            route.answers.iter().map(|(status, text)| ((*status).to_owned(), json!({ "description": text }))).collect();
        let parameter = |(name, kind, text): &(&str, &str, &str)| json!({ "name": name, "in": "query", "description": text, "schema": { "type": kind } });
        let of_path = route.path.contains("{log}").then(|| {
            let text = "Number of the log, as /api/trace/load has answered";
            json!({ "name": "log", "in": "path", "required": true, "description": text, "schema": { "type": "integer" } })
        });
        let of_query = parameters(route.operation).iter().map(parameter);
        let operation = json!({
            "operationId": format!("{:?}", route.operation),
            "summary": route.summary,
            "parameters": of_path.into_iter().chain(of_query).collect::<Vec<_>>(),
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
