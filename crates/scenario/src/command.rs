//! What the host of a scenario does, in words: `4 enable`, `4 move 90deg at 60rpm`, `4 write 6060 3`, `sync 10ms`.
//!
//! A host is a CANopen master with intents in physical units (crate `master`); each line is one of them.

use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::Duration;

use can::Frame;
use canopen::pdo::{Direction, PdoId, PdoNumber};
use canopen::{NmtCommand, NodeId};
use host::capture::CaptureLine;
use host::group_follow::FollowLine;
use host::network::boot::BootOptions;
use host::test_motion::TestMotionLine;
use host::tune::TuneLine;
use machine::base_drive::BaseDrive;
use machine::group_move::GroupMove;
use machine::parameters::Form;
use master::drive::{self, ParseCommandError};
use master::pdo::TransmissionType;
use master::units::parse_duration;
use sim::Place;

use super::condition::Condition;
use words::object::{ObjectArg, object};

/// The forms of a line of a host beside `NODE COMMAND`, whose forms are those of a [drive's](drive::Command::FORMS).
const FORMS: &[&str] = &[
    "NODE read OBJECT",
    "NODE write OBJECT VALUE",
    "NODE pdo map rpdo|tpdo NUMBER OBJECT.. [type TYPE]",
    "NODE pdo adopt rpdo|tpdo NUMBER",
    "NODE pdo write OBJECT VALUE",
    "NODE pdo read OBJECT",
    "NODE|all nmt start|stop|pre-operational|reset|reset-communication",
    "NODE params apply [FILE] [save]",
    "NODE params verify [FILE]",
    "NODE watch TIME (its heartbeat)",
    "heartbeat NODE TIME (its own, under this node-ID)",
    "sync PERIOD|off",
    "send FRAME",
    "wait TIME",
    "wait for CONDITION [within TIME]",
];

/// Every form of a line of a host, for messages and the manual.
pub fn forms() -> impl Iterator<Item = String> {
    let measured = [CaptureLine::FORM, TestMotionLine::FORM, TuneLine::FORM];
    let of_drive = drive::Command::FORMS.iter().copied().chain(measured).map(|form| format!("NODE {form}"));
    let groups = [GroupMove::FORM, FollowLine::FORM].map(|form| format!("group {form}"));
    let shared = [BaseDrive::FORM.to_owned(), BootOptions::FORM.to_owned()];
    of_drive.chain(groups).chain(shared).chain(FORMS.iter().map(|form| (*form).to_owned()))
}

/// Those that begin so, as a list in a message.
fn forms_of(start: &str) -> String {
    forms().filter(|form| form.starts_with(start)).collect::<Vec<_>>().join("; ")
}

/// How long a condition is waited for by default.
const PATIENCE: Duration = Duration::from_secs(10);

/// One thing that a host does.
#[derive(Clone, Debug, PartialEq)]
pub enum Command {
    /// A command to a drive.
    Drive(Place, drive::Command),
    /// A capture of a drive.
    Capture(Place, CaptureLine),
    /// A drive by a test motion, captured.
    TestMotion(Place, Box<TestMotionLine>),
    /// Gains for a drive.
    Tune(Place, TuneLine),
    /// Several axes as one, to positions.
    Group(GroupMove),
    /// Several axes as one, along a recorded path beside the scenario.
    Follow(FollowLine),
    /// The base of the machine, by a twist.
    Base(BaseDrive),
    /// The boot-up of the machine.
    Boot(BootOptions),
    /// The parameters of a node, by a file beside the scenario or without one by the machine file.
    Parameters(NodeId, ParametersCommand, Option<PathBuf>),
    /// Uploads an object.
    Read(NodeId, ObjectArg),
    /// Downloads an object.
    Write(NodeId, ObjectArg, String),
    /// Something with process data.
    Pdo(NodeId, PdoCommand),
    /// A network management command to a node, or to all.
    Nmt(Option<NodeId>, NmtCommand),
    /// Watches the heartbeat of a node.
    Watch(NodeId, Duration),
    /// Produces a heartbeat.
    Heartbeat(NodeId, Duration),
    /// Produces SYNC, or no more.
    Sync(Option<Duration>),
    /// Sends a frame.
    Send(Frame),
    /// Waits for some time.
    Wait(Duration),
    /// Waits until something is so.
    WaitFor(Condition, Duration),
}

