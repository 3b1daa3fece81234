//! Requests: from a line of text to what is meant.

use core::time::Duration;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};
use sim::command::{Command, Run};
use sim::stimulus::Place;

use super::answer::{ControlError, HELP};
use super::id::Id;
use super::subscription::{Channel, Values};
use crate::command::fields::whole;
use crate::events::Filter;
use words::suggest::{did_you_mean, near};

/// A request, and the mark that its answer will bear.
#[derive(Clone, Debug, PartialEq)]
pub struct Message {
    /// Whatever the client gave; `None` for none.
    pub id: Option<Id>,
    /// What is asked for.
    pub request: Request,
}

/// What a client can ask for.
#[derive(Clone, Debug, PartialEq)]
pub enum Request {
    /// Who is there: versions, nodes. Gives the token where one is asked for.
    Hello {
        /// The token.
        token: Option<String>,
        /// What the client is called in events about its world commands.
        name: Option<String>,
    },
    /// What can be asked for.
    Help,
    /// The world's time.
    Now,
    /// What can be measured at a node.
    Get(Place),
    /// A world command, as a line.
    World(String),
    /// Moves a world whose time is moved by clients only.
    Run(Run),
    /// Events from now on.
    SubscribeEvents(Filter),
    /// Values from now on.
    SubscribeValues(Values),
    /// Ends a subscription.
    Unsubscribe(u64),
}

/// Each request and its fields, one line each.
pub const REQUESTS: [&str; 9] = [
    r#"{"request":"hello","token":"..","name":".."}"#,
    HELP,
    r#"{"request":"now"}"#,
    r#"{"request":"get","node":4,"axis":1}"#,
    r#"{"request":"world","line":"4 supply 90"}"#,
    r#"{"request":"world","node":4,"axis":1,"command":["supply",90]}"#,
    r#"{"request":"run","for":"20ms"} or {"request":"run","until":"1.5s"}, with --clock manual"#,
    r#"{"request":"subscribe","events":{"nodes":[4],"kinds":["fault"]}} or {"request":"subscribe","values":[{"node":4,"axis":1,"signals":["velocity_rpm"]}],"every":"10ms"}"#,
    r#"{"request":"unsubscribe","subscription":1}"#,
];

const NAMES: [&str; 8] = ["hello", "help", "now", "get", "world", "run", "subscribe", "unsubscribe"];

/// Longest text that marks a request, or names a client.
const MAX_NAME_LENGTH: usize = 128;

impl Message {
    /// Reads a line. One that does not begin with `{` is a world command.
    ///
    /// # Errors
    /// What is wrong, and the request's mark as far as it could be read.
    pub fn parse(line: &str) -> Result<Self, (Option<Id>, ControlError)> {
        let line = line.trim();
        if !line.starts_with('{') {
            return Ok(Self { id: None, request: Request::World(line.to_owned()) });
        }
        let syntax =
            |error: serde_json::Error| (None, ControlError::new("syntax", format!("not JSON: {error}")).next(HELP));
        let mut fields: Map<String, Value> = serde_json::from_str(line).map_err(syntax)?;
        let id = match fields.remove("id") {
            None | Some(Value::Null) => None,
            Some(value) => Some(mark(value).map_err(|error| (None, error))?),
        };
        match Request::of(fields) {
            Ok(request) => Ok(Self { id, request }),
            Err(error) => Err((id, error)),
        }
    }
}

impl Request {
    /// How far to move the world, if that is asked for.
    pub(super) fn run(&self) -> Option<Run> {
        match self {
            Self::Run(run) => Some(*run),
            Self::World(line) => match line.parse() {
                Ok(Command::Run(run)) => Some(run),
                _ => None,
            },
            _ => None,
        }
    }
}

