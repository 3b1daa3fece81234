//! What a session asks for, one enum: as JSON an object such as `{"do":"enable","node":4}`. Units are in the names: `rpm`,
//! `degrees`, `amperes`, `rpm_per_s`.
//!
//! It is nested, so that the compiler knows what concerns one node, several drives, parameters, PDOs or the session. A command to a
//! drive is the master's own ([`master::drive::Command`]).

mod capture;
pub(crate) mod fields;
mod group;
mod node;
mod parameters;
mod pdo;
mod session;
mod tune;

pub use capture::{CaptureCommand, CaptureOrder, TestMotionOrder};
pub use group::{AxisSpeed, AxisTarget, BaseJog, GroupCommand, GroupMove};
pub use node::NodeCommand;
pub use parameters::{FileForm, NewValue, ParameterChange, ParameterReading};
pub use pdo::{NewEntry, NewPdo, NmtChange, PdoCommand};
pub use session::{SessionCommand, Topic, WorldCommand};
pub use tune::TuneCommand;

use canopen::NodeId;
use serde::de::Error;
use serde::{Deserialize, Deserializer};
use serde_json::Value;

use fields::{Fields, command};

/// A command of a session.
#[derive(Clone, Debug, PartialEq)]
pub enum Command {
    /// Concerns the session, or the bus as a whole.
    Session(SessionCommand),
    /// Concerns the world around virtual drives.
    World(WorldCommand),
    /// Concerns several drives.
    Group(GroupCommand),
    /// Concerns one node.
    Node(NodeId, NodeCommand),
}

impl Command {
    /// Quick-stops every drive.
    pub const STOP_ALL: Self = Self::Session(SessionCommand::StopAll {});

    /// Whether it needs control.
    pub const fn needs_control(&self) -> bool {
        match self {
            Self::Session(command) => command.needs_control(),
            Self::World(command) => command.needs_control(),
            Self::Group(_) => true,
            Self::Node(_, command) => command.needs_control(),
        }
    }
}

impl NodeCommand {
    /// The same to this node.
    pub const fn to(self, node: NodeId) -> Command {
        Command::Node(node, self)
    }
}

impl From<SessionCommand> for Command {
    fn from(command: SessionCommand) -> Self {
        Self::Session(command)
    }
}

impl From<WorldCommand> for Command {
    fn from(command: WorldCommand) -> Self {
        Self::World(command)
    }
}

impl From<GroupCommand> for Command {
    fn from(command: GroupCommand) -> Self {
        Self::Group(command)
    }
}

impl<'de> Deserialize<'de> for Command {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        read(Fields::deserialize(deserializer)?).map_err(D::Error::custom)
    }
}

fn read(mut fields: Fields) -> Result<Command, String> {
    let word = match fields.get("do") {
        Some(Value::String(word)) => word.clone(),
        Some(_) => return Err("expected `do` to be the word of a command".into()),
        None => return Err("missing field `do`".into()),
    };
    let of = |words: &[&str]| words.contains(&word.as_str());
    if of(SessionCommand::WORDS) {
        return command(&word, fields).map(Command::Session);
    }
    if of(WorldCommand::WORDS) {
        return command(&word, fields).map(Command::World);
    }
    if of(GroupCommand::WORDS) {
        return command(&word, fields).map(Command::Group);
    }
    if !NodeCommand::words().any(|known| known == word) {
        let known = [SessionCommand::WORDS, WorldCommand::WORDS, GroupCommand::WORDS].into_iter().flatten().copied();
        let known: Vec<_> = known.chain(NodeCommand::words()).collect();
        return Err(format!("unknown command `{word}`, expected one of {}", known.join(", ")));
    }
    let node = fields::node_id(&mut fields)?;
    node::read(&word, fields).map(|command| Command::Node(node, command))
}

#[cfg(test)]
mod tests {
    use serde::de::DeserializeOwned;

    use super::*;

    /// The variants that serde names when it meets one that it does not know.
    fn variants<T: DeserializeOwned>() -> Vec<String> {
        let refused = serde_json::from_str::<T>(r#"{"none":{}}"#).err().map(|error| error.to_string());
        let refused = refused.unwrap_or_default();
        refused.split('`').skip(3).step_by(2).map(str::to_owned).collect()
    }

    #[test]
    fn a_number_that_is_not_a_node_id_is_refused_in_every_field() {
        for text in [
            r#"{"do":"help","node":NODE,"topic":"state","name":"fault"}"#,
            r#"{"do":"group_jog","axes":[{"node":NODE,"rpm":1}],"rpm_per_s":null}"#,
            r#"{"do":"explain","node":NODE}"#,
        ] {
            let read = |node: &str| {
                let message: serde_json::Map<_, _> =
                    serde_json::from_str(&text.replace("NODE", node)).expect("an object");
                super::read(message)
            };
            assert!(read("127").is_ok(), "{text}: {:?}", read("127"));
            for number in ["0", "128", "200"] {
                let refused = read(number).expect_err(text);
                assert!(refused.contains(&format!("expected a node-ID from 1 to 127, got {number}")), "{refused}");
            }
        }
    }

    #[test]
    fn the_words_of_each_kind_are_its_variants() {
        assert_eq!(variants::<SessionCommand>(), SessionCommand::WORDS);
        assert_eq!(variants::<WorldCommand>(), WorldCommand::WORDS);
        assert_eq!(variants::<GroupCommand>(), GroupCommand::WORDS);
        assert_eq!(variants::<ParameterReading>(), ParameterReading::WORDS);
        assert_eq!(variants::<ParameterChange>(), ParameterChange::WORDS);
        assert_eq!(variants::<PdoCommand>(), PdoCommand::WORDS);
        assert_eq!(variants::<CaptureCommand>(), CaptureCommand::WORDS);
        assert_eq!(variants::<TuneCommand>(), TuneCommand::WORDS);
    }
}
