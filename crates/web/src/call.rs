//! Calls as bytes: a line of JSON that says what to do, and a body behind it; answered in the same form.

use std::path::Path;
use std::time::Duration;

use can::{Bitrate, Instant};
use scenario::{Runner, Scenario};
use serde::Deserialize;
use serde_json::{Map, Value, json};
use sim::StoredImage;
use words::document::give;

use crate::hosted_world::{Failed, HostedWorld, Stored};
use crate::requests::{Request, Response};
use crate::serial_host::{Line, SerialHost};

/// The first line of a call, by the word in its field `call`. What else it needs is its body.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
enum Call {
    /// A world of the machine file in the body, which replaces the one before.
    Open {
        /// Unix time of the world's zero, for logs.
        #[serde(default)]
        unix_ms: u64,
        /// What its drives have stored before.
        #[serde(default)]
        stored: Vec<StoredText>,
        /// The caller keeps what drives store: a drive acknowledges it when `kept` has come.
        #[serde(default)]
        keeps: bool,
    },
    /// A content that `run` gave is kept.
    Kept {
        /// That of the drive.
        number: u8,
        /// That of the content.
        generation: u64,
    },
    /// A new session for the page.
    Join {},
    /// A message of the page, in the body.
    Say {},
    /// Moves the world to this time. The body of the answer has what the page is sent meanwhile, a line for each message; `stored` is
    /// what drives have stored, for callers that keep it.
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
    /// A host for the bus behind a serial adapter, which replaces what was open; its port comes with `serial`.
    OpenSerial {
        /// What the bus is called.
        name: String,
        /// In bit/s.
        bitrate: u32,
        /// Unix time of `now_ns` 0, for logs.
        #[serde(default)]
        unix_ms: u64,
        /// The clock of the caller.
        now_ns: u64,
    },
    /// Brings a host on a serial adapter to this time, with what its port has brought in the body. The body of the answer has `wire` bytes
    /// for the port, and then what the page is sent, a line for each message.
    Serial {
        /// The clock of the caller.
        now_ns: u64,
        /// What has happened to the port, or the page.
        event: Option<PortEvent>,
    },
    /// A data sheet, in the body, for machine files that name it.
    Give {
        /// As the machine file names it.
        name: String,
    },
}

/// What a drive has stored, as text.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredText {
    number: u8,
    model: String,
    /// Two hexadecimal digits for each byte.
    image: String,
}

/// What has happened to a port, or to the page that has it.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
enum PortEvent {
    /// There is one.
    Plugged,
    /// It is lost; why.
    Unplugged(String),
    /// The page can no longer be relied on: its session ends, and what it moved is stopped.
    LetGo(String),
    /// The page takes leave of the adapter: what it moved is stopped, and the drives' watches over this host are given back.
    Leave,
    /// The channel of the adapter is to be closed.
    Close,
}

