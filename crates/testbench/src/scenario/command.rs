//! What the host of a scenario does, in words: `4 enable`, `4 move 90deg at 60rpm`, `4 write 6060 3`, `sync 10ms`.
//!
//! A host is a CANopen master with intents in physical units (crate `master`); each line is one of them.

use std::str::FromStr;
use std::time::Duration;

use can::Frame;
use canopen::pdo::{Direction, PdoId, PdoNumber};
use canopen::{NmtCommand, NodeId};
use master::Drive;
use master::drive::{HomingOptions, MotionOptions};
use master::pdo::TransmissionType;
use master::units::{Along, Amperes, Angle, Ramp, Rpm, parse_duration};
use sim::Place;

use super::condition::Condition;
use crate::words::object::{ObjectArg, object};

/// Every form of a line of a host, for messages and the manual.
pub const FORMS: &[&str] = &[
    "NODE enable|disable|stop|quick-stop|reset|save|restore|guard|release",
    "NODE velocity SPEED [acceleration RAMP] [deceleration RAMP] [no-wait]",
    "NODE move [by] POSITION [at SPEED] [acceleration RAMP] [deceleration RAMP] [no-wait]",
    "NODE torque CURRENT",
    "NODE home METHOD [at SPEED] [within TIME] [no-wait]",
    "NODE read OBJECT",
    "NODE write OBJECT VALUE",
    "NODE pdo map rpdo|tpdo NUMBER OBJECT.. [type TYPE]",
    "NODE pdo adopt rpdo|tpdo NUMBER",
    "NODE pdo write OBJECT VALUE",
    "NODE pdo read OBJECT",
    "NODE|all nmt start|stop|pre-operational|reset|reset-communication",
    "NODE watch TIME (its heartbeat)",
    "heartbeat NODE TIME (its own, under this node-ID)",
    "sync PERIOD|off",
    "send FRAME",
    "wait TIME",
    "wait for CONDITION [within TIME]",
];

/// How long a condition is waited for by default.
const PATIENCE: Duration = Duration::from_secs(10);

/// One thing that a host does.
#[derive(Clone, Debug, PartialEq)]
pub enum Command {
    /// An intent without a value.
    Drive(Place, Intent),
    /// Turns at a speed.
    Velocity(Place, Along<Rpm>, Manner),
    /// Turns to a position, or by an angle.
    Move {
        /// Which axis.
        place: Place,
        /// Where to.
        to: Along<Angle>,
        /// By so much from the last target.
        relative: bool,
        /// How.
        manner: Manner,
    },
    /// Pushes with a current.
    Torque(Place, Amperes),
    /// Finds the reference position.
    Home {
        /// Which axis.
        place: Place,
        /// The method of CiA 402.
        method: i8,
        /// How long it may take; the master's own limit without it.
        within: Option<Duration>,
        /// How.
        manner: Manner,
    },
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

/// The options of a motion, as typed: along a way too, which becomes a rotation by the [gear](Drive::gear) of a drive.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Manner {
    /// Largest speed on the way.
    pub speed: Option<Along<Rpm>>,
    /// How fast the speed may rise.
    pub acceleration: Option<Along<Ramp>>,
    /// How fast the speed may fall.
    pub deceleration: Option<Along<Ramp>>,
    /// The next line does not wait for the end of it.
    pub no_wait: bool,
}

impl Manner {
    /// The same for this drive.
    ///
    /// # Errors
    /// [`master::Error::NoFeed`] for a way, where nothing says how far a turn of the output moves something.
    pub fn motion(&self, drive: &Drive) -> Result<MotionOptions, master::Error> {
        let ramp = |wish: Option<Along<Ramp>>| wish.map(|wish| drive.turning(wish)).transpose();
        Ok(MotionOptions {
            speed: self.speed.map(|wish| drive.turning(wish)).transpose()?,
            acceleration: ramp(self.acceleration)?,
            deceleration: ramp(self.deceleration)?,
            wait: !self.no_wait,
            ..MotionOptions::default()
        })
    }

    /// The same for a homing that may take this long.
    ///
    /// # Errors
    /// As [`motion`](Self::motion).
    pub fn homing(&self, drive: &Drive, within: Option<Duration>) -> Result<HomingOptions, master::Error> {
        let MotionOptions { speed, wait, .. } = self.motion(drive)?;
        Ok(HomingOptions { speed, wait, limit: within.unwrap_or(HomingOptions::default().limit) })
    }
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

/// An intent without a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Intent {
    /// To operation enabled.
    Enable,
    /// To switched on or below.
    Disable,
    /// Stops with the ramp of the mode.
    Stop,
    /// Quick stop.
    QuickStop,
    /// Resets a fault.
    Reset,
    /// Stores the parameters.
    Save,
    /// Restores the factory's.
    Restore,
    /// Has the drive stop when this host falls silent.
    Guard,
    /// No more of that.
    Release,
}

const INTENTS: [(&str, Intent); 9] = [
    ("enable", Intent::Enable),
    ("disable", Intent::Disable),
    ("stop", Intent::Stop),
    ("quick-stop", Intent::QuickStop),
    ("reset", Intent::Reset),
    ("save", Intent::Save),
    ("restore", Intent::Restore),
    ("guard", Intent::Guard),
    ("release", Intent::Release),
];

