//! Calls as bytes: a line of JSON that says what to do, and a body behind it; answered in the same form.

use std::path::Path;
use std::time::Duration;

use can::Instant;
use scenario::{Runner, Scenario};
use serde::Deserialize;
use serde_json::{Value, json};
use words::document::give;

use crate::hosted_world::{Failed, HostedWorld};
use crate::requests::{Request, Response};

/// The first line of a call. What else it needs is its body.
#[derive(Debug, Deserialize)]
#[serde(tag = "call", rename_all = "snake_case", deny_unknown_fields)]
enum Call {
    /// A world of the machine file in the body, which replaces the one before.
    Open {
        /// Unix time of the world's zero, for logs.
        #[serde(default)]
        unix_ms: u64,
    },
    /// A new session for the page.
    Join {},
    /// A message of the page, in the body.
    Say {},
    /// Moves the world to this time. The body of the answer has what the page is sent meanwhile, a line for each message.
    Run {
        /// In ns since the world's zero.
        to_ns: u64,
    },
    /// A request of the page.
    Request(Request),
    /// A command to the world, in the body: `4 supply 30`, `4 get`.
    World {},
    /// The world's digest, and its time.
    Digest {},
    /// Runs the scenario in the body from its start to its end.
    Scenario {
        /// In place of the scenario's own.
        seed: Option<u64>,
    },
    /// A data sheet, in the body, for machine files that name it.
    Give {
        /// As the machine file names it.
        name: String,
    },
}

/// What carries out calls: it keeps the world that is open.
#[derive(Default)]
pub struct Library {
    world: Option<HostedWorld>,
}

impl core::fmt::Debug for Library {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Library").finish_non_exhaustive()
    }
}

impl Library {
    /// Carries out one call: `{"call":"open"}`, a line feed, and a machine file. The answer begins with a line `{"ok":true,..}`, or
    /// `{"ok":false,"error":{"kind":"..","message":".."}}`.
    pub fn call(&mut self, call: &[u8]) -> Vec<u8> {
        let end = call.iter().position(|byte| *byte == b'\n').unwrap_or(call.len());
        let body = call.get(end + 1..).unwrap_or_default();
        let done = serde_json::from_slice(&call[..end]).map_err(|error| Failed::new("malformed", error.to_string()));
        done.and_then(|call| self.carry_out(call, body))
            .unwrap_or_else(|Failed { kind, message }| failed(kind, &message))
    }

    fn carry_out(&mut self, call: Call, body: &[u8]) -> Result<Vec<u8>, Failed> {
        match call {
            Call::Open { unix_ms } => {
                let world = HostedWorld::open(text(body)?, Duration::from_millis(unix_ms))?;
                let now = world.now();
                self.world = Some(world);
                Ok(answer(json!({ "now_ns": now.as_nanos() }), &[]))
            }
            Call::Join {} => {
                self.world()?.join();
                Ok(answer(json!({}), &[]))
            }
            Call::Say {} => {
                self.world()?.say(text(body)?);
                Ok(answer(json!({}), &[]))
            }
            Call::Run { to_ns } => {
                let world = self.world()?;
                world.run_until(Instant::from_nanos(to_ns));
                let (now, sent) = (world.now(), world.take_sent());
                Ok(answer(json!({ "now_ns": now.as_nanos() }), sent.join("\n").as_bytes()))
            }
            Call::Request(request) => {
                let Response { status, kind, body } = self.world()?.request(&request, body);
                Ok(answer(json!({ "status": status, "kind": kind }), &body))
            }
            Call::World {} => Ok(answer(json!({}), self.world()?.command(text(body)?)?.as_bytes())),
            Call::Digest {} => {
                let world = self.world()?;
                let digest = format!("{:016x}", world.digest());
                Ok(answer(json!({ "now_ns": world.now().as_nanos(), "digest": digest }), &[]))
            }
            Call::Scenario { seed } => {
                let bad = |bad: words::document::BadFile| Failed::new("bad_file", bad.to_string());
                let scenario = Scenario::parse(text(body)?, Path::new("")).map_err(bad)?;
                let outcome = Runner::new(&scenario, seed).map_err(bad)?.run();
                Ok(answer(json!({ "outcome": outcome.to_json() }), &[]))
            }
            Call::Give { name } => {
                give(Path::new(&name), body.to_vec());
                Ok(answer(json!({}), &[]))
            }
        }
    }

    fn world(&mut self) -> Result<&mut HostedWorld, Failed> {
        self.world.as_mut().ok_or_else(|| Failed::new("no_world", "no world is open: open one first"))
    }
}

fn text(body: &[u8]) -> Result<&str, Failed> {
    std::str::from_utf8(body).map_err(|_| Failed::new("malformed", "not text in UTF-8"))
}

fn answer(mut head: Value, body: &[u8]) -> Vec<u8> {
    head["ok"] = true.into();
    bytes(&head, body)
}

/// The answer to a call that failed.
pub(crate) fn failed(kind: &str, message: &str) -> Vec<u8> {
    bytes(&json!({ "ok": false, "error": { "kind": kind, "message": message } }), &[])
}

fn bytes(head: &Value, body: &[u8]) -> Vec<u8> {
    let mut bytes = head.to_string().into_bytes();
    bytes.push(b'\n');
    bytes.extend_from_slice(body);
    bytes
}
