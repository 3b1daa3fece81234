//! Where a data sheet comes from: a file, or a model's description.

use std::path::Path;

use eds::document::Document;
use eds::{Eds, Reading, Sheet};

use crate::failure::Failure;
use testbench::data_sheet::{self, Unread};
use testbench::models::resolve;

/// Reads a file as it stands.
pub(crate) fn document(path: &Path) -> Result<Document, Failure> {
    data_sheet::document(path).map_err(|unread| unreadable(path, &unread))
}

/// Reads a data sheet.
pub(crate) fn reading(path: &Path) -> Result<Reading, Failure> {
    data_sheet::reading(path).map_err(|unread| unreadable(path, &unread))
}

/// A data sheet from a file, or that of a model where no file has this name.
pub(super) fn sheet(name: &str) -> Result<Eds, Failure> {
    let path = Path::new(name);
    // The point of `zlac8030l,firmware=2.01` is no file's.
    if path.exists() || (path.extension().is_some() && !name.contains(',')) {
        return reading(path).map(|reading| reading.eds);
    }
    match resolve(name) {
        Ok(model) => Ok(Sheet::of(model).eds()),
        Err(unknown) => Err(Failure::usage(format!("there is no file {name}"))
            .because(unknown)
            .next("give the path of an EDS or DCF file, or a model; `ferrodrive objects` lists them")),
    }
}

fn unreadable(path: &Path, unread: &Unread) -> Failure {
    match unread {
        Unread::File(error) => Failure::new(format!("cannot read {}", path.display()))
            .because(error)
            .next("is the name right, and may this user read the file?"),
        Unread::Refused(refusal) => {
            let at = if refusal.line > 0 { format!(", line {}", refusal.line) } else { String::new() };
            Failure::new(format!("{}{at} is not read as an EDS", path.display()))
                .of_kind("not_an_eds")
                .because(&refusal.reason)
                .next(&refusal.next)
        }
    }
}
