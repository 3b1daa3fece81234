//! What a session is answered.

use serde::Serialize;
use serde_json::Value;

/// The answer to one message.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Answer {
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
pub struct Trouble {
    /// A stable word for programs.
    pub kind: &'static str,
    /// In words.
    pub message: String,
}

impl Answer {
    const KIND: &'static str = "answer";

    /// Success without a result.
    pub const fn done(seq: u64, notes: Vec<String>) -> Self {
        Self { kind: Self::KIND, seq: Some(seq), ok: true, notes, result: None, error: None }
    }

    /// Success with a result.
    pub const fn known(seq: u64, result: Value) -> Self {
        Self { kind: Self::KIND, seq: Some(seq), ok: true, notes: Vec::new(), result: Some(result), error: None }
    }

    /// A refusal or failure.
    pub fn failed(seq: Option<u64>, kind: &'static str, message: impl Into<String>) -> Self {
        let error = Some(Box::new(Trouble { kind, message: message.into() }));
        Self { kind: Self::KIND, seq, ok: false, notes: Vec::new(), result: None, error }
    }

    /// Why it was refused or failed.
    pub(crate) fn trouble(&self) -> Option<&Trouble> {
        self.error.as_deref()
    }

    /// Whether it succeeded.
    #[cfg(test)]
    pub const fn is_ok(&self) -> bool {
        self.ok
    }

    /// The word of the error; empty on success.
    #[cfg(test)]
    pub fn error_kind(&self) -> &'static str {
        self.error.as_ref().map_or("", |error| error.kind)
    }

    /// One JSON object without a line break, as `docs/control.md` describes it.
    pub fn json(&self) -> String {
        // Only strings, numbers and flags: serialising cannot fail.
        serde_json::to_string(self).unwrap_or_default()
    }
}
