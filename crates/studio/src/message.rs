//! The messages of a page, as JSON: one object per message, `{"seq":7,"session":"..","do":"enable","node":4}`.
//!
//! `seq` rises from message to message, and `session` is the word of the welcome message: a message that is sent
//! again, or to another session, is refused. Units are in the names: `rpm`, `degrees`, `amperes`, `rpm_per_s`.

use canopen::NodeId;
use master::base::Twist;
use serde::{Deserialize, Deserializer, Serialize};
use serde_json::Value;

/// A message of a page.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Message {
    /// Sequence number, above all before.
    pub(crate) seq: u64,
    /// The session word of the welcome message.
    pub(crate) word: String,
    /// The command.
    pub(crate) command: Command,
}

/// A command of a page.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(tag = "do", rename_all = "snake_case", deny_unknown_fields)]
pub(crate) enum Command {
    /// Shows that the page is there; required at least every [`crate::PRESENCE_SPAN`] from a page that moves something.
    Alive {},
    /// Takes control if no session has it.
    TakeControl {},
    /// Asks for control.
    AskControl {},
    /// Hands control to a session.
    HandOver {
        /// Its number.
        to: u64,
    },
    /// Releases control.
    ReleaseControl {},
    /// Limits the speed of the motions of this session, in r/min; `null` removes the limit. Motions under way are stopped by a
    /// limit that is lower than before.
    LimitSpeed {
        /// Above 0.
        rpm: Option<f64>,
    },
    /// Quick-stops every drive. Open to all.
    StopAll {},
    /// Scans the bus for nodes.
    Scan {},
    /// Lists the commands to the world around virtual drives.
    WorldForms {},
    /// Reads the true state of the world around virtual drives, and the changes after the one with this number.
    LookAround { after: Option<u64> },
    /// Changes the world around virtual drives, by a command of `ferrodrive sim`.
    ChangeWorld { line: String },
    /// Explains what keeps a drive from moving.
    Explain {
        #[serde(deserialize_with = "node")]
        node: NodeId,
    },
    /// To Operation enabled.
    Enable {
        #[serde(deserialize_with = "node")]
        node: NodeId,
    },
    /// To Switch on disabled.
    Disable {
        #[serde(deserialize_with = "node")]
        node: NodeId,
    },
    /// Resets a fault.
    ResetFault {
        #[serde(deserialize_with = "node")]
        node: NodeId,
    },
    /// By the deceleration ramp; the drive stays enabled.
    Stop {
        #[serde(deserialize_with = "node")]
        node: NodeId,
    },
    /// By the quick stop ramp. Open to all.
    QuickStop {
        #[serde(deserialize_with = "node")]
        node: NodeId,
    },
    /// Allows motions of this drive although nothing stops it when this program dies. Holds until control changes hands.
    AcceptUnguarded {
        #[serde(deserialize_with = "node")]
        node: NodeId,
    },
    /// Turns as long as it is held.
    Jog {
        #[serde(deserialize_with = "node")]
        node: NodeId,
        rpm: f64,
    },
    /// Holds a jog; at least every 100 ms.
    JogHold {
        #[serde(deserialize_with = "node")]
        node: NodeId,
    },
    /// Ends a jog: the drive stops with its ramp.
    JogEnd {
        #[serde(deserialize_with = "node")]
        node: NodeId,
    },
    /// Turns at a speed until the next command.
    Velocity {
        #[serde(deserialize_with = "node")]
        node: NodeId,
        rpm: f64,
        rpm_per_s: Option<f64>,
    },
    /// Turns to a position, or by an angle.
    Move {
        #[serde(deserialize_with = "node")]
        node: NodeId,
        degrees: f64,
        #[serde(default)]
        relative: bool,
        rpm: Option<f64>,
    },
    /// Applies a motor current until the next command.
    Torque {
        #[serde(deserialize_with = "node")]
        node: NodeId,
        amperes: f64,
    },
    /// Finds the reference position.
    Home {
        #[serde(deserialize_with = "node")]
        node: NodeId,
        method: i8,
        rpm: Option<f64>,
    },
    /// Explains a term that the page shows.
    Help { node: Option<u8>, topic: Topic, name: String },
    /// Turns several drives to positions, or by angles, together.
    GroupMove(GroupMove),
    /// Turns several drives together as long as they are held.
    GroupJog { axes: Vec<AxisSpeed>, rpm_per_s: Option<f64> },
    /// Drives two wheels as a base as long as they are held.
    BaseJog(BaseJog),
    /// Holds a base, with another twist.
    BaseTwist { linear_m_s: f64, angular_rad_s: f64 },
    /// Holds a group; at least every 100 ms.
    GroupHold {},
    /// Ends a group: it comes to rest within its limits.
    GroupEnd {},
    /// Reads the homing methods of a drive, its homing settings and the present levels of its switches.
    Homing {
        #[serde(deserialize_with = "node")]
        node: NodeId,
    },
    /// Lists the objects in the description of a drive.
    Objects {
        #[serde(deserialize_with = "node")]
        node: NodeId,
    },
    /// Reads the present values of objects.
    ReadObjects {
        #[serde(deserialize_with = "node")]
        node: NodeId,
        objects: Vec<String>,
    },
    /// Plans the writes for values or a file, without writing.
    PlanParameters {
        #[serde(deserialize_with = "node")]
        node: NodeId,
        #[serde(default)]
        values: Vec<NewValue>,
        file: Option<String>,
    },
    /// Compares the objects of a file: default, file, drive.
    CompareParameters {
        #[serde(deserialize_with = "node")]
        node: NodeId,
        file: String,
    },
    /// Writes values or a file, all or nothing.
    WriteParameters {
        #[serde(deserialize_with = "node")]
        node: NodeId,
        #[serde(default)]
        values: Vec<NewValue>,
        file: Option<String>,
    },
    /// Undoes the last write.
    RollBack {
        #[serde(deserialize_with = "node")]
        node: NodeId,
    },
    /// Makes a drive store its parameters.
    Store {
        #[serde(deserialize_with = "node")]
        node: NodeId,
    },
    /// Reads the configuration of the PDOs of a node, what may be changed, and why one is not sent.
    Pdos {
        #[serde(deserialize_with = "node")]
        node: NodeId,
    },
    /// Plans a configuration of PDOs, with its effect on the bus, without writing.
    PlanPdos {
        #[serde(deserialize_with = "node")]
        node: NodeId,
        pdos: Vec<NewPdo>,
        /// Period of SYNC for which the load is computed.
        cycle_ms: f64,
        /// In bit/s, if the studio does not know it.
        bitrate: Option<u32>,
    },
    /// Configures PDOs, all or nothing.
    WritePdos {
        #[serde(deserialize_with = "node")]
        node: NodeId,
        pdos: Vec<NewPdo>,
    },
    /// Starts a node, or takes it out of operational: PDOs exist only there (CiA 301, 7.3.2.2).
    Nmt {
        #[serde(deserialize_with = "node")]
        node: NodeId,
        command: NmtWish,
    },
    /// Reads all parameters of a drive, as a file.
    BackUp {
        #[serde(deserialize_with = "node")]
        node: NodeId,
        #[serde(default)]
        form: FileForm,
    },
}

