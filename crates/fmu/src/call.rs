//! What becomes of a call of an importer.

/// Why a call was not carried out: what, and what was expected.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct CallError(pub String);

/// The result of a call.
pub type Called<T> = Result<T, CallError>;

/// A call that is not carried out.
pub(crate) fn refused<T>(what: impl Into<String>) -> Called<T> {
    Err(CallError(what.into()))
}
