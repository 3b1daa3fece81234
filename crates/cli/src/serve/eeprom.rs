//! EEPROM images on disk, one file a drive: at any moment the old contents or the new ones, never a mixture.
//!
//! A file is written beside its place, brought to the disk, and renamed over it. It begins with a line that names the
//! model, and a checksum guards its bytes: a file that is not what was written is reported, never used.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

const MAGIC: &str = "ferrodrive eeprom 1";

/// The directory of `--state`, locked against a second simulator.
#[derive(Debug)]
pub(crate) struct Eeproms {
    directory: PathBuf,
    _lock: File,
}

/// Why images cannot be kept or used.
#[derive(Debug)]
pub(crate) enum EepromError {
    /// The directory cannot be made or locked.
    Directory(PathBuf, io::Error),
    /// Another simulator has the directory.
    InUse(PathBuf),
    /// A file cannot be read or written.
    File(PathBuf, io::Error),
    /// A file is not what was written.
    Corrupt(PathBuf, &'static str),
}

impl std::fmt::Display for EepromError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Directory(path, error) => write!(f, "cannot use the state directory {}: {error}", path.display()),
            Self::InUse(path) => write!(f, "the state directory {} is in use by another simulator", path.display()),
            Self::File(path, error) => write!(f, "{}: {error}", path.display()),
            Self::Corrupt(path, reason) => write!(f, "the EEPROM file {} is corrupt: {reason}", path.display()),
        }
    }
}

impl Eeproms {
    /// Opens or makes the directory.
    pub(crate) fn open(directory: &Path) -> Result<Self, EepromError> {
        let failed = |error| EepromError::Directory(directory.into(), error);
        fs::create_dir_all(directory).map_err(failed)?;
        let lock = File::create(directory.join("lock")).map_err(failed)?;
        match lock.try_lock() {
            Ok(()) => Ok(Self { directory: directory.into(), _lock: lock }),
            Err(fs::TryLockError::WouldBlock) => Err(EepromError::InUse(directory.into())),
            Err(fs::TryLockError::Error(error)) => Err(failed(error)),
        }
    }

    /// The image kept for a drive; `None` if there is none yet.
    pub(crate) fn load(&self, drive: &str, model: &str) -> Result<Option<Vec<u8>>, EepromError> {
        let path = self.path(drive);
        match fs::read(&path) {
            Ok(bytes) => unwrap(&bytes, model).map(Some).map_err(|reason| EepromError::Corrupt(path, reason)),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(EepromError::File(path, error)),
        }
    }

    /// Keeps an image for a drive; returns when it is on the disk.
    pub(crate) fn store(&self, drive: &str, model: &str, image: &[u8]) -> Result<(), EepromError> {
        let path = self.path(drive);
        let temporary = self.directory.join(format!("{drive}.new"));
        let written = write_synced(&temporary, &wrap(image, model))
            .and_then(|()| fs::rename(&temporary, &path))
            .and_then(|()| File::open(&self.directory)?.sync_all());
        written.map_err(|error| {
            // What is left of a failed attempt holds no one's contents and may take the disk's last blocks.
            let _ = fs::remove_file(&temporary);
            EepromError::File(path, error)
        })
    }

    fn path(&self, drive: &str) -> PathBuf {
        self.directory.join(format!("{drive}.eeprom"))
    }
}

fn write_synced(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut file = File::create(path)?;
    file.write_all(bytes)?;
    file.sync_all()
}

/// Heading line, CRC-32 of the image, image.
fn wrap(image: &[u8], model: &str) -> Vec<u8> {
    let mut bytes = format!("{MAGIC} {model} {}\n", image.len()).into_bytes();
    bytes.extend_from_slice(&crc32(image).to_le_bytes());
    bytes.extend_from_slice(image);
    bytes
}

fn unwrap(bytes: &[u8], model: &str) -> Result<Vec<u8>, &'static str> {
    let end = bytes.iter().position(|byte| *byte == b'\n').ok_or("it has no heading line")?;
    let (heading, rest) = (&bytes[..end], &bytes[end + 1..]);
    let heading = std::str::from_utf8(heading).ok().and_then(|line| line.strip_prefix(MAGIC));
    let heading = heading.ok_or("its heading is not one of an EEPROM file of this version")?;
    let (written_by, length) = heading.trim().split_once(' ').ok_or("its heading is incomplete")?;
    if written_by != model {
        return Err("it belongs to a drive of another model");
    }
    let (checksum, image) = rest.split_first_chunk::<4>().ok_or("it is cut off")?;
    if length.parse() != Ok(image.len()) {
        return Err("its length is not the one written");
    }
    if u32::from_le_bytes(*checksum) != crc32(image) {
        return Err("its checksum does not match its contents");
    }
    Ok(image.to_vec())
}

/// CRC-32 as in IEEE 802.3 (reflected, polynomial EDB88320h).
fn crc32(bytes: &[u8]) -> u32 {
    let update = |crc: u32, byte: &u8| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| if crc & 1 == 1 { crc >> 1 ^ 0xEDB8_8320 } else { crc >> 1 })
    };
    !bytes.iter().fold(u32::MAX, update)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scratch(name: &str) -> PathBuf {
        let path = std::env::temp_dir().join(format!("ferrodrive-eeprom-{}-{name}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        path
    }

    #[test]
    fn crc_matches_the_published_check_value() {
        assert_eq!(crc32(b"123456789"), 0xCBF4_3926);
    }

    #[test]
    fn what_was_stored_is_loaded() {
        let path = scratch("stored");
        let eeproms = Eeproms::open(&path).unwrap();
        assert_eq!(eeproms.load("zlac8030l@4", "zlac8030l").unwrap(), None);
        eeproms.store("zlac8030l@4", "zlac8030l", b"one").unwrap();
        eeproms.store("zlac8030l@4", "zlac8030l", b"two").unwrap();
        assert_eq!(eeproms.load("zlac8030l@4", "zlac8030l").unwrap().unwrap(), b"two");
        fs::remove_dir_all(path).unwrap();
    }

    #[test]
    fn every_single_damaged_byte_is_noticed() {
        let sound = wrap(b"image", "zlac8030l");
        assert_eq!(unwrap(&sound, "zlac8030l").unwrap(), b"image");
        for at in 0..sound.len() {
            let mut damaged = sound.clone();
            damaged[at] ^= 0x10;
            assert!(unwrap(&damaged, "zlac8030l").is_err(), "byte {at}");
            assert!(unwrap(&sound[..at], "zlac8030l").is_err(), "cut at {at}");
        }
        assert!(unwrap(&sound, "zlim42c").is_err());
    }

    #[test]
    fn two_simulators_cannot_share_a_directory() {
        let path = scratch("shared");
        let _first = Eeproms::open(&path).unwrap();
        assert!(matches!(Eeproms::open(&path), Err(EepromError::InUse(_))));
        fs::remove_dir_all(path).unwrap();
    }

    #[test]
    fn a_directory_that_cannot_be_written_keeps_the_old_image() {
        let path = scratch("full");
        let eeproms = Eeproms::open(&path).unwrap();
        eeproms.store("a@1", "a", b"old").unwrap();
        // A directory in the place of the new file makes writing fail as a full disk does.
        fs::create_dir(path.join("a@1.new")).unwrap();
        assert!(matches!(eeproms.store("a@1", "a", b"new"), Err(EepromError::File(..))));
        assert_eq!(eeproms.load("a@1", "a").unwrap().unwrap(), b"old");
        fs::remove_dir_all(path).unwrap();
    }
}
