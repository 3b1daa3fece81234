//! The messages of a page, as JSON: one object per message, `{"seq":7,"session":"..","do":"enable","node":4}`.
//!
//! `seq` rises from message to message, and `session` is the word of the welcome message: a message that is sent
//! again, or to another session, is refused. The rest is a [`Command`].

use serde_json::Value;

use crate::command::Command;

/// A message of a page.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PageMessage {
    /// Sequence number, above all before.
    pub(crate) seq: u64,
    /// The session word of the welcome message.
    pub(crate) word: String,
    /// The command.
    pub(crate) command: Command,
}

/// A malformed message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct MalformedMessage {
    /// Its number, if readable.
    pub(crate) seq: Option<u64>,
    /// What is wrong with it.
    pub(crate) why: String,
}

impl PageMessage {
    /// Parses a message.
    pub(crate) fn parse(text: &str) -> Result<Self, MalformedMessage> {
        let malformed = |seq, why: String| MalformedMessage { seq, why };
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::NodeCommand;
    use canopen::NodeId;

    #[test]
    fn a_message_is_its_number_its_session_and_a_command() {
        let message = PageMessage::parse(r#"{"seq":7,"session":"w","do":"jog","node":4,"rpm":-60}"#).expect("whole");
        let node = NodeId::new(4).expect("a node-ID");
        assert_eq!(
            message,
            PageMessage { seq: 7, word: "w".into(), command: NodeCommand::Jog { rpm: -60.0 }.to(node) }
        );
        assert!(message.command.needs_control());
        let stop = PageMessage::parse(r#"{"seq":8,"session":"w","do":"stop_all"}"#).expect("whole");
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
            let malformed = PageMessage::parse(text).expect_err(text);
            assert_eq!(malformed.seq, seq, "{text}");
            assert!(malformed.why.contains(why), "{text}: {}", malformed.why);
        }
    }
}
