//! Why a word names no drive and no model: the word itself, or the file that it names. A command line with the second makes sense.

/// See the [module](self). Displays as the reason.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Unresolved {
    /// The word makes no sense, whatever files there are.
    #[error("{0}")]
    Word(String),
    /// The file that it names is missing, or does not describe a device.
    #[error("{0}")]
    File(String),
}

impl From<String> for Unresolved {
    fn from(reason: String) -> Self {
        Self::Word(reason)
    }
}

impl From<Unresolved> for String {
    fn from(unresolved: Unresolved) -> Self {
        unresolved.to_string()
    }
}
