//! Data sheets from the disk, to be shown, checked or used.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use eds::document::{Bounds, Document};
use eds::{Eds, Reading, Refusal};

use crate::failure::Failure;

/// Why a file gave no data sheet.
pub enum Unread {
    /// It cannot be read.
    File(io::Error),
    /// Not a data sheet.
    Refused(Refusal),
}

/// Reads a file as it stands, no more of it than an EDS may have.
pub fn document(path: &Path) -> Result<Document, Unread> {
    let mut bytes = Vec::new();
    let file = File::open(path).map_err(Unread::File)?;
    file.take(Bounds::DEFAULT.bytes as u64 + 1).read_to_end(&mut bytes).map_err(Unread::File)?;
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
            Self::File(error) => Failure::new(format!("cannot read {}", path.display()))
                .because(error)
                .next("is the name right, and may this user read the file?"),
            Self::Refused(refusal) => {
                let at = if refusal.line > 0 { format!(", line {}", refusal.line) } else { String::new() };
                Failure::new(format!("{}{at} is not read as an EDS", path.display()))
                    .of_kind("not_an_eds")
                    .because(&refusal.reason)
                    .next(&refusal.next)
            }
        }
    }
}