/// The format of a parameter file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum FileForm {
    /// For people.
    #[default]
    Toml,
    /// For other tools (CiA 306-1).
    Dcf,
}

/// A new value of an object, as people type it: `{"object":"6083","value":"600"}`.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct NewValue {
    pub(crate) object: String,
    pub(crate) value: String,
}

/// A configuration of a PDO; omitted fields stay as they are:
/// `{"pdo":"TPDO1","valid":true,"objects":[{"object":"6041h:00","bits":16}],"transmission":255,"event_ms":100}`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct NewPdo {
    pub(crate) pdo: String,
    pub(crate) valid: bool,
    pub(crate) objects: Option<Vec<NewEntry>>,
    pub(crate) transmission: Option<u8>,
    pub(crate) inhibit_ms: Option<f64>,
    pub(crate) event_ms: Option<f64>,
    /// Its CAN-ID.
    pub(crate) id: Option<u16>,
}

/// An object in a PDO.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct NewEntry {
    pub(crate) object: String,
    pub(crate) bits: u8,
}

/// The NMT commands that a page may give.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum NmtWish {
    /// Start remote node.
    Start,
    /// Enter pre-operational.
    PreOperational,
}

/// The kind of a term to be explained.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Topic {
    /// An object, `6040h:00`.
    Object,
    /// A state of the power state machine.
    State,
    /// A bit of the statusword.
    StatusBit,
    /// A bit of the controlword.
    ControlBit,
    /// A mode of operation.
    Mode,
    /// An NMT state.
    Nmt,
    /// A service of CANopen, or a kind of timeline entry.
    Service,
    /// A fault or an alarm, by its name.
    Fault,
}

/// Targets of several drives.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct GroupMove {
    pub(crate) axes: Vec<AxisTarget>,
    #[serde(default)]
    pub(crate) relative: bool,
    /// The highest speed of each.
    pub(crate) rpm: Option<f64>,
    pub(crate) rpm_per_s: Option<f64>,
    /// Duration of the motion, instead of the shortest possible.
    pub(crate) within_s: Option<f64>,
}

