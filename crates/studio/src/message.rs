//! What a page may say, as JSON: one object a message, `{"seq":7,"session":"..","do":"enable","node":4}`.
//!
//! `seq` rises from message to message, and `session` is the word that the page was welcomed with: a message that is sent
//! again, or to another session, is refused. Units stand in the names: `rpm`, `degrees`, `amperes`, `rpm_per_s`.

use canopen::NodeId;
use serde::{Deserialize, Deserializer, Serialize};
use serde_json::Value;

/// A message of a page.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Message {
    /// Above those before.
    pub(crate) seq: u64,
    /// The word that the session was welcomed with.
    pub(crate) word: String,
    /// What is to be done.
    pub(crate) deed: Deed,
}

/// What a page may ask for.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(tag = "do", rename_all = "snake_case", deny_unknown_fields)]
pub(crate) enum Deed {
    /// The page is there; whoever has moved something says so at least every [`crate::PRESENCE_SPAN`].
    Alive {},
    /// Takes control where nobody has it.
    TakeControl {},
    /// Asks for control.
    AskControl {},
    /// Hands control to a session.
    HandOver {
        /// Its number.
        to: u64,
    },
    /// Gives control up.
    ReleaseControl {},
    /// Quick-stops every drive. Open to all.
    StopAll {},
    /// Looks who is on the bus.
    Scan {},
    /// Says what keeps a drive from moving.
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
    /// Lets a jog go: the drive stops by its ramp.
    JogEnd {
        #[serde(deserialize_with = "node")]
        node: NodeId,
    },
    /// Turns at a speed until told otherwise.
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
    /// Pushes with a current until told otherwise.
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
    /// What the description says of each object of a drive.
    Objects {
        #[serde(deserialize_with = "node")]
        node: NodeId,
    },
    /// The values that objects have now.
    ReadObjects {
        #[serde(deserialize_with = "node")]
        node: NodeId,
        objects: Vec<String>,
    },
    /// What would be written, with nothing written: of values, or of a file.
    PlanParameters {
        #[serde(deserialize_with = "node")]
        node: NodeId,
        #[serde(default)]
        values: Vec<NewValue>,
        file: Option<String>,
    },
    /// The objects of a file: as delivered, in the file, in the drive.
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
    /// Puts back what the last write changed.
    RollBack {
        #[serde(deserialize_with = "node")]
        node: NodeId,
    },
    /// All parameters of a drive, as a file.
    BackUp {
        #[serde(deserialize_with = "node")]
        node: NodeId,
    },
}

/// What an object is to be set to, as people type it: `{"object":"6083","value":"600"}`.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct NewValue {
    pub(crate) object: String,
    pub(crate) value: String,
}

impl Deed {
    /// Whether only the session that has control may ask for it.
    pub(crate) const fn needs_control(&self) -> bool {
        !matches!(
            self,
            Self::Alive {}
                | Self::TakeControl {}
                | Self::AskControl {}
                | Self::HandOver { .. }
                | Self::ReleaseControl {}
                | Self::StopAll {}
                | Self::Scan {}
                | Self::Explain { .. }
                | Self::QuickStop { .. }
                | Self::Objects { .. }
                | Self::ReadObjects { .. }
                | Self::PlanParameters { .. }
                | Self::CompareParameters { .. }
                | Self::BackUp { .. }
        )
    }
}

/// A message that makes no sense.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Malformed {
    /// Its number, if that could be read.
    pub(crate) seq: Option<u64>,
    /// What is wrong with it.
    pub(crate) why: String,
}

impl Message {
    /// Reads a message.
    pub(crate) fn parse(text: &str) -> Result<Self, Malformed> {
        let malformed = |seq, why: String| Malformed { seq, why };
        let value: Value = serde_json::from_str(text).map_err(|error| malformed(None, error.to_string()))?;
        let Value::Object(mut fields) = value else {
            return Err(malformed(None, r#"expected an object such as {"seq":1,"session":"..","do":"alive"}"#.into()));
        };
        let seq = fields.remove("seq").and_then(|seq| seq.as_u64()).filter(|seq| *seq > 0);
        let Some(seq) = seq else {
            return Err(malformed(None, "expected a whole number above 0 as seq".into()));
        };
        let word = match fields.remove("session") {
            Some(Value::String(word)) => word,
            _ => return Err(malformed(Some(seq), "expected as session the word of the welcome message".into())),
        };
        let deed = serde_json::from_value(Value::Object(fields));
        let deed = deed.map_err(|error| malformed(Some(seq), error.to_string()))?;
        Ok(Self { seq, word, deed })
    }
}

fn node<'de, D: Deserializer<'de>>(deserializer: D) -> Result<NodeId, D::Error> {
    let raw = u8::deserialize(deserializer)?;
    NodeId::new(raw).ok_or_else(|| serde::de::Error::custom(format!("expected a node-ID from 1 to 127, not {raw}")))
}

/// The answer to one message.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Answer {
    #[serde(rename = "type")]
    kind: &'static str,
    /// The number of the message; `null` if it could not be read.
    seq: Option<u64>,
    ok: bool,
    /// What to know about it, in words.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    notes: Vec<String>,
    /// What was asked for, where something was.
    #[serde(skip_serializing_if = "Option::is_none")]
    result: Option<Value>,
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<Box<Trouble>>,
}

/// Why something was not done.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub(crate) struct Trouble {
    /// In a word that programs may rely on.
    pub(crate) kind: &'static str,
    /// In words.
    pub(crate) message: String,
}

impl Answer {
    const KIND: &'static str = "answer";

    /// It is done.
    pub(crate) const fn done(seq: u64, notes: Vec<String>) -> Self {
        Self { kind: Self::KIND, seq: Some(seq), ok: true, notes, result: None, error: None }
    }

    /// It is known.
    pub(crate) const fn known(seq: u64, result: Value) -> Self {
        Self { kind: Self::KIND, seq: Some(seq), ok: true, notes: Vec::new(), result: Some(result), error: None }
    }

    /// It is not done.
    pub(crate) fn failed(seq: Option<u64>, kind: &'static str, message: impl Into<String>) -> Self {
        let error = Some(Box::new(Trouble { kind, message: message.into() }));
        Self { kind: Self::KIND, seq, ok: false, notes: Vec::new(), result: None, error }
    }

    /// Whether it is done.
    #[cfg(test)]
    pub(crate) const fn is_ok(&self) -> bool {
        self.ok
    }

    /// Why not, in a word; empty if it is done.
    #[cfg(test)]
    pub(crate) fn error_kind(&self) -> &'static str {
        self.error.as_ref().map_or("", |error| error.kind)
    }

    /// As JSON.
    pub(crate) fn json(&self) -> String {
        // Strings, numbers and flags alone: there is nothing in it that JSON cannot say.
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
        assert_eq!(message, Message { seq: 7, word: "w".into(), deed: Deed::Jog { node, rpm: -60.0 } });
        assert!(message.deed.needs_control());
        let stop = Message::parse(r#"{"seq":8,"session":"w","do":"stop_all"}"#).expect("whole");
        assert!(!stop.deed.needs_control());
    }

    #[test]
    fn what_makes_no_sense_is_told_with_its_number() {
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
        ] {
            let malformed = Message::parse(text).expect_err(text);
            assert_eq!(malformed.seq, seq, "{text}");
            assert!(malformed.why.contains(why), "{text}: {}", malformed.why);
        }
    }
}
