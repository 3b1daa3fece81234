//! Files that outlive this program: read with a bound, and never through what others have put in their place.
//!
//! A symbolic link, a device, a FIFO or a directory where a file of ours should be is refused, not followed, not opened.
//! What was looked at and what was opened are compared, so that a swap in between is noticed.

use std::fs::{self, File, Metadata, OpenOptions};
use std::io::{self, Read};
use std::path::Path;

use canlog::Format;
use recording::Kind;

/// What a path names, without following a last symbolic link.
///
/// # Errors
/// The system's, or that it is not a regular file, in words that fit after the path.
fn regular(path: &Path) -> io::Result<Metadata> {
    let metadata = fs::symlink_metadata(path)?;
    let kind = metadata.file_type();
    if kind.is_file() {
        return Ok(metadata);
    }
    let what = if kind.is_symlink() {
        "a symbolic link, and those are not followed here; name the file itself"
    } else if kind.is_dir() {
        "a directory"
    } else {
        "a device, a FIFO or a socket, not a regular file"
    };
    Err(io::Error::new(io::ErrorKind::InvalidInput, format!("it is {what}")))
}

/// `options` on a regular file that is there.
fn open_regular(path: &Path, options: &OpenOptions) -> io::Result<File> {
    let seen = regular(path)?;
    let file = options.open(path)?;
    if identity(&seen) != identity(&file.metadata()?) {
        return Err(io::Error::other("it was replaced while it was being opened"));
    }
    Ok(file)
}

/// The contents of a regular file of at most `limit` bytes; `None` if there is none.
pub fn read_bounded(path: &Path, limit: u64) -> io::Result<Option<Vec<u8>>> {
    let file = match open_regular(path, OpenOptions::new().read(true)) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        opened => opened?,
    };
    let mut bytes = Vec::new();
    file.take(limit + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > limit {
        return Err(io::Error::new(io::ErrorKind::InvalidData, format!("it is longer than {limit} bytes")));
    }
    Ok(Some(bytes))
}

/// A file that did not exist, to be written and read.
pub fn create_new(path: &Path) -> io::Result<File> {
    OpenOptions::new().read(true).write(true).create_new(true).open(path)
}

/// An empty file to write a log to: a new one, or one that is empty or begins as a log of that format does. Any other
/// file belongs to others, and is not changed.
pub fn create_log(path: &Path, format: Format) -> io::Result<File> {
    create_or_replace(path, format.written_begin().unwrap_or_default(), &format!("a log of the format {format}"))
}

/// An empty file to write a record to: a new one, or one that is empty or a record already.
pub fn create_record(path: &Path, kind: Kind) -> io::Result<File> {
    let (begin, what) = record_begin(kind);
    create_or_replace(path, begin, what)
}

/// Whether [`create_record`] would write to what is there at present: nothing in a folder, or a record that can be written. Nothing is
/// made, and nothing is changed.
///
/// # Errors
/// Those of [`create_record`], but for a folder in which no file can be made.
pub fn check_record(path: &Path, kind: Kind) -> io::Result<()> {
    let (begin, what) = record_begin(kind);
    match open_replaceable(path, begin, what) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
            match fs::metadata(folder)?.is_dir() {
                true => Ok(()),
                false => Err(io::ErrorKind::NotADirectory.into()),
            }
        }
        opened => opened.map(drop),
    }
}

/// How a record begins, and what it is called.
fn record_begin(kind: Kind) -> (&'static [u8], &'static str) {
    match kind {
        Kind::Mcap => (b"\x89MCAP0\r\n", "an MCAP file"),
        Kind::Csv => (b"t_s,", "a record"),
    }
}

/// An empty file to write a picture to: a new one, or one that is empty or begins as our pictures of its kind do.
pub fn create_picture(path: &Path, begin: &[u8]) -> io::Result<File> {
    create_or_replace(path, begin, "a picture of this program")
}

/// An empty file: a new one, or one that is empty or begins with `begin`, as `what` does.
fn create_or_replace(path: &Path, begin: &[u8], what: &str) -> io::Result<File> {
    match create_new(path) {
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
        created => return created,
    }
    let mut file = open_replaceable(path, begin, what)?;
    file.set_len(0)?;
    io::Seek::rewind(&mut file)?;
    Ok(file)
}

/// A file that is there, and is empty or begins with `begin`; its contents are as they were.
fn open_replaceable(path: &Path, begin: &[u8], what: &str) -> io::Result<File> {
    let mut file = open_regular(path, OpenOptions::new().read(true).write(true))?;
    let mut first = Vec::new();
    (&mut file).take(begin.len() as u64).read_to_end(&mut first)?;
    if !first.is_empty() && first != begin {
        let reason = format!("it exists and is not {what}; remove it or choose another name");
        return Err(io::Error::new(io::ErrorKind::AlreadyExists, reason));
    }
    Ok(file)
}

