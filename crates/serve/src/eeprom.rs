//! EEPROM images on disk, one file a drive: at any moment the old contents or the new ones, never a mixture.
//!
//! A file is written beside its place, brought to the disk, and renamed over it. It begins with a line that names the
//! model, and a checksum guards its bytes: a file that is not what was written is reported, never used. The directory
//! itself is locked, so that no file can be removed to get around the lock, and it is looked at before each use: in a
//! directory that has taken its place nothing is written.

use std::fs::{self, File, Metadata};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use words::failure::Failure;

use super::files::{create_new, identity, read_bounded};

const MAGIC: &str = "ferrodrive eeprom 1";

/// Longest file that is read: many times an image.
const MAX_LENGTH: u64 = 64 * 1024;

/// The directory of `--state`, locked against a second simulator.
#[derive(Debug)]
pub struct Eeproms {
    directory: PathBuf,
    lock: File,
}

/// Why images cannot be kept or used.
#[derive(Debug)]
pub enum EepromError {
    /// The directory cannot be made or locked.
    Directory(PathBuf, io::Error),
    /// Another simulator has the directory.
    InUse(PathBuf),
    /// The directory was removed, or another has its name.
    Replaced(PathBuf),
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
            Self::Replaced(path) => write!(f, "the state directory {} was removed or exchanged", path.display()),
            Self::File(path, error) => write!(f, "{}: {error}", path.display()),
            Self::Corrupt(path, reason) => write!(f, "the EEPROM file {} is corrupt: {reason}", path.display()),
        }
    }
}

impl From<EepromError> for Failure {
    fn from(error: EepromError) -> Self {
        let failure = Self::new(error.to_string());
        match error {
            EepromError::Corrupt(..) => failure.next("move the file away to start this drive factory-fresh"),
            EepromError::File(..) => {
                failure.next("put an EEPROM file of this program there, or none, and make sure that it can be written")
            }
            EepromError::InUse(_) => failure.next("end the other simulator, or give another --state directory"),
            EepromError::Directory(..) | EepromError::Replaced(_) => {
                failure.next("give --state a directory that this user can write, or a path where it can be made")
            }
        }
    }
}

impl Eeproms {
    /// Opens or makes the directory. A last symbolic link is not followed.
    pub fn open(directory: &Path) -> Result<Self, EepromError> {
        // Without the slashes at its end, behind which a link would be followed.
        let directory: PathBuf = directory.components().collect();
        let failed = |error| EepromError::Directory(directory.clone(), error);
        match fs::symlink_metadata(&directory) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => fs::create_dir_all(&directory).map_err(failed)?,
            Ok(metadata) if metadata.is_symlink() => {
                let reason = "it is a symbolic link, and those are not followed here; name the directory itself";
                return Err(failed(io::Error::new(io::ErrorKind::InvalidInput, reason)));
            }
            Ok(metadata) if !metadata.is_dir() => return Err(failed(io::ErrorKind::NotADirectory.into())),
            Ok(_) => {}
            Err(error) => return Err(failed(error)),
        }
        let lock = open_to_lock(&directory).map_err(failed)?;
        match lock.try_lock() {
            Ok(()) => {}
            Err(fs::TryLockError::WouldBlock) => return Err(EepromError::InUse(directory)),
            Err(fs::TryLockError::Error(error)) => return Err(failed(error)),
        }
        let eeproms = Self { directory, lock };
        eeproms.check_place()?;
        Ok(eeproms)
    }

    /// The image kept for a drive; `None` if there is none yet.
    pub fn load(&self, drive: &str, model: &str) -> Result<Option<Vec<u8>>, EepromError> {
        self.check_place()?;
        let path = self.path(drive);
        match read_bounded(&path, MAX_LENGTH) {
            Ok(bytes) => bytes.map(|bytes| unwrap(&bytes, model)).transpose(),
            Err(error) => return Err(EepromError::File(path, error)),
        }
        .map_err(|reason| EepromError::Corrupt(path, reason))
    }

    /// Keeps an image for a drive; returns when it is on the disk.
    pub fn store(&self, drive: &str, model: &str, image: &[u8]) -> Result<(), EepromError> {
        self.check_place()?;
        let path = self.path(drive);
        let temporary = self.directory.join(format!("{drive}.new"));
        let failed = |error| EepromError::File(path.clone(), error);
        let mut file = fresh(&temporary).map_err(|error| EepromError::File(temporary.clone(), error))?;
        let written = file
            .write_all(&wrap(image, model))
            .and_then(|()| file.sync_all())
            .and_then(|()| fs::rename(&temporary, &path))
            .and_then(|()| File::open(&self.directory)?.sync_all());
        written.map_err(|error| {
            // What is left of a failed attempt holds no one's contents and may take the disk's last blocks.
            let _ = fs::remove_file(&temporary);
            failed(error)
        })
    }

    fn path(&self, drive: &str) -> PathBuf {
        self.directory.join(format!("{drive}.eeprom"))
    }

    /// That the directory's name still names the directory that is locked.
    fn check_place(&self) -> Result<(), EepromError> {
        let named = fs::symlink_metadata(&self.directory).ok().filter(Metadata::is_dir);
        let locked = self.lock.metadata().ok();
        if named.is_some_and(|named| identity(&named) == locked.as_ref().and_then(identity)) {
            Ok(())
        } else {
            Err(EepromError::Replaced(self.directory.clone()))
        }
    }
}

/// The directory itself, where that can be locked.
#[cfg(unix)]
fn open_to_lock(directory: &Path) -> io::Result<File> {
    File::open(directory)
}

