//! What is in the archive of an FMU (FMI 3.0, 2.5).

use std::path::Path;

use crate::config::{self, Config, ConfigError};
use crate::unit::Unit;
use crate::xml;

/// One file of the archive: its path there, and its content.
pub type Entry = (String, Vec<u8>);

/// The folder of the binaries for the machine that this is built for, and the ending of a library; `None` where FMI has no name
/// for it.
pub const fn platform() -> Option<(&'static str, &'static str)> {
    if cfg!(all(target_os = "linux", target_arch = "x86_64")) {
        Some(("x86_64-linux", "so"))
    } else if cfg!(all(target_os = "linux", target_arch = "aarch64")) {
        Some(("aarch64-linux", "so"))
    } else if cfg!(all(target_os = "macos", target_arch = "aarch64")) {
        Some(("aarch64-darwin", "dylib"))
    } else if cfg!(all(target_os = "macos", target_arch = "x86_64")) {
        Some(("x86_64-darwin", "dylib"))
    } else if cfg!(all(target_os = "windows", target_arch = "x86_64")) {
        Some(("x86_64-windows", "dll"))
    } else {
        None
    }
}

/// The files of an FMU: descriptions, configuration, library, and the files in `resources` that the configuration names.
///
/// # Errors
/// That the configuration describes nothing that can be built.
pub fn entries(config: &Config, resources: &Path, library: (&str, Vec<u8>)) -> Result<Vec<Entry>, ConfigError> {
    let unit = Unit::new(config, resources)?;
    let (path, bytes) = library;
    let mut entries = vec![
        ("modelDescription.xml".to_owned(), xml::model_description(config, resources, &unit).into_bytes()),
        ("terminalsAndIcons/terminalsAndIcons.xml".to_owned(), xml::terminals_and_icons(&unit).into_bytes()),
        ("extra/org.fmi-standard.fmi-ls-bus/fmi-ls-manifest.xml".to_owned(), xml::manifest(config).into_bytes()),
        (format!("resources/{}", config::FILE), config.text().into_bytes()),
        (format!("binaries/{path}"), bytes),
    ];
    if let Config::Drive(drive) = config
        && let Some(name) = drive.file()
    {
        let content = std::fs::read(resources.join(name))
            .map_err(|error| ConfigError::Drive(format!("cannot read {name}: {error}")))?;
        entries.push((format!("resources/{name}"), content));
    }
    Ok(entries)
}
