//! What the command line and the Python package do with a network, and the results: the same rows for both, as `docs/json.md` has
//! them.
//!
//! In: a network of crate `master`, which the caller runs. Out: reports that serialise, or a [`Failure`]. How a person reads them is the
//! command line's.

pub mod boot;
pub mod check;
pub mod explain;
pub mod faults;
pub mod heard;
pub mod init;
pub mod params;
pub mod pdos;
pub mod plan;
pub mod program;
pub mod report;
pub mod scan;
pub mod supervise;

use std::io::ErrorKind;
use std::path::Path;

use machine::file::{self, Machine};
use words::failure::Failure;

/// Reads a machine file.
///
/// # Errors
/// Everything that is wrong with it.
pub fn read_machine(path: &Path) -> Result<Machine, Failure> {
    file::read(path).map_err(|reason| unusable(path, reason))
}

/// That a machine file makes no sense.
pub fn unusable(path: &Path, reason: String) -> Failure {
    // A pipe would be waited for.
    let unopened = path.is_file().then(|| std::fs::File::open(path).err()).flatten();
    let next = remedy(unopened.map(|error| error.kind()), &reason);
    Failure::bad_file(format!("cannot use the machine file {}", path.display())).because(reason).next(next)
}

/// What to do about a machine file, by why it could not be opened.
fn remedy(unopened: Option<ErrorKind>, reason: &str) -> String {
    match unopened {
        Some(ErrorKind::PermissionDenied) => "give this account the right to read it".to_owned(),
        _ => file::example(reason),
    }
}

/// Who is kept informed while something takes its time.
pub trait Progress {
    /// What is being waited for.
    fn show(&self, text: String);
    /// How far something is that may take long.
    fn count(&self, text: String);
    /// What a person has to do now.
    fn note(&self, text: &str);
}

/// Shows nothing.
impl Progress for () {
    fn show(&self, _: String) {}
    fn count(&self, _: String) {}
    fn note(&self, _: &str) {}
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_may_not_read_a_machine_file_is_not_shown_how_to_write_one() {
        assert_eq!(remedy(Some(ErrorKind::PermissionDenied), ""), "give this account the right to read it");
        assert!(remedy(None, "").contains("[[drive]]") && remedy(Some(ErrorKind::NotFound), "").contains("[[drive]]"));
    }
}