/// The target of a drive of a group.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct AxisTarget {
    #[serde(deserialize_with = "node")]
    pub(crate) node: NodeId,
    pub(crate) degrees: f64,
}

/// The speed of a drive of a group.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct AxisSpeed {
    #[serde(deserialize_with = "node")]
    pub(crate) node: NodeId,
    pub(crate) rpm: f64,
}

/// A two-wheeled base and its motion.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct BaseJog {
    /// The left one and the right one.
    #[serde(deserialize_with = "nodes")]
    pub(crate) wheels: [NodeId; 2],
    /// Turns of each drive for a turn of its wheel forward.
    pub(crate) turns: [f64; 2],
    pub(crate) wheel_base_m: f64,
    pub(crate) wheel_radius_m: f64,
    /// The highest speed of a wheel over the ground, and its highest acceleration.
    pub(crate) most_m_s: f64,
    pub(crate) m_per_s2: f64,
    pub(crate) linear_m_s: f64,
    pub(crate) angular_rad_s: f64,
}

impl BaseJog {
    /// Its motion.
    pub(crate) const fn twist(&self) -> Twist {
        Twist { linear_m_s: self.linear_m_s, angular_rad_s: self.angular_rad_s }
    }
}

impl Command {
    /// Whether it needs control.
    pub(crate) const fn needs_control(&self) -> bool {
        !matches!(
            self,
            Self::Alive {}
                | Self::TakeControl {}
                | Self::AskControl {}
                | Self::HandOver { .. }
                | Self::ReleaseControl {}
                | Self::LimitSpeed { .. }
                | Self::StopAll {}
                | Self::Scan {}
                | Self::WorldForms {}
                | Self::LookAround { .. }
                | Self::Explain { .. }
                | Self::Homing { .. }
                | Self::Help { .. }
                | Self::QuickStop { .. }
                | Self::Objects { .. }
                | Self::ReadObjects { .. }
                | Self::PlanParameters { .. }
                | Self::CompareParameters { .. }
                | Self::BackUp { .. }
                | Self::Pdos { .. }
                | Self::PlanPdos { .. }
        )
    }
}

/// A malformed message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Malformed {
    /// Its number, if readable.
    pub(crate) seq: Option<u64>,
    /// What is wrong with it.
    pub(crate) why: String,
}

impl Message {
    /// Parses a message.
    pub(crate) fn parse(text: &str) -> Result<Self, Malformed> {
        let malformed = |seq, why: String| Malformed { seq, why };
        let value: Value = serde_json::from_str(text).map_err(|error| malformed(None, error.to_string()))?;
        let Value::Object(mut fields) = value else {
            return Err(malformed(None, r#"expected an object such as {"seq":1,"session":"..","do":"alive"}"#.into()));
        };
        let seq = fields.remove("seq").and_then(|seq| seq.as_u64()).filter(|seq| *seq > 0);
        let Some(seq) = seq else {
            return Err(malformed(None, "expected seq to be a whole number above 0".into()));
        };
        let word = match fields.remove("session") {
            Some(Value::String(word)) => word,
            _ => return Err(malformed(Some(seq), "expected session to be the word of the welcome message".into())),
        };
        let command = serde_json::from_value(Value::Object(fields));
        let command = command.map_err(|error| malformed(Some(seq), error.to_string()))?;
        Ok(Self { seq, word, command })
    }
}

fn node<'de, D: Deserializer<'de>>(deserializer: D) -> Result<NodeId, D::Error> {
    let raw = u8::deserialize(deserializer)?;
    NodeId::new(raw).ok_or_else(|| serde::de::Error::custom(format!("expected a node-ID from 1 to 127, got {raw}")))
}

fn nodes<'de, D: Deserializer<'de>>(deserializer: D) -> Result<[NodeId; 2], D::Error> {
    let raw = <[u8; 2]>::deserialize(deserializer)?;
    let known = |raw: u8| {
        NodeId::new(raw).ok_or_else(|| serde::de::Error::custom(format!("expected node-IDs from 1 to 127, got {raw}")))
    };
    Ok([known(raw[0])?, known(raw[1])?])
}

/// The answer to one message.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Answer {
    #[serde(rename = "type")]
    kind: &'static str,
    /// The number of the message; `null` if it could not be read.
    seq: Option<u64>,
    ok: bool,
    /// Remarks, in words.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    notes: Vec<String>,
    /// The result, for commands that have one.
    #[serde(skip_serializing_if = "Option::is_none")]
    result: Option<Value>,
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<Box<Trouble>>,
}

/// Why a command was refused or failed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub(crate) struct Trouble {
    /// A stable word for programs.
    pub(crate) kind: &'static str,
    /// In words.
    pub(crate) message: String,
}