/// What is done with parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ParametersCommand {
    /// They are written, all or none, and stored if that is asked for.
    Apply {
        /// Whether the drive stores them.
        save: bool,
    },
    /// They are compared.
    Verify,
}

/// What is done with process data.
#[derive(Clone, Debug, PartialEq)]
pub enum PdoCommand {
    /// Sets up a PDO of the device with these objects and this transmission type, and sends or receives it.
    Map(PdoId, Vec<ObjectArg>, TransmissionType),
    /// Sends or receives a PDO as the device has it set up.
    Adopt(PdoId),
    /// Puts a value into the RPDOs that carry the object.
    Write(ObjectArg, String),
    /// What the TPDOs have brought of an object last.
    Read(ObjectArg),
}

impl FromStr for Command {
    type Err = String;

    fn from_str(line: &str) -> Result<Self, String> {
        let words: Vec<&str> = line.split_whitespace().collect();
        match *words.as_slice() {
            ["sync", "off"] => Ok(Self::Sync(None)),
            ["sync", period] => match time(period)? {
                Duration::ZERO => Err("SYNC needs a period of more than 0, as in: sync 10ms".into()),
                period => Ok(Self::Sync(Some(period))),
            },
            ["heartbeat", number, period] => Ok(Self::Heartbeat(node(number)?, time(period)?)),
            ["send", frame] => {
                frame.parse().map(Self::Send).map_err(|error| format!("'{frame}' is not a frame: {error}"))
            }
            ["wait", "for", ref rest @ ..] => {
                let (condition, within) = match rest {
                    [condition @ .., "within", limit] => (condition, time(limit)?),
                    _ => (rest, PATIENCE),
                };
                Ok(Self::WaitFor(condition.join(" ").parse()?, within))
            }
            ["group", "follow", ..] => words[1..].join(" ").parse().map(Self::Follow),
            ["group", ref rest @ ..] => rest.join(" ").parse().map(Self::Group),
            ["drive-base", ref rest @ ..] => rest.join(" ").parse().map(Self::Base),
            ["boot", ref rest @ ..] => rest.join(" ").parse().map(Self::Boot),
            ["wait", duration] => Ok(Self::Wait(time(duration)?)),
            ["all", "nmt", command] => Ok(Self::Nmt(None, nmt(command)?)),
            [place, ref rest @ ..] if place.parse::<Place>().is_ok() => of_node(place, rest),
            _ => Err(format!("'{line}' is not a host command; expected one of: {}", forms_of(""))),
        }
    }
}

fn of_node(place_word: &str, words: &[&str]) -> Result<Command, String> {
    let place: Place = place_word.parse().map_err(|()| format!("'{place_word}' is not a node"))?;
    let id = || node(&place.node.to_string());
    match *words {
        ["nmt", command] => Ok(Command::Nmt(Some(id()?), nmt(command)?)),
        ["watch", period] => Ok(Command::Watch(id()?, time(period)?)),
        ["read", name] => Ok(Command::Read(id()?, object(name)?)),
        ["capture", ref rest @ ..] => rest.join(" ").parse().map(|line| Command::Capture(place, line)),
        ["test-motion", ref rest @ ..] => rest.join(" ").parse().map(|line| Command::TestMotion(place, Box::new(line))),
        ["tune", ref rest @ ..] => rest.join(" ").parse().map(|line| Command::Tune(place, line)),
        ["params", ref rest @ ..] => {
            let (what, file) = parameters(rest)?;
            Ok(Command::Parameters(id()?, what, file))
        }
        ["pdo", ref rest @ ..] => pdo(rest).map(|command| Ok(Command::Pdo(id()?, command)))?,
        ["write", name, ref value @ ..] if !value.is_empty() => {
            Ok(Command::Write(id()?, object(name)?, value.join(" ")))
        }
        _ => match words.join(" ").parse() {
            Ok(command) => Ok(Command::Drive(place, command)),
            Err(ParseCommandError::Form(text)) => {
                Err(format!("'{text}' is not a host command for a node; expected one of: {}", forms_of("NODE")))
            }
            Err(error) => Err(error.to_string()),
        },
    }
}

