//! Where a data sheet comes from: a file, or a model's description.

use std::path::Path;

use eds::document::Document;
use eds::{Eds, Reading, Severity, Sheet};

use crate::failure::Failure;
use words::data_sheet;
use words::models::resolve;

/// Reads a file as it stands.
pub(crate) fn document(path: &Path) -> Result<Document, Failure> {
    data_sheet::document(path).map_err(|unread| unread.failure(path).into())
}

/// Reads a data sheet.
pub(crate) fn reading(path: &Path) -> Result<Reading, Failure> {
    data_sheet::reading(path).map_err(|unread| unread.failure(path).into())
}

/// A data sheet from a file, or that of a model where no file has this name, and how many errors it has.
pub(super) fn sheet(name: &str) -> Result<(Eds, usize), Failure> {
    let path = Path::new(name);
    // The dot of `zlac8030l,firmware=2.01` does not begin a file extension.
    if path.exists() || (path.extension().is_some() && !name.contains(',')) {
        return reading(path).map(|Reading { eds, findings }| (eds, findings.count(Severity::Error)));
    }
    match resolve(name) {
        Ok(model) => Ok((Sheet::of(model).eds(), 0)),
        Err(unknown) => Err(Failure::usage(format!("there is no file {name}"))
            .because(unknown)
            .next("give the path of an EDS or DCF file, or a model; `ferrodrive objects` lists them")),
    }
}
