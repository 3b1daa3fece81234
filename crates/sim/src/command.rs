//! World commands: the lines that `ferrodrive sim` takes on standard input, each answered by one line of JSON.
//!
//! A line is parsed into a [`Command`], applied to a [`World`], and answered with `{"ok":true,"t":12.5}`
//! (`t` is virtual time in seconds) or `{"ok":false,"error":"..."}`. A line that is refused changes nothing. A blank line
//! and a comment (`# ...`) have no answer.
//! Node numbers are those under which drives were added, whatever their node-IDs are by now.

mod apply;
mod parse;

use core::time::Duration;

use serde::Serialize;

use crate::{Component, PulseTrain, Refused, Source, SwitchRange, TemperatureSensor, World};

/// One line, understood.
#[derive(Clone, Debug, PartialEq)]
pub enum Command {
    /// `now`: the virtual time.
    Now,
    /// `help`: what a line may say.
    Help,
    /// `quit`: the end.
    Quit,
    /// `4 ...`: something about the drive added under a number.
    Drive {
        /// The number.
        number: u8,
        /// What to do.
        action: Action,
    },
}

/// What to do with a drive and the machine around it.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// `power on`, `power off`: the supply. Switched off the drive lives on until the bus has drained.
    Power(bool),
    /// `power cycle`: off, and on again when the drive has died of it.
    PowerCycle,
    /// `power cut`: dead at once, in the middle of whatever it does.
    PowerCut,
    /// `input X0 1`: a digital input's level.
    Input {
        /// The input's name.
        name: String,
        /// Its level.
        level: bool,
    },
    /// `switch X0 -5000 max`: an input tied to the position.
    Switch {
        /// The input's name.
        name: String,
        /// Where it is active, in counts of the present actual position.
        range: SwitchRange,
    },
    /// `load torque 2.5`: N·m at the output shaft.
    LoadTorque(f64),
    /// `load inertia 0.02`: kg·m² at the output shaft.
    LoadInertia(f64),
    /// `rotor lock`, `rotor free`.
    RotorLock(bool),
    /// `supply 48`: V; `supply 48 limit 10 resistance 0.2`: with what is behind it.
    Supply(Source),
    /// `temperature motor 95`, `temperature driver auto`: °C held, or back to the model.
    Temperature(TemperatureSensor, Option<f64>),
    /// `fault hall on`.
    Fault(Component, bool),
    /// `battery off`.
    Battery(bool),
    /// `pulses 8192 10000`, `quadrature -400 1000`, `duty 40`, `clock 10000`: what is sent to the pulse inputs.
    Pulses(PulseTrain),
    /// `cable cut` is true, `cable join` is false.
    CableCut(bool),
    /// `get`: what can be measured.
    Get,
}

/// Why a line was not done.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CommandError {
    /// The line is longer than [`MAX_LINE_LENGTH`].
    #[error("the line is longer than {MAX_LINE_LENGTH} bytes; expected a command, as in: 4 get")]
    TooLong,
    /// The first word is neither a node nor a command.
    #[error("unknown command {0:?}; expected now, help, quit, or a node number and a command, as in: 4 get")]
    Unknown(String),
    /// The number is no node number.
    #[error("{0:?} is no node number; expected 1 to 127")]
    BadNode(String),
    /// A node number and nothing after it.
    #[error(
        "nothing to do is said after node {0}; expected power, input, switch, load, rotor, supply, temperature, fault, \
         battery, pulses, quadrature, duty, clock, cable or get, as in: {0} get"
    )]
    NoAction(u8),
    /// A node number and something unknown after it.
    #[error(
        "unknown command {0:?} for a node; expected power, input, switch, load, rotor, supply, temperature, fault, \
         battery, pulses, quadrature, duty, clock, cable or get"
    )]
    UnknownAction(String),
    /// Missing, surplus or unknown words.
    #[error("expected: {0}")]
    Usage(&'static str),
    /// No finite number, or one that makes no sense.
    #[error("{text:?} is no {what}; expected: {usage}")]
    BadValue {
        /// What was given.
        text: String,
        /// What it should be.
        what: &'static str,
        /// The whole command.
        usage: &'static str,
    },
    /// A switch that could never be active.
    #[error("the range from {low} to {high} is empty; give the lower bound first")]
    EmptyRange {
        /// Lower bound as given.
        low: i64,
        /// Upper bound as given.
        high: i64,
    },
    /// No drive has this number.
    #[error("no drive was started as node {number}; there is {present}")]
    NoSuchDrive {
        /// The number given.
        number: u8,
        /// The numbers there are, or `none`.
        present: String,
    },
    /// The drive has no input of this name.
    #[error("a {model} has no input {name:?}; it has {present}")]
    NoSuchInput {
        /// The drive's model.
        model: &'static str,
        /// The name given.
        name: String,
        /// The names there are, or `none`.
        present: String,
    },
    /// The drive does not take it.
    #[error(transparent)]
    Refused(#[from] Refused),
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

/// What only the one who moves a world's time and serves its bus knows; `now` and `get` tell it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Service {
    /// How far the world's time is behind the clock; nothing where no clock drives it.
    pub behind: Duration,
    /// Frames of clients that were given up.
    pub frames_lost: u64,
}

/// Does what a line says and answers it, in a world that nobody serves; `None` for a blank line or a comment.
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
    let done = line.parse().and_then(|command| Ok((command == Command::Quit, apply::apply(world, &command, service)?)));
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
struct Refusal {
    ok: bool,
    error: String,
}

/// The answer to a line that was not done.
fn refused(error: &CommandError) -> String {
    to_json(&Refusal { ok: false, error: error.to_string() })
}

fn to_json(answer: &impl Serialize) -> String {
    // Answers are flags, numbers and texts: they always become JSON.
    crate::json::to_string(answer)
        .unwrap_or_else(|_| r#"{"ok":false,"error":"an answer cannot be written"}"#.to_owned())
}
