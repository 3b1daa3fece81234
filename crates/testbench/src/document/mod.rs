//! Files that people write in TOML, read with an eye on what they got wrong: [`reader`] takes values out of a text, each with
//! its place, and [`BadFile`] shows every [`Problem`] of it at once, with the line and a mark below.

mod problem;
pub mod reader;

pub use problem::{BadFile, Located, Problem};

use std::fs::File;
use std::io::Read;
use std::path::Path;

/// Largest file that is read. A bus has 127 drives, and a drive some lines.
pub const LARGEST: u64 = 1 << 20;

/// The text of a file of sensible size. A pipe or a device, which may never end, is refused.
///
/// # Errors
/// Why it cannot be read, in a sentence.
pub fn read_text(path: &Path) -> Result<String, String> {
    let kind = std::fs::metadata(path).map_err(|error| error.to_string())?;
    if !kind.is_file() {
        return Err("not a regular file".into());
    }
    let mut text = String::new();
    let file = File::open(path).map_err(|error| error.to_string())?;
    let read = file.take(LARGEST + 1).read_to_string(&mut text).map_err(|_| "not text in UTF-8".to_owned())?;
    if read as u64 > LARGEST {
        return Err("larger than the limit of 1 MB".into());
    }
    // A byte order mark of an editor is not a part of the text.
    if text.starts_with('\u{feff}') {
        text.remove(0);
    }
    Ok(text)
}
