//! `--log FILE`: which file, and in which form.

use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use canlog::{Format, Interface, LogWriter};
use transport::BusSpec;

use crate::failure::Failure;
use crate::output::file_path;
use serve::files::create_log;
use serve::writing::{NewLog, ROOM};

/// A log that is to be written.
#[derive(Clone, Debug)]
pub(crate) struct LogPath {
    path: PathBuf,
    format: Format,
    /// What the log of a command has not got, once that is known; the copies are of one log.
    missing: Arc<OnceLock<String>>,
}

/// Reads the name of a log to be written: its extension selects the format, candump where it has none.
pub(crate) fn log_path(text: &str) -> Result<LogPath, String> {
    let path = file_path(text)?;
    let format = match (Format::of_name(&path), path.extension()) {
        // Many a text is called so, and what reads it back would not know it for a log.
        (Some(format), extension) if extension.is_none_or(|extension| !extension.eq_ignore_ascii_case("txt")) => format,
        (None, None) => Format::Candump,
        (_, extension) => {
            let extension = extension.unwrap_or_default();
            let extension = extension.to_string_lossy();
            return Err(format!(
                ".{extension} is not a log format; a log is written as {}",
                Format::written_extensions()
            ));
        }
    };
    if !format.is_written() {
        return Err(format!("a {format} file is only read; a log is written as {}", Format::written_extensions()));
    }
    Ok(LogPath { path, format, missing: Arc::default() })
}

impl LogPath {
    /// Where it is.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// In which form it is written.
    pub(crate) const fn format(&self) -> Format {
        self.format
    }

    /// Puts down why it is not complete.
    pub(crate) fn lacks(&self, torn: words::failure::Failure) {
        // The first is what went wrong.
        let _ = self.missing.set(torn.because.join("; "));
    }

    /// Why the log is not what was asked for, if it is not.
    pub(crate) fn failure(&self) -> Option<Failure> {
        let missing = self.missing.get()?;
        let failure = Failure::new(format!("the log {} is not complete", self.path.display())).of_kind("file");
        Some(failure.because(missing).next(ROOM))
    }

    /// Begins the file: a new one, or one that is empty or a log of the same form already.
    pub(crate) fn create(&self) -> Result<NewLog, Failure> {
        let file =
            create_log(&self.path, self.format).map_err(|error| Failure::of_writing("the log", &self.path, &error))?;
        let cannot = |error: &dyn std::fmt::Display| {
            let failure = Failure::new(format!("cannot write the log {}", self.path.display())).of_kind("file");
            failure.because(error).next(ROOM)
        };
        LogWriter::new(std::io::BufWriter::new(file), self.format).map_err(|error| cannot(&error))
    }
}

/// What a bus is called in a log.
pub(crate) fn interface_of(bus: &BusSpec) -> Interface {
    match bus {
        BusSpec::SocketCan { interface } => Interface::named(interface),
        BusSpec::Socketcand { bus, .. } => Interface::named(bus),
        _ => Interface::default(),
    }
}