/// A file in the directory.
#[cfg(not(unix))]
fn open_to_lock(directory: &Path) -> io::Result<File> {
    File::create(directory.join("lock"))
}

/// A new file at `path`, where nothing may be but what an attempt that was cut short has left there.
fn fresh(path: &Path) -> io::Result<File> {
    match create_new(path) {
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
        created => return created,
    }
    let left = read_bounded(path, MAX_LENGTH)?.unwrap_or_default();
    let common = left.len().min(MAGIC.len());
    if left[..common] != MAGIC.as_bytes()[..common] {
        return Err(io::Error::new(io::ErrorKind::AlreadyExists, "it exists and is not an EEPROM file; move it away"));
    }
    fs::remove_file(path)?;
    create_new(path)
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

    #[test]
    fn crc_matches_the_published_check_value() {
        assert_eq!(crc32(b"123456789"), 0xCBF4_3926);
    }

    #[test]
    fn what_was_stored_is_loaded() {
        let scratch = tempfile::tempdir().unwrap();
        let path = scratch.path();
        let eeproms = Eeproms::open(path).unwrap();
        assert_eq!(eeproms.load("zlac8030l@4", "zlac8030l").unwrap(), None);
        eeproms.store("zlac8030l@4", "zlac8030l", b"one").unwrap();
        eeproms.store("zlac8030l@4", "zlac8030l", b"two").unwrap();
        assert_eq!(eeproms.load("zlac8030l@4", "zlac8030l").unwrap().unwrap(), b"two");
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

    #[cfg(unix)]
    #[test]
    fn two_simulators_cannot_share_a_directory_whatever_is_removed_from_it() {
        let scratch = tempfile::tempdir().unwrap();
        let path = scratch.path();
        let first = Eeproms::open(path).unwrap();
        first.store("a@1", "a", b"one").unwrap();
        assert!(matches!(Eeproms::open(path), Err(EepromError::InUse(_))));
        for entry in fs::read_dir(path).unwrap() {
            fs::remove_file(entry.unwrap().path()).unwrap();
        }
        assert!(matches!(Eeproms::open(path), Err(EepromError::InUse(_))));
        // With the directory itself gone a second one is free to begin, and the first writes there no more.
        fs::remove_dir(path).unwrap();
        let second = Eeproms::open(path).unwrap();
        assert!(matches!(first.store("a@1", "a", b"two"), Err(EepromError::Replaced(_))));
        assert_eq!(second.load("a@1", "a").unwrap(), None);
    }

    #[cfg(unix)]
    #[test]
    fn links_and_files_of_others_are_left_alone() {
        use std::os::unix::fs::symlink;
        let scratch = tempfile::tempdir().unwrap();
        let path = scratch.path();
        let (state, link) = (path.join("state"), path.join("link"));
        fs::create_dir(&state).unwrap();
        symlink(&state, &link).unwrap();
        for name in [link.clone(), link.join("")] {
            assert!(matches!(Eeproms::open(&name), Err(EepromError::Directory(..))), "{}", name.display());
        }
        let eeproms = Eeproms::open(&state).unwrap();
        let victim = path.join("victim");
        fs::write(&victim, "precious").unwrap();
        symlink(&victim, state.join("a@1.new")).unwrap();
        assert!(matches!(eeproms.store("a@1", "a", b"new"), Err(EepromError::File(..))));
        symlink(&victim, state.join("b@1.eeprom")).unwrap();
        assert!(matches!(eeproms.load("b@1", "b"), Err(EepromError::File(..))));
        fs::write(state.join("c@1.new"), "precious").unwrap();
        assert!(matches!(eeproms.store("c@1", "c", b"new"), Err(EepromError::File(..))));
        assert_eq!(fs::read(state.join("c@1.new")).unwrap(), b"precious");
        assert_eq!(fs::read(&victim).unwrap(), b"precious");
    }

    #[test]
    fn what_a_kill_has_left_of_a_new_file_is_in_nobodys_way() {
        let scratch = tempfile::tempdir().unwrap();
        let path = scratch.path();
        let eeproms = Eeproms::open(path).unwrap();
        let whole = wrap(b"image", "a");
        for length in [0, 5, MAGIC.len(), whole.len() - 1, whole.len()] {
            fs::write(path.join("a@1.new"), &whole[..length]).unwrap();
            eeproms.store("a@1", "a", b"new").unwrap();
        }
    }

    #[test]
    fn a_file_that_is_far_too_long_is_not_read() {
        let scratch = tempfile::tempdir().unwrap();
        let path = scratch.path();
        let eeproms = Eeproms::open(path).unwrap();
        // 3 GB that take no room.
        File::create(path.join("a@1.eeprom")).and_then(|file| file.set_len(3 << 30)).unwrap();
        let refused = eeproms.load("a@1", "a").unwrap_err().to_string();
        assert!(refused.contains("a@1.eeprom") && refused.contains("longer than 65536 bytes"), "{refused}");
    }

    #[test]
    fn a_directory_that_cannot_be_written_keeps_the_old_image() {
        let scratch = tempfile::tempdir().unwrap();
        let path = scratch.path();
        let eeproms = Eeproms::open(path).unwrap();
        eeproms.store("a@1", "a", b"old").unwrap();
        // A directory in the place of the new file makes writing fail as a full disk does.
        fs::create_dir(path.join("a@1.new")).unwrap();
        assert!(matches!(eeproms.store("a@1", "a", b"new"), Err(EepromError::File(..))));
        assert_eq!(eeproms.load("a@1", "a").unwrap().unwrap(), b"old");
    }
}
