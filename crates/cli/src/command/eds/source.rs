//! Where a data sheet comes from: a file.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use eds::document::Bounds;
use eds::{Eds, Reading};

use crate::failure::Failure;

/// Reads a file, no more of it than an EDS may have.
pub(super) fn bytes(path: &Path) -> Result<Vec<u8>, Failure> {
    let cannot = |error: std::io::Error| Failure::new(format!("cannot read {}", path.display())).because(error);
    let mut bytes = Vec::new();
    let most = Bounds::DEFAULT.bytes as u64 + 1;
    File::open(path).map_err(cannot)?.take(most).read_to_end(&mut bytes).map_err(cannot)?;
    Ok(bytes)
}

/// Reads a data sheet.
pub(super) fn reading(path: &Path) -> Result<Reading, Failure> {
    Eds::load(&bytes(path)?).map_err(|refusal| {
        let at = if refusal.line > 0 { format!(", line {}", refusal.line) } else { String::new() };
        Failure::new(format!("{}{at} is not read as an EDS", path.display()))
            .of_kind("not_an_eds")
            .because(&refusal.reason)
            .next(&refusal.next)
    })
}