/// The mark that a client gave.
fn mark(value: Value) -> Result<Id, ControlError> {
    match value {
        Value::Number(number) if number.is_i64() => Ok(Id::Number(number.as_i64().unwrap_or_default())),
        Value::String(text) if text.len() <= MAX_NAME_LENGTH => Ok(Id::Text(text)),
        _ => Err(ControlError::usage(format!(
            "\"id\" must be a whole number or a text of at most {MAX_NAME_LENGTH} bytes"
        ))),
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Nothing {}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct HelloFields {
    token: Option<String>,
    name: Option<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct GetFields {
    node: u8,
    axis: Option<u8>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WorldFields {
    line: Option<String>,
    node: Option<u8>,
    axis: Option<u8>,
    command: Option<Vec<Value>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RunFields {
    #[serde(rename = "for")]
    duration: Option<String>,
    until: Option<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SubscribeFields {
    events: Option<EventFields>,
    values: Option<Vec<ValueFields>>,
    every: Option<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct EventFields {
    #[serde(default)]
    nodes: Vec<u8>,
    #[serde(default)]
    kinds: Vec<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ValueFields {
    node: u8,
    axis: Option<u8>,
    signals: Vec<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct UnsubscribeFields {
    subscription: u64,
}

impl Request {
    fn of(mut fields: Map<String, Value>) -> Result<Self, ControlError> {
        let Some(Value::String(name)) = fields.remove("request") else {
            return Err(ControlError::usage("\"request\", the name of the request, is missing").next(REQUESTS[1]));
        };
        match name.as_str() {
            "hello" => {
                let HelloFields { token, name } = read(fields)?;
                let name =
                    name.map(|name| name.chars().filter(|letter| !letter.is_control()).take(MAX_NAME_LENGTH).collect());
                Ok(Self::Hello { token, name })
            }
            "help" => read(fields).map(|Nothing {}| Self::Help),
            "now" => read(fields).map(|Nothing {}| Self::Now),
            "get" => {
                let GetFields { node, axis } = read(fields)?;
                place(node, axis).map(Self::Get)
            }
            "world" => world(read(fields)?).map(Self::World),
            "run" => run(&read(fields)?).map(Self::Run),
            "subscribe" => subscribe(read(fields)?),
            "unsubscribe" => read(fields).map(|UnsubscribeFields { subscription }| Self::Unsubscribe(subscription)),
            _ => {
                let guess = did_you_mean(&near(&name, NAMES));
                Err(ControlError::usage(format!("there is no request {name:?}{guess}")).next(REQUESTS[1]))
            }
        }
    }
}

fn read<T: DeserializeOwned>(fields: Map<String, Value>) -> Result<T, ControlError> {
    whole(fields).map_err(ControlError::usage)
}

fn place(node: u8, axis: Option<u8>) -> Result<Place, ControlError> {
    let text = format!("{node}.{}", axis.unwrap_or(1));
    text.parse().map_err(|()| {
        ControlError::usage(format!(
            "expected a node from 1 to 127 and an axis from 1, got node {node}, axis {}",
            axis.unwrap_or(1)
        ))
    })
}

/// A line, or words and numbers that make one.
fn world(fields: WorldFields) -> Result<String, ControlError> {
    match fields {
        WorldFields { line: Some(line), node: None, axis: None, command: None } if !line.contains(['\n', '\r']) => {
            Ok(line)
        }
        WorldFields { line: None, node, axis, command: Some(command) } => {
            let words = command.iter().map(word).collect::<Option<Vec<_>>>().filter(|words| !words.is_empty());
            let words = words.ok_or_else(|| {
                ControlError::usage("\"command\" must be a list of words and numbers").next(REQUESTS[5])
            })?;
            match node {
                Some(node) => Ok(format!("{} {}", place(node, axis)?, words.join(" "))),
                None => Ok(words.join(" ")),
            }
        }
        _ => Err(ControlError::usage("a world command is either one \"line\", or a \"node\" and a \"command\"")
            .next(REQUESTS[4])),
    }
}

fn word(value: &Value) -> Option<String> {
    match value {
        Value::String(word) if !word.contains(char::is_control) => Some(word.clone()),
        Value::Number(number) => Some(number.to_string()),
        _ => None,
    }
}

/// In the words of the world command, which has the one parser of it.
fn run(fields: &RunFields) -> Result<Run, ControlError> {
    let (words, time) = match fields {
        RunFields { duration: Some(time), until: None } => ("run", time),
        RunFields { duration: None, until: Some(time) } => ("run until", time),
        _ => return Err(ControlError::usage("give one of \"for\" and \"until\"").next(REQUESTS[6])),
    };
    let refused = |reason: String| ControlError::usage(reason).next(REQUESTS[6]);
    if !time.starts_with(|first: char| first.is_ascii_digit() || first == '.') {
        return Err(refused(format!("{time:?} is not a time; expected a number and its unit, as in 20ms")));
    }
    match format!("{words} {time}").parse() {
        Ok(Command::Run(run)) => Ok(run),
        Ok(_) => Err(refused(format!("{time:?} is not a time"))),
        Err(error) => Err(refused(error.to_string())),
    }
}

fn subscribe(fields: SubscribeFields) -> Result<Request, ControlError> {
    let refused = |reason: String| ControlError::usage(reason).next(REQUESTS[7]);
    match fields {
        SubscribeFields { events: Some(EventFields { nodes, kinds }), values: None, every: None } => {
            let filter = Filter::new(nodes, kinds).map_err(|error| ControlError::usage(error.to_string()))?;
            Ok(Request::SubscribeEvents(filter))
        }
        SubscribeFields { events: None, values: Some(values), every: Some(every) } => {
            let mut channels = Vec::new();
            for ValueFields { node, axis, signals } in values {
                let place = place(node, axis)?;
                for name in signals {
                    channels.push(Channel::named(place, &name)?);
                }
            }
            Values::new(channels, duration(&every, "every")?).map(Request::SubscribeValues)
        }
        _ => Err(refused("subscribe to \"events\", or to \"values\" with \"every\"".to_owned())),
    }
}

fn duration(text: &str, field: &str) -> Result<Duration, ControlError> {
    master::units::parse_duration(text).map_err(|error| ControlError::usage(format!("\"{field}\": {error}")))
}
