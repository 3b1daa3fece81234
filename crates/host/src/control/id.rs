//! What a client marks a request with, to know its answer.

/// A request's mark: a whole number, or a text of at most 128 bytes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Id {
    /// A number.
    Number(i64),
    /// A text.
    Text(String),
}
