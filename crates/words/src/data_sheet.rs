//! Data sheets from the disk, to be shown, checked or used.

use std::path::Path;

use eds::document::{Bounds, Document};
use eds::{Eds, Reading, Refusal};

use crate::document::read_bytes;
use crate::failure::Failure;

/// Why a file gave no data sheet.
pub enum Unread {
    /// It cannot be read, and why.
    File(String),
    /// Not a data sheet.
    Refused(Refusal),
}

/// Reads a file as it stands, no more of it than an EDS may have.
pub fn document(path: &Path) -> Result<Document, Unread> {
    let bytes = read_bytes(path, Bounds::DEFAULT.bytes as u64).map_err(Unread::File)?;
    Document::parse(&bytes).map_err(Unread::Refused)
}

/// Reads a data sheet.
pub fn reading(path: &Path) -> Result<Reading, Unread> {
    Eds::read(&document(path)?).map_err(Unread::Refused)
}

impl Unread {
    /// What it means for a file that was asked for.
    pub fn failure(&self, path: &Path) -> Failure {
        match self {
            Self::File(error) => Failure::bad_file(format!("cannot read {}", path.display()))
                .because(error)
                .next("check the name, and that this user may read the file"),
            Self::Refused(refusal) => {
                let at = if refusal.line > 0 { format!(", line {}", refusal.line) } else { String::new() };
                Failure::new(format!("{}{at} cannot be read as an EDS", path.display()))
                    .of_kind("not_an_eds")
                    .because(&refusal.reason)
                    .next(&refusal.next)
            }
        }
    }
}