impl Answer {
    const KIND: &'static str = "answer";

    /// Success without a result.
    pub(crate) const fn done(seq: u64, notes: Vec<String>) -> Self {
        Self { kind: Self::KIND, seq: Some(seq), ok: true, notes, result: None, error: None }
    }

    /// Success with a result.
    pub(crate) const fn known(seq: u64, result: Value) -> Self {
        Self { kind: Self::KIND, seq: Some(seq), ok: true, notes: Vec::new(), result: Some(result), error: None }
    }

    /// A refusal or failure.
    pub(crate) fn failed(seq: Option<u64>, kind: &'static str, message: impl Into<String>) -> Self {
        let error = Some(Box::new(Trouble { kind, message: message.into() }));
        Self { kind: Self::KIND, seq, ok: false, notes: Vec::new(), result: None, error }
    }

    /// Whether it succeeded.
    #[cfg(test)]
    pub(crate) const fn is_ok(&self) -> bool {
        self.ok
    }

    /// The word of the error; empty on success.
    #[cfg(test)]
    pub(crate) fn error_kind(&self) -> &'static str {
        self.error.as_ref().map_or("", |error| error.kind)
    }

    /// As JSON.
    pub(crate) fn json(&self) -> String {
        // Only strings, numbers and flags: serialising cannot fail.
        serde_json::to_string(self).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_is_its_number_its_session_and_a_deed() {
        let message = Message::parse(r#"{"seq":7,"session":"w","do":"jog","node":4,"rpm":-60}"#).expect("whole");
        let node = NodeId::new(4).expect("a node-ID");
        assert_eq!(message, Message { seq: 7, word: "w".into(), command: Command::Jog { node, rpm: -60.0 } });
        assert!(message.command.needs_control());
        let stop = Message::parse(r#"{"seq":8,"session":"w","do":"stop_all"}"#).expect("whole");
        assert!(!stop.command.needs_control());
    }

    #[test]
    fn a_malformed_message_is_refused_with_its_number() {
        for (text, seq, why) in [
            ("", None, "EOF"),
            ("[]", None, "expected an object"),
            ("{}", None, "seq"),
            (r#"{"seq":0,"session":"w","do":"alive"}"#, None, "above 0"),
            (r#"{"seq":-1,"session":"w","do":"alive"}"#, None, "above 0"),
            (r#"{"seq":1,"do":"alive"}"#, Some(1), "session"),
            (r#"{"seq":1,"session":"w"}"#, Some(1), "do"),
            (r#"{"seq":1,"session":"w","do":"fly"}"#, Some(1), "fly"),
            (r#"{"seq":1,"session":"w","do":"enable"}"#, Some(1), "node"),
            (r#"{"seq":1,"session":"w","do":"enable","node":0}"#, Some(1), "1 to 127"),
            (r#"{"seq":1,"session":"w","do":"enable","node":128}"#, Some(1), "1 to 127"),
            (r#"{"seq":1,"session":"w","do":"enable","node":4.5}"#, Some(1), "u8"),
            (r#"{"seq":1,"session":"w","do":"jog","node":4,"rpm":"fast"}"#, Some(1), "f64"),
            (r#"{"seq":1,"session":"w","do":"jog","node":4,"rpm":1e999}"#, None, "out of range"),
            (r#"{"seq":1,"session":"w","do":"jog","node":4,"rpm":1,"for":9}"#, Some(1), "for"),
            (r#"{"seq":1,"session":"w","do":"write_pdos","node":4,"pdos":[{"pdo":"TPDO1"}]}"#, Some(1), "valid"),
            (
                r#"{"seq":1,"session":"w","do":"write_pdos","node":4,"pdos":[{"pdo":"TPDO1","valid":true,"transmission":256}]}"#,
                Some(1),
                "u8",
            ),
            (
                r#"{"seq":1,"session":"w","do":"write_pdos","node":4,"pdos":[{"pdo":"TPDO1","valid":true,"kind":1}]}"#,
                Some(1),
                "kind",
            ),
            (r#"{"seq":1,"session":"w","do":"nmt","node":4,"command":"reset"}"#, Some(1), "pre_operational"),
        ] {
            let malformed = Message::parse(text).expect_err(text);
            assert_eq!(malformed.seq, seq, "{text}");
            assert!(malformed.why.contains(why), "{text}: {}", malformed.why);
        }
    }
}
