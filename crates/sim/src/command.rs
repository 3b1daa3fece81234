//! World commands: the lines that `ferrodrive sim` takes on standard input, each answered by one line of JSON.
//!
//! A line is parsed into a [`Command`], applied to a [`World`], and answered with `{"ok":true,"t":12.5}`
//! (`t` is virtual time in seconds) or `{"ok":false,"error":{"kind":"..","message":"..",..}}`. A line that is refused changes nothing. A blank line
//! and a comment (`# ...`) have no answer.
//! Node numbers are those under which drives were added, whatever their node-IDs are by now.

mod answer;
mod run;

use core::time::Duration;
use std::str::FromStr;

use serde::Serialize;

use crate::stimulus::{BodyStimulus, GET, GET_BODY, Place, Stimulus, StimulusError, WireFault, excerpt};
use crate::{Refused, World, json};
pub use answer::{apply, apply_to_body};
pub use run::{Before, Run};

/// One line, understood.
#[derive(Clone, Debug, PartialEq)]
pub enum Command {
    /// `now`: the virtual time.
    Now,
    /// `help`: what a line may say.
    Help,
    /// `quit`: the end.
    Quit,
    /// `run 20ms`: time passes.
    Run(Run),
    /// `4 get`: what can be measured at a node.
    Get(Place),
    /// `bus corrupt 0.01`: what disturbs the wire.
    Disturb(WireFault),
    /// `body base get`: where a machine is that several drives move.
    GetBody(String),
    /// `body base slope 5`: what the outer world does to it.
    ApplyToBody(String, BodyStimulus),
    /// `4 power off`: what the outer world does to a node.
    Apply(Place, Stimulus),
}

impl FromStr for Command {
    type Err = CommandError;

    fn from_str(line: &str) -> Result<Self, CommandError> {
        let line = line.trim();
        let (first, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let alone = |command: Self, form: &'static str| {
            if rest.is_empty() { Ok(command) } else { Err(StimulusError::Usage(form).into()) }
        };
        match first {
            "now" => return alone(Self::Now, "now"),
            "help" => return alone(Self::Help, "help"),
            "quit" => return alone(Self::Quit, "quit"),
            "bus" => {
                let words: Vec<&str> = rest.split_whitespace().collect();
                return Ok(Self::Disturb(WireFault::parse(&words)?));
            }
            "body" => return body(rest.trim()),
            "run" => return Ok(Self::Run(Run::parse(rest)?)),
            _ => {}
        }
        let place = parse_place(first)?;
        let rest = rest.trim();
        match rest.split_whitespace().next() {
            None => Err(CommandError::NoAction(excerpt(first))),
            Some("get") if rest == "get" => Ok(Self::Get(place)),
            Some("get") => Err(StimulusError::Usage(GET).into()),
            Some(_) => Ok(Self::Apply(place, rest.parse()?)),
        }
    }
}

fn body(rest: &str) -> Result<Command, CommandError> {
    let (name, words) = rest.split_once(char::is_whitespace).ok_or(StimulusError::Usage(GET_BODY))?;
    let name = name.to_owned();
    if words.trim() == "get" { Ok(Command::GetBody(name)) } else { Ok(Command::ApplyToBody(name, words.parse()?)) }
}

fn parse_place(word: &str) -> Result<Place, CommandError> {
    let looks_numeric = word.starts_with(|first: char| first.is_ascii_digit() || first == '-' || first == '+');
    word.parse().map_err(|()| {
        let word = excerpt(word);
        if looks_numeric { CommandError::BadNode(word) } else { CommandError::Unknown(word) }
    })
}

