//! Data sheets from the disk, for whoever shows, checks or uses them.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use eds::document::{Bounds, Document};
use eds::{Eds, Reading, Refusal};

/// Why a file gave no data sheet.
pub enum Unread {
    /// It cannot be read.
    File(io::Error),
    /// It is no data sheet.
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
