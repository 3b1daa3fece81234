//! What is in the archive of an FMU (FMI 3.0, 2.5; FMI 2.0.5, 2.3).

use std::path::Path;

use crate::config::{self, Config, ConfigError, DriveConfig};
use crate::unit::Unit;
use crate::xml;

/// One file of the archive: its path there, and its content.
pub type Entry = (String, Vec<u8>);

/// The folder of the binaries for the machine that this is built for, and the ending of a library; `None` where FMI 3.0 has no
/// name for it.
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

/// The same by FMI 2.0, which names three; for others the names of 3.0 are in use.
pub const fn platform_of_fmi2() -> Option<(&'static str, &'static str)> {
    match platform() {
        Some((_, ending)) if cfg!(target_arch = "x86_64") => Some((
            if cfg!(windows) {
                "win64"
            } else if cfg!(target_os = "macos") {
                "darwin64"
            } else {
                "linux64"
            },
            ending,
        )),
        other => other,
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
        (format!("resources/{}", config::FILE), config.text().into_bytes()),
        (format!("binaries/{path}"), bytes),
    ];
    if !matches!(config, Config::Axis(_)) {
        let terminals = xml::terminals_and_icons(&unit).into_bytes();
        entries.push(("terminalsAndIcons/terminalsAndIcons.xml".to_owned(), terminals));
        let manifest = xml::manifest(config).into_bytes();
        entries.push(("extra/org.fmi-standard.fmi-ls-bus/fmi-ls-manifest.xml".to_owned(), manifest));
    }
    if let Some(name) = config.drive().and_then(DriveConfig::file) {
        let content = std::fs::read(resources.join(name))
            .map_err(|error| ConfigError::Drive(format!("cannot read {name}: {error}")))?;
        entries.push((format!("resources/{name}"), content));
    }
    Ok(entries)
}
