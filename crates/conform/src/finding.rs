//! What a case comes to: what was seen, what is wrong, or why it says nothing.

/// What was seen where it is right; else what is wrong, or why the case says nothing.
pub(crate) type Verdict = Result<String, Finding>;

/// Why a case was not passed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Finding {
    /// The node does something else.
    Fail(String),
    /// The device does not have what is asked about.
    NotApplicable(String),
}

/// Ends a case: the node does something else.
macro_rules! fail {
    ($($text:tt)*) => { return Err($crate::finding::Finding::Fail(format!($($text)*))) };
}
pub(crate) use fail;

/// Ends a case that says nothing about this device.
macro_rules! not_applicable {
    ($($text:tt)*) => { return Err($crate::finding::Finding::NotApplicable(format!($($text)*))) };
}
pub(crate) use not_applicable;