/// What stands behind `params`.
fn parameters(words: &[&str]) -> Result<(ParametersCommand, Option<PathBuf>), String> {
    let (what, file) = match *words {
        ["apply", ref file @ .., "save"] => (Some(ParametersCommand::Apply { save: true }), file),
        ["apply", ref file @ ..] => (Some(ParametersCommand::Apply { save: false }), file),
        ["verify", ref file @ ..] => (Some(ParametersCommand::Verify), file),
        _ => (None, words),
    };
    match (what, file) {
        (Some(what), []) => Ok((what, None)),
        (Some(what), [file]) => Form::of(Path::new(file)).map(|_| (what, Some(file.into()))),
        _ => {
            let (words, forms) = (words.join(" "), forms_of("NODE params"));
            Err(format!("'params {words}' is not a host command; expected one of: {forms}"))
        }
    }
}

/// What stands behind `pdo`.
fn pdo(words: &[&str]) -> Result<PdoCommand, String> {
    match *words {
        ["map", direction, number, ref rest @ ..] if !rest.is_empty() => {
            let (objects, transmission) = match rest {
                [objects @ .., "type", kind] => (objects, transmission_type(kind)?),
                _ => (rest, TransmissionType::EVENT_PROFILE),
            };
            let objects = objects.iter().map(|name| object(name)).collect::<Result<_, _>>()?;
            Ok(PdoCommand::Map(pdo_id(direction, number)?, objects, transmission))
        }
        ["adopt", direction, number] => Ok(PdoCommand::Adopt(pdo_id(direction, number)?)),
        ["write", name, ref value @ ..] if !value.is_empty() => Ok(PdoCommand::Write(object(name)?, value.join(" "))),
        ["read", name] => Ok(PdoCommand::Read(object(name)?)),
        _ => Err(format!("'pdo {}' is not a host command; expected one of: {}", words.join(" "), forms_of("NODE pdo"))),
    }
}

fn pdo_id(direction: &str, number: &str) -> Result<PdoId, String> {
    let direction = match direction {
        "rpdo" => Direction::Rpdo,
        "tpdo" => Direction::Tpdo,
        _ => {
            return Err(format!("'{direction}' is not a kind of PDO; expected rpdo (to the device) or tpdo (from it)"));
        }
    };
    let number = number.parse().ok().and_then(PdoNumber::new);
    let number =
        number.ok_or_else(|| format!("a PDO has a number from 1 to {}, as in: pdo adopt tpdo 1", PdoNumber::MAX))?;
    Ok(PdoId { direction, number })
}

fn transmission_type(text: &str) -> Result<TransmissionType, String> {
    text.parse().map(TransmissionType).map_err(|_| {
        format!("'{text}' is not a transmission type; expected 0 to 255 (CiA 301, tables 64 and 68), as in: type 1 for each SYNC")
    })
}

fn time(text: &str) -> Result<Duration, String> {
    parse_duration(text).map_err(|error| error.to_string())
}

fn node(text: &str) -> Result<NodeId, String> {
    words::node::node(text)
}