const NMT: [(&str, NmtCommand); 5] = [
    ("start", NmtCommand::Start),
    ("stop", NmtCommand::Stop),
    ("pre-operational", NmtCommand::EnterPreOperational),
    ("reset", NmtCommand::ResetNode),
    ("reset-communication", NmtCommand::ResetCommunication),
];

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
            ["wait", duration] => Ok(Self::Wait(time(duration)?)),
            ["all", "nmt", command] => Ok(Self::Nmt(None, nmt(command)?)),
            [place, ref rest @ ..] if place.parse::<Place>().is_ok() => of_node(place, rest),
            _ => Err(format!("'{line}' is not a host command; expected one of: {}", FORMS.join("; "))),
        }
    }
}

fn of_node(place_word: &str, words: &[&str]) -> Result<Command, String> {
    let place: Place = place_word.parse().map_err(|()| format!("'{place_word}' is not a node"))?;
    let id = || node(&place.node.to_string());
    match *words {
        [word] if INTENTS.iter().any(|(name, _)| *name == word) => {
            let found = INTENTS.iter().find(|(name, _)| *name == word);
            found.map(|(_, intent)| Command::Drive(place, *intent)).ok_or_else(|| unknown(words))
        }
        ["nmt", command] => Ok(Command::Nmt(Some(id()?), nmt(command)?)),
        ["watch", period] => Ok(Command::Watch(id()?, time(period)?)),
        ["read", name] => Ok(Command::Read(id()?, object(name)?)),
        ["pdo", ref rest @ ..] => pdo(rest).map(|command| Ok(Command::Pdo(id()?, command)))?,
        ["write", name, ref value @ ..] if !value.is_empty() => {
            Ok(Command::Write(id()?, object(name)?, value.join(" ")))
        }
        ["velocity", speed, ref rest @ ..] => {
            let (manner @ Manner { speed: None, .. }, None) = manner(rest)? else { return Err(unknown(words)) };
            Ok(Command::Velocity(place, quantity(speed)?, manner))
        }
        ["move", "by", to, ref rest @ ..] => movement(place, to, true, rest),
        ["move", to, ref rest @ ..] => movement(place, to, false, rest),
        ["torque", current] => Ok(Command::Torque(place, quantity::<Amperes>(current)?)),
        ["home", method, ref rest @ ..] => {
            let method = method
                .parse()
                .map_err(|_| format!("'{method}' is not a homing method; expected a number, as in: home 17"))?;
            let (manner, within) = manner(rest)?;
            Ok(Command::Home { place, method, within, manner })
        }
        _ => Err(unknown(words)),
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
        _ => {
            let forms: Vec<_> = FORMS.iter().filter(|form| form.starts_with("NODE pdo")).copied().collect();
            Err(format!("'pdo {}' is not a host command; expected one of: {}", words.join(" "), forms.join("; ")))
        }
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

fn unknown(words: &[&str]) -> String {
    let forms: Vec<_> = FORMS.iter().filter(|form| form.starts_with("NODE")).copied().collect();
    format!("'{}' is not a host command for a node; expected one of: {}", words.join(" "), forms.join("; "))
}

fn movement(place: Place, to: &str, relative: bool, rest: &[&str]) -> Result<Command, String> {
    let (manner, None) = manner(rest)? else { return Err(unknown(rest)) };
    Ok(Command::Move { place, to: quantity(to)?, relative, manner })
}

/// What may stand behind an intent: how, and for how long at most.
fn manner(mut words: &[&str]) -> Result<(Manner, Option<Duration>), String> {
    let mut manner = Manner::default();
    let mut within = None;
    while let Some((&word, rest)) = words.split_first() {
        words = rest;
        if word == "no-wait" {
            manner.no_wait = true;
            continue;
        }
        let Some((&value, rest)) = rest.split_first() else {
            return Err(format!(
                "'{word}' has no value; expected [at SPEED] [acceleration RAMP] [deceleration RAMP] [within TIME] [no-wait]"
            ));
        };
        words = rest;
        match word {
            "at" => manner.speed = Some(quantity(value)?),
            "acceleration" => manner.acceleration = Some(quantity(value)?),
            "deceleration" => manner.deceleration = Some(quantity(value)?),
            "within" => within = Some(time(value)?),
            _ => {
                return Err(format!(
                    "'{word}' is not an option of a motion; expected at, acceleration, deceleration, within or no-wait"
                ));
            }
        }
    }
    Ok((manner, within))
}

fn quantity<T: FromStr<Err = master::units::ParseUnitError>>(text: &str) -> Result<T, String> {
    text.parse().map_err(|error: master::units::ParseUnitError| error.to_string())
}

fn time(text: &str) -> Result<Duration, String> {
    parse_duration(text).map_err(|error| error.to_string())
}

fn node(text: &str) -> Result<NodeId, String> {
    crate::words::node::node(text)
}

fn nmt(word: &str) -> Result<NmtCommand, String> {
    let known = NMT.iter().find(|(name, _)| *name == word);
    known
        .map(|(_, command)| *command)
        .ok_or_else(|| format!("'{word}' is not a command; expected {}", NMT.map(|(name, _)| name).join(", ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_an_intent_and_other_lines_are_refused_with_the_possible_forms() {
        for line in [
            "4 enable",
            "4 velocity -60rpm acceleration 500ms no-wait",
            "5.2 move by 90deg at 30rpm",
            "2 move 40mm at 20mm/s acceleration 100mm/s2",
            "2 velocity -5mm/s deceleration 100mm/s2",
            "4 move 32000",
            "2 home 17 at 60rpm within 5s",
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
        for (line, said) in [
            ("", "expected one of"),
            ("dance", "expected one of"),
            ("4 dance", "NODE enable"),
            ("4 velocity", "NODE enable"),
            ("4 velocity fast", "does not begin with a number"),
            ("4 velocity 60rpm at 5rpm", "is not a host command"),
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