/// What carries out calls: it keeps the world that is open.
#[derive(Default)]
pub struct Library {
    world: Option<HostedWorld>,
    serial: Option<SerialHost>,
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
        read(&call[..end])
            .map_err(|error| Failed::new("malformed", error.to_string()))
            .and_then(|call| self.carry_out(call, body))
            .unwrap_or_else(|Failed { kind, message }| failed(kind, &message))
    }

    fn carry_out(&mut self, call: Call, body: &[u8]) -> Result<Vec<u8>, Failed> {
        match call {
            Call::Open { unix_ms, stored, keeps } => {
                let stored: Vec<_> = stored.into_iter().map(Stored::from).collect();
                let zero = Duration::from_millis(unix_ms);
                let (world, unusable) = HostedWorld::open_with(text(body)?, zero, &stored, keeps)?;
                let now = world.now();
                (self.world, self.serial) = (Some(world), None);
                Ok(answer(json!({ "now_ns": now.as_nanos(), "unusable": unusable }), &[]))
            }
            Call::Kept { number, generation } => {
                self.world()?.confirm_store(number, generation);
                Ok(answer(json!({}), &[]))
            }
            Call::Join {} => {
                match &mut self.serial {
                    Some(serial) => serial.join(),
                    None => self.world()?.join(),
                }
                Ok(answer(json!({}), &[]))
            }
            Call::Say {} => {
                match &mut self.serial {
                    Some(serial) => serial.say(text(body)?),
                    None => self.world()?.say(text(body)?),
                }
                Ok(answer(json!({}), &[]))
            }
            Call::Run { to_ns } => {
                let world = self.world()?;
                world.run_until(Instant::from_nanos(to_ns));
                let (now, sent) = (world.now(), world.take_sent());
                let stored: Vec<_> = world.take_stores().iter().map(of_store).collect();
                Ok(answer(json!({ "now_ns": now.as_nanos(), "stored": stored }), sent.join("\n").as_bytes()))
            }
            Call::Request(request) => {
                let Response { status, kind, body } = match &self.serial {
                    Some(serial) => serial.request(&request, body)?,
                    None => self.world()?.request(&request, body),
                };
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
            Call::OpenSerial { name, bitrate, unix_ms, now_ns } => {
                let bitrate =
                    Bitrate::new(bitrate).ok_or_else(|| Failed::new("usage", "expected a bit rate in bit/s"))?;
                let (zero, now) = (Duration::from_millis(unix_ms), Instant::from_nanos(now_ns));
                (self.world, self.serial) = (None, Some(SerialHost::new(&name, bitrate, zero, now)?));
                Ok(answer(json!({}), &[]))
            }
            Call::Serial { now_ns, event } => self.run_serial(Instant::from_nanos(now_ns), event, body),
            Call::Give { name } => {
                give(Path::new(&name), body.to_vec());
                Ok(answer(json!({}), &[]))
            }
        }
    }

    fn run_serial(&mut self, now: Instant, event: Option<PortEvent>, body: &[u8]) -> Result<Vec<u8>, Failed> {
        let no_port = || Failed::new("no_bus", "no bus of a serial adapter is open: open one first");
        let serial = self.serial.as_mut().ok_or_else(no_port)?;
        serial.run(body, now);
        match event {
            Some(PortEvent::Plugged) => serial.plug(),
            Some(PortEvent::Unplugged(why)) => serial.unplug(&why),
            Some(PortEvent::LetGo(why)) => serial.let_go(&why),
            Some(PortEvent::Leave) => serial.take_leave(),
            Some(PortEvent::Close) => serial.close(),
            None => {}
        }
        let (line, lost) = match serial.line() {
            Line::Closed(why) => ("closed", why),
            Line::Opening => ("opening", None),
            Line::Open => ("open", None),
        };
        let let_go = serial
            .take_let_go()
            .map(|let_go| json!({ "why": let_go.why, "moved": let_go.moved, "moving": let_go.moving }));
        let mut bytes = serial.take_output();
        let head = json!({ "wire": bytes.len(), "line": line, "lost": lost, "let_go": let_go, "moved": serial.moved(), "left": serial.left() });
        bytes.extend_from_slice(serial.take_sent().join("\n").as_bytes());
        Ok(answer(head, &bytes))
    }

    fn world(&mut self) -> Result<&mut HostedWorld, Failed> {
        self.world.as_mut().ok_or_else(|| Failed::new("no_world", "no world is open: open one first"))
    }
}

/// Serde has less code for `{"run":{..}}` than for a word among the fields.
fn read(line: &[u8]) -> serde_json::Result<Call> {
    let mut fields: Map<String, Value> = serde_json::from_slice(line)?;
    let word = match fields.remove("call") {
        Some(Value::String(word)) => word,
        _ => return Err(serde::de::Error::missing_field("call")),
    };
    serde_json::from_value(Value::Object(Map::from_iter([(word, Value::Object(fields))])))
}

impl From<StoredText> for Stored {
    fn from(StoredText { number, model, image }: StoredText) -> Self {
        // What is not hexadecimal is shorter than an image, and refused as one.
        let byte = |at| u8::from_str_radix(image.get(at..at + 2)?, 16).ok();
        Self { number, model, image: (0..image.len()).step_by(2).map_while(byte).collect() }
    }
}

fn of_store(StoredImage { number, model, generation, bytes }: &StoredImage) -> Value {
    let image: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
    json!({ "number": number, "model": model, "generation": generation, "image": image })
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