/// Why a line was not done.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CommandError {
    /// Time follows a clock.
    #[error("time follows the clock here; start the simulator with --clock manual to move it by hand")]
    NotManual,
    /// More lines than may wait for the end of a run.
    #[error("{most} lines wait for the end of a run already; wait for its answer before you go on")]
    TooMany {
        /// How many may wait.
        most: usize,
    },
    /// Time is moving already.
    #[error("time is moving already, until {until_s} s")]
    Running {
        /// When it has moved, in seconds.
        until_s: f64,
    },
    /// A run was ended before its time.
    #[error("the run was ended at {at_s} s: {why}")]
    Ended {
        /// How far it has come, in seconds.
        at_s: f64,
        /// What ended it.
        why: &'static str,
    },
    /// The line is longer than [`MAX_LINE_LENGTH`].
    #[error("the line is longer than {MAX_LINE_LENGTH} bytes; expected a command, as in: 4 get")]
    TooLong,
    /// The first word is neither a node nor a command.
    #[error(
        "unknown command {0:?}; expected now, help, run, quit, bus, body, or a node number and a command, as in: 4 get"
    )]
    Unknown(String),
    /// The number is not a node number.
    #[error("{0:?} is not a node number; expected 1 to 127")]
    BadNode(String),
    /// A node number and nothing after it.
    #[error(
        "nothing to do is said after node {0}; expected power, input, switch, load, rotor, supply, temperature, fault, \
         battery, pulses, quadrature, duty, clock, cable, bus, set or get, as in: {0} get"
    )]
    NoAction(String),
    /// The words are not a stimulus.
    #[error(transparent)]
    Stimulus(#[from] StimulusError),
    /// No drive has this number.
    #[error("no drive at node {number}; running: {present}")]
    NoSuchDrive {
        /// The number given.
        number: u8,
        /// The numbers there are, or `none`.
        present: String,
    },
    /// No machine has this name.
    #[error("no body is called {name:?}; there is {present}")]
    NoSuchBody {
        /// The name given.
        name: String,
        /// The names there are, or `none`.
        present: String,
    },
    /// The node does not take it.
    #[error(transparent)]
    Refused(#[from] Refused),
}

impl CommandError {
    /// The node that it is about, where there is none such.
    pub const fn node(&self) -> Option<u8> {
        match self {
            Self::NoSuchDrive { number, .. } => Some(*number),
            _ => None,
        }
    }

    /// What to do about it, in a clause.
    pub const fn next(&self) -> &'static str {
        match self {
            Self::Unknown(_) | Self::BadNode(_) | Self::NoAction(_) | Self::Stimulus(_) => {
                "help lists what a line may say"
            }
            Self::NotManual => "start the simulator with --clock manual",
            Self::Running { .. } | Self::TooMany { .. } => "wait for the answer to the run",
            Self::Ended { .. } => "now shows how far time has come; run goes on from there",
            Self::TooLong => "give each command a line of its own",
            Self::NoSuchDrive { .. } => "name a drive that was started; --drive MODEL@NODE starts another",
            Self::NoSuchBody { .. } => "name a body that is there; a [[body]] of the machine file makes one",
            Self::Refused(_) => "give what this drive has and takes; help lists the commands",
        }
    }

    /// What kind it is, in a word that programs may rely on.
    pub const fn kind(&self) -> &'static str {
        match self {
            Self::TooLong => "too_long",
            Self::Unknown(_) | Self::BadNode(_) | Self::NoAction(_) | Self::Stimulus(_) => "usage",
            Self::NoSuchDrive { .. } => "no_such_node",
            Self::NoSuchBody { .. } => "no_such_body",
            Self::NotManual | Self::Running { .. } | Self::Ended { .. } | Self::TooMany { .. } => "clock",
            Self::Refused(_) => "refused",
        }
    }
}

/// What to print for a line, and whether it was the last.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Answer {
    /// One line of JSON, without its end.
    pub json: String,
    /// The line was `quit`.
    pub quit: bool,
}

/// Longest line that is read, in bytes: many times the longest command.
pub const MAX_LINE_LENGTH: usize = 4096;

/// What only the one who moves a world's time and serves its bus knows; `now` and `get` show it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Service {
    /// How far the world's time is behind the clock; nothing where no clock drives it.
    pub behind: Duration,
    /// Frames of clients that were given up.
    pub frames_lost: u64,
}

/// Does what `command` says; returns the line of JSON that answers it. `quit` changes nothing: its caller ends.
///
/// # Errors
/// No such drive, or what it does not take; nothing is changed then.
pub fn perform(world: &mut World, command: &Command, service: Service) -> Result<String, CommandError> {
    answer::answer(world, command, service)
}

/// Does what a line says and answers it, in a world that is not served; `None` for a blank line or a comment.
pub fn answer(world: &mut World, line: &str) -> Option<Answer> {
    answer_served(world, line, Service::default())
}

/// Does what a line says and answers it; `None` for a blank line or a comment.
pub fn answer_served(world: &mut World, line: &str, service: Service) -> Option<Answer> {
    if line.len() > MAX_LINE_LENGTH {
        return Some(Answer { json: refused(&CommandError::TooLong), quit: false });
    }
    if !asks_for_an_answer(line) {
        return None;
    }
    let done =
        line.parse().and_then(|command| Ok((command == Command::Quit, answer::answer(world, &command, service)?)));
    let (quit, json) = match done {
        Ok((quit, json)) => (quit, json),
        Err(error) => (false, refused(&error)),
    };
    Some(Answer { json, quit })
}

/// False for a blank line and for a comment.
pub fn asks_for_an_answer(line: &str) -> bool {
    let line = line.trim();
    !line.is_empty() && !line.starts_with('#')
}

#[derive(Serialize)]
struct Refusal<'a> {
    ok: bool,
    error: RefusalBody<'a>,
}

/// The fields that an error has everywhere (docs/json.md).
#[derive(Serialize)]
struct RefusalBody<'a> {
    kind: &'a str,
    message: String,
    node: Option<u8>,
    object: Option<&'a str>,
    abort: Option<u32>,
    next: &'a str,
}

/// The answer to a line that was not done: why in words, and what a program goes by.
pub fn refused(error: &CommandError) -> String {
    let (kind, message, node, next) = (error.kind(), error.to_string(), error.node(), error.next());
    json::line(&Refusal { ok: false, error: RefusalBody { kind, message, node, object: None, abort: None, next } })
}

#[cfg(test)]
mod tests;