/// What distinguishes two files, where the system has it.
#[cfg(unix)]
pub fn identity(metadata: &Metadata) -> Option<(u64, u64)> {
    use std::os::unix::fs::MetadataExt;
    Some((metadata.dev(), metadata.ino()))
}

/// What distinguishes two files, where the system has it.
#[cfg(not(unix))]
pub fn identity(_: &Metadata) -> Option<(u64, u64)> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_log_replaces_a_log_and_nothing_else() {
        let scratch = tempfile::tempdir().unwrap();
        let place = scratch.path();
        let (log, letter) = (place.join("log"), place.join("letter"));
        drop(create_log(&log, Format::Candump).unwrap());
        fs::write(&log, "(1.0) can0 701#05\n").unwrap();
        drop(create_log(&log, Format::Candump).unwrap());
        assert_eq!(fs::read(&log).unwrap(), b"");
        fs::write(&letter, "Dear reader").unwrap();
        assert!(
            create_log(&letter, Format::Candump).unwrap_err().to_string().contains("not a log of the format candump")
        );
        assert_eq!(fs::read(&letter).unwrap(), b"Dear reader");
        assert!(create_log(place, Format::Candump).unwrap_err().to_string().contains("directory"));
    }

    #[test]
    fn a_record_replaces_a_record_of_its_kind_and_nothing_else() {
        let scratch = tempfile::tempdir().unwrap();
        let place = scratch.path();
        let (mcap, csv) = (place.join("a.mcap"), place.join("a.csv"));
        fs::write(&mcap, b"\x89MCAP0\r\nand more").unwrap();
        fs::write(&csv, "t_s,4.velocity_rpm,mark\n").unwrap();
        assert!(create_record(&csv, Kind::Mcap).unwrap_err().to_string().contains("not an MCAP file"));
        for (path, kind) in [(&mcap, Kind::Mcap), (&csv, Kind::Csv)] {
            let before = fs::read(path).unwrap();
            check_record(path, kind).unwrap();
            assert_eq!(fs::read(path).unwrap(), before);
            drop(create_record(path, kind).unwrap());
            assert_eq!(fs::read(path).unwrap(), b"");
        }
        fs::write(&csv, "name,price\n").unwrap();
        assert!(create_record(&csv, Kind::Csv).unwrap_err().to_string().contains("not a record"));
        assert!(check_record(&csv, Kind::Csv).unwrap_err().to_string().contains("not a record"));
        assert_eq!(fs::read(&csv).unwrap(), b"name,price\n");
        // A free name stays free; one in a file, or in a folder that is not there, is not one.
        let free = place.join("free.csv");
        check_record(&free, Kind::Csv).unwrap();
        assert!(!free.exists());
        assert!(check_record(&csv.join("in_a_file.csv"), Kind::Csv).is_err());
        assert_eq!(check_record(&place.join("no/a.csv"), Kind::Csv).unwrap_err().kind(), io::ErrorKind::NotFound);
    }

    #[cfg(unix)]
    #[test]
    fn a_symbolic_link_is_neither_read_nor_written() {
        let scratch = tempfile::tempdir().unwrap();
        let place = scratch.path();
        let (target, link) = (place.join("target"), place.join("link"));
        fs::write(&target, "(mine").unwrap();
        std::os::unix::fs::symlink(&target, &link).unwrap();
        assert!(create_log(&link, Format::Candump).unwrap_err().to_string().contains("symbolic link"));
        assert!(read_bounded(&link, 100).unwrap_err().to_string().contains("symbolic link"));
        assert_eq!(fs::read(&target).unwrap(), b"(mine");
        // One that leads nowhere is not a free name either.
        fs::remove_file(&target).unwrap();
        assert!(create_log(&link, Format::Candump).is_err() && create_new(&link).is_err() && !target.exists());
    }

    #[test]
    fn what_is_longer_than_its_bound_is_refused() {
        let scratch = tempfile::tempdir().unwrap();
        let place = scratch.path();
        let path = place.join("file");
        assert_eq!(read_bounded(&path, 4).unwrap(), None);
        fs::write(&path, "four").unwrap();
        assert_eq!(read_bounded(&path, 4).unwrap().unwrap(), b"four");
        assert!(read_bounded(&path, 3).unwrap_err().to_string().contains("longer than 3 bytes"));
    }
}
