//! Files that are named as input, read with a bound ([`read_bytes`], [`read_text`]), and those of them that people write in TOML, read
//! with an eye on what they got wrong: [`reader`] takes values out of a text, each with its place, and [`BadFile`] shows every
//! [`Problem`] of it at once, with the line and a mark below.

mod problem;
pub mod reader;

pub use problem::{BadFile, Located, Problem};

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

/// Largest text that is read, in bytes. A bus has 127 drives, and a drive some lines.
pub const LARGEST: u64 = 1 << 20;

thread_local! {
    static GIVEN: RefCell<BTreeMap<PathBuf, Vec<u8>>> = const { RefCell::new(BTreeMap::new()) };
}

/// Hands in the content of a file by its name, for this thread: a module in a browser has no disk to read from.
pub fn give(path: &Path, content: Vec<u8>) {
    GIVEN.with_borrow_mut(|given| given.insert(path.to_owned(), content));
}

/// The content of a file of at most `largest` bytes. A pipe or a device, which may never begin or end, and a folder are refused.
///
/// # Errors
/// Why it cannot be read, in a sentence.
pub fn read_bytes(path: &Path, largest: u64) -> Result<Vec<u8>, String> {
    let too_large = || format!("larger than the limit of {} MB", largest >> 20);
    if let Some(given) = GIVEN.with_borrow(|given| given.get(path).cloned()) {
        return if given.len() as u64 > largest { Err(too_large()) } else { Ok(given) };
    }
    // Before it is opened: opening a pipe waits for a program that writes to it.
    let kind = std::fs::metadata(path).map_err(|error| error.to_string())?;
    if !kind.is_file() {
        return Err("not a regular file".into());
    }
    if kind.len() > largest {
        return Err(too_large());
    }
    let mut bytes = Vec::new();
    let file = File::open(path).map_err(|error| error.to_string())?;
    // It may grow meanwhile.
    file.take(largest + 1).read_to_end(&mut bytes).map_err(|error| error.to_string())?;
    if bytes.len() as u64 > largest { Err(too_large()) } else { Ok(bytes) }
}

/// The text of a file of at most [`LARGEST`] bytes.
///
/// # Errors
/// As [`read_bytes`], or that it is not text.
pub fn read_text(path: &Path) -> Result<String, String> {
    let bytes = read_bytes(path, LARGEST)?;
    let mut text = String::from_utf8(bytes).map_err(|_| "not text in UTF-8".to_owned())?;
    // A byte order mark of an editor is not a part of the text.
    if text.starts_with('\u{feff}') {
        text.remove(0);
    }
    Ok(text)
}