fn nmt(word: &str) -> Result<NmtCommand, String> {
    NmtCommand::of_word(word).ok_or_else(|| {
        format!("'{word}' is not an NMT command; expected {}", NmtCommand::ALL.map(NmtCommand::word).join(", "))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_an_intent() {
        for line in [
            "4 enable",
            "4 velocity -60rpm acceleration 500ms no-wait",
            "5.2 move by 90deg at 30rpm",
            "2 move 40mm at 20mm/s acceleration 100mm/s2",
            "2 velocity -5mm/s deceleration 100mm/s2",
            "4 move 32000",
            "2 home 17 at 60rpm within 5s",
            "group move 1=90deg 2=-45deg within 3s hold 2s",
            "group follow arm/path.csv by period 2ms of arm",
            "group follow path.csv approach hold 1s",
            "drive-base linear 0.3 angular -0.2 for 3s",
            "boot",
            "boot node 4 node 5 reset no-start",
            "4 capture velocity current for 2s rate 1ms",
            "4 test-motion steps speed 60rpm count 3",
            "5.2 test-motion sine by 10deg frequency 2",
            "4 tune",
            "4 tune bandwidth 20 loop position apply",
            "4 params apply",
            "4 params apply save",
            "4 params apply wheel.toml save",
            "4 params verify sheets/wheel.dcf",
            "4 write 6060 profile velocity",
            "4 read position_actual_value",
            "4 pdo map tpdo 1 6041 position_actual_value type 1",
            "4 pdo map rpdo 2 controlword",
            "4 pdo adopt tpdo 4",
            "4 pdo write 6040 0x0F",
            "4 pdo read statusword",
            "all nmt start",
            "sync 10ms",
            "sync off",
            "send 604#4041600000000000",
            "wait 20ms",
            "wait for 4 velocity > 50 and 4 powered within 2s",
        ] {
            assert!(line.parse::<Command>().is_ok(), "{line}: {:?}", line.parse::<Command>());
        }
    }

    #[test]
    fn other_lines_are_refused_with_the_possible_forms() {
        for (line, said) in [
            ("", "expected one of"),
            ("dance", "expected one of"),
            ("4 dance", "NODE enable"),
            ("group dance", "group move [by] NODE=POSITION"),
            ("group follow", "expected: group follow FILE.csv"),
            ("group follow path.txt", "expected: group follow FILE.csv"),
            ("group follow path.csv within 2s", "'within' is not a part of group follow"),
            ("group follow path.csv 1=90deg", "'1=90deg' is not a part of group follow"),
            ("group follow path.csv period", "'period' has no value"),
            ("drive-base forward", "expected: drive-base [linear M/S]"),
            ("boot now", "expected: boot [node NODE].."),
            ("boot node", "'node' has no value; expected: boot [node NODE].."),
            ("boot node 200", "node-ID"),
            ("4 params", "NODE params verify [FILE]"),
            ("4 params frob", "NODE params apply [FILE] [save]"),
            ("4 params frob wheel.toml", "NODE params apply [FILE] [save]"),
            ("4 params verify wheel.txt", ".toml"),
            ("4 params apply a.toml b.toml", "NODE params apply [FILE] [save]"),
            ("4 capture velocity", "it needs a time"),
            ("4 test-motion", "expected: test-motion SHAPE"),
            ("4 tune fast", "expected: tune [phase-margin DEGREES]"),
            ("4 velocity", "NODE enable"),
            ("4 velocity fast", "does not begin with a number"),
            ("4 velocity 60rpm at 5rpm", "is not an option of velocity"),
            ("4 move 90deg at", "has no value"),
            ("4 nmt go", "expected start"),
            ("4 pdo", "NODE pdo map"),
            ("4 pdo map tpdo 1", "NODE pdo map"),
            ("4 pdo map both 1 6041", "expected rpdo"),
            ("4 pdo adopt tpdo 0", "1 to 512"),
            ("4 pdo map tpdo 1 6041 type 256", "0 to 255"),
            ("sync 0s", "more than 0"),
            ("sync nans", "does not begin with a number"),
            ("wait -5s", "between 0 and a year"),
            ("wait for", "a condition is missing"),
            ("0 enable", "expected one of"),
        ] {
            let refused = line.parse::<Command>().err().unwrap_or_default();
            assert!(refused.contains(said), "{line}: {refused}");
        }
    }
}
