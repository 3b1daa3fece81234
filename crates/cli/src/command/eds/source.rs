//! Where a data sheet comes from: a file, or a model's description.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use eds::document::{Bounds, Document};
use eds::{Eds, Reading, Refusal, Sheet};

use crate::failure::Failure;
use crate::models::resolve;

/// Reads a file, no more of it than an EDS may have.
pub(crate) fn document(path: &Path) -> Result<Document, Failure> {
    let cannot = |error: std::io::Error| Failure::new(format!("cannot read {}", path.display())).because(error);
    let mut bytes = Vec::new();
    let most = Bounds::DEFAULT.bytes as u64 + 1;
    File::open(path).map_err(cannot)?.take(most).read_to_end(&mut bytes).map_err(cannot)?;
    Document::parse(&bytes).map_err(|refusal| refused(path, &refusal))
}

/// Reads a data sheet.
pub(crate) fn reading(path: &Path) -> Result<Reading, Failure> {
    Eds::read(&document(path)?).map_err(|refusal| refused(path, &refusal))
}

/// A data sheet from a file, or that of a model where no file has this name.
pub(super) fn sheet(name: &str) -> Result<Eds, Failure> {
    let path = Path::new(name);
    if path.exists() {
        return reading(path).map(|reading| reading.eds);
    }
    match resolve(name) {
        Ok(model) => Ok(Sheet::of(model).eds()),
        Err(unknown) if path.extension().is_none() => {
            Err(Failure::usage(format!("there is no file {name}")).because(unknown))
        }
        Err(_) => reading(path).map(|reading| reading.eds),
    }
}

fn refused(path: &Path, refusal: &Refusal) -> Failure {
    let at = if refusal.line > 0 { format!(", line {}", refusal.line) } else { String::new() };
    Failure::new(format!("{}{at} is not read as an EDS", path.display()))
        .of_kind("not_an_eds")
        .because(&refusal.reason)
        .next(&refusal.next)
}
