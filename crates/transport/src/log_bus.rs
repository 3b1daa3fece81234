//! A log as a bus that is only read.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};

use can::{Frame, Instant};
use canlog::{AnyLogReader, Content, Entry};

use crate::{AsyncBus, BusError, Note, Received};

/// A log replayed as fast as it is read, each frame with its logged time; read only.
///
/// It is read with blocking calls: a file does not keep a reader waiting as a socket does.
#[derive(Debug)]
pub struct LogBus {
    path: PathBuf,
    reader: AnyLogReader,
    /// What the record that was read last says and has not been given.
    more: VecDeque<Received>,
}

impl LogBus {
    /// Opens the log `path`, of any form that is known; `-` is standard input.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, BusError> {
        let path = path.as_ref().to_owned();
        match AnyLogReader::open(&path) {
            Ok(reader) => Ok(Self { reader, path, more: VecDeque::new() }),
            Err(source) => Err(BusError::OpenLog { path, source }),
        }
    }
}

impl AsyncBus for LogBus {
    /// Always [`BusError::ReadOnly`].
    async fn send(&mut self, _frame: &Frame) -> Result<(), BusError> {
        Err(BusError::ReadOnly { path: self.path.clone() })
    }

    /// [`BusError::EndOfLog`] behind the last frame. What is not a frame is a note; what is torn, at the time of the frame before.
    async fn recv(&mut self) -> Result<(Instant, Received), BusError> {
        loop {
            if let Some(received) = self.more.pop_front() {
                return Ok((self.reader.last_time(), received));
            }
            match self.reader.next_entry() {
                Ok(Some(Entry::Record(record))) => self.more.extend(received(record.content)),
                Ok(Some(Entry::Finding(finding))) => self.more.push_back(Note::TornRecord(finding).into()),
                Ok(None) => return Err(BusError::EndOfLog { path: self.path.clone() }),
                Err(source) => return Err(BusError::Log { path: self.path.clone(), source }),
            }
        }
    }
}

/// What a bus would have given at that moment: mostly one thing, of an error frame all that it says.
fn received(content: Content) -> impl Iterator<Item = Received> {
    let (one, error) = match content {
        Content::Frame(frame) => (Some(frame.into()), None),
        Content::FdFrame { id, length } => (Some(Note::FdFrame { id, length }.into()), None),
        Content::Error(error) => (None, Some(error)),
    };
    one.into_iter().chain(error.into_iter().flat_map(Note::of_error).map(Received::from))
}
