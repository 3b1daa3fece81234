//! Answers: one line of JSON each.

use serde_json::{Value, json};
use sim::command::CommandError;

use super::id::Id;

/// The kinds of [`ControlError`], which programs may rely on.
pub const ERROR_KINDS: [&str; 9] =
    ["syntax", "usage", "no_such_node", "no_such_body", "refused", "clock", "token", "too_long", "limit"];

/// Why a request was not done, in the form of every error here: what kind, what, about which node, what to do.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct ControlError {
    kind: &'static str,
    message: String,
    node: Option<u8>,
    next: Option<String>,
}

/// The request that lists all requests.
pub(super) const HELP: &str = r#"{"request":"help"}"#;

impl ControlError {
    /// Of one of [`ERROR_KINDS`].
    pub fn new(kind: &'static str, message: impl Into<String>) -> Self {
        Self { kind, message: message.into(), node: None, next: None }
    }

    /// The request makes no sense; unless a better remedy is [given](Self::next), `help` lists those that do.
    pub fn usage(message: impl Into<String>) -> Self {
        Self::new("usage", message).next(HELP)
    }

    /// Says what to do.
    #[must_use]
    pub fn next(self, next: impl Into<String>) -> Self {
        Self { next: Some(next.into()), ..self }
    }

    /// The kind.
    pub const fn kind(&self) -> &'static str {
        self.kind
    }

    pub(super) fn answer(&self, id: Option<&Id>) -> String {
        let Self { kind, message, node, next } = self;
        let error = json!({
            "kind": kind, "message": message, "node": node, "object": null, "abort": null, "next": next
        });
        marked(id, &json!({ "ok": false, "error": error }).to_string())
    }
}

impl From<CommandError> for ControlError {
    fn from(error: CommandError) -> Self {
        let (node, next) = (error.node(), Some(error.next().to_owned()));
        Self { node, next, ..Self::new(error.kind(), error.to_string()) }
    }
}

/// An answer with the mark of its request: `{"id":1,"ok":true,..}` of `{"ok":true,..}`.
pub(super) fn marked(id: Option<&Id>, answer: &str) -> String {
    let id = match id {
        None => Value::Null,
        Some(Id::Number(number)) => json!(number),
        Some(Id::Text(text)) => json!(text),
    };
    format!("{{\"id\":{id},{}", answer.trim_start_matches('{'))
}
