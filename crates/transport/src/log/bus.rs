//! A log as a bus that only tells.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use can::{Frame, Instant};

use super::reader::{LogError, LogReader};
use crate::{AsyncBus, BusError, Note, Received, TornRecord};

/// A candump log replayed as fast as it is read, each frame with its logged time; read only.
///
/// Lines are read with blocking calls: a file does not keep a reader waiting as a socket does.
#[derive(Debug)]
pub struct LogBus {
    path: PathBuf,
    reader: LogReader<BufReader<File>>,
}

impl LogBus {
    /// Opens the log `path`.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, BusError> {
        let path = path.as_ref().to_owned();
        match File::open(&path) {
            Ok(file) => Ok(Self { reader: LogReader::new(BufReader::new(file)), path }),
            Err(source) => Err(BusError::OpenLog { path, source }),
        }
    }
}

impl AsyncBus for LogBus {
    /// Always [`BusError::ReadOnly`].
    async fn send(&mut self, _frame: &Frame) -> Result<(), BusError> {
        Err(BusError::ReadOnly { path: self.path.clone() })
    }

    /// [`BusError::EndOfLog`] behind the last frame. A line that is no frame is a note, at the time of the frame before.
    async fn recv(&mut self) -> Result<(Instant, Received), BusError> {
        match self.reader.next_frame() {
            Ok(Some((at, frame))) => Ok((at, frame.into())),
            Ok(None) => Err(BusError::EndOfLog { path: self.path.clone() }),
            Err(LogError::Line { line, text, source }) => {
                let torn = TornRecord { place: line, text, reason: source.to_string() };
                Ok((self.reader.last_time(), Note::TornRecord(torn).into()))
            }
            Err(source) => Err(BusError::Log { path: self.path.clone(), source }),
        }
    }
}
