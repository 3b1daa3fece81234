//! Virtual drives for other programs: a served world, its messages and files, EEPROM images on disk.

pub(crate) mod control;
pub(crate) mod eeprom;
pub(crate) mod files;
mod input;
mod kept;
mod lag;
pub(crate) mod messages;
pub(crate) mod pacer;
mod registers;
mod round_robin;
pub(crate) mod service;
pub(crate) mod store_writer;
mod stores;
pub(crate) mod world;

/// An empty directory of a test's own.
#[cfg(test)]
pub(crate) fn scratch(name: &str) -> std::path::PathBuf {
    let path = std::env::temp_dir().join(format!("ferrodrive-serve-{}-{name}", std::process::id()));
    let _ = std::fs::remove_dir_all(&path);
    std::fs::create_dir_all(&path).expect("the temporary directory can be written");
    path
}
