//! Where what is recorded goes: a file, viewers while it happens, or both.

use std::time::Duration;

use foxglove::Server;
use recording::Batch;
use words::failure::Failure;

use super::record_file::RecordFile;

/// A file, viewers, or both: each gets the same batches.
#[derive(Default)]
pub struct RecordOutput {
    /// The file, if one is asked for.
    pub file: Option<RecordFile>,
    /// The server for viewers, if one is asked for.
    pub viewers: Option<Server>,
}

impl RecordOutput {
    /// Takes a batch. Viewers are never waited for; the file as [`RecordFile::write`] says.
    pub fn write(&mut self, batch: Batch) {
        match (&self.viewers, &mut self.file) {
            (Some(viewers), Some(file)) => {
                if viewers.is_watched() {
                    viewers.show(batch.clone());
                }
                file.write(batch);
            }
            (Some(viewers), None) => viewers.show(batch),
            (None, Some(file)) => file.write(batch),
            (None, None) => {}
        }
    }

    /// Waits until everything is written, at most for `patience`, and until viewers that read have what they were sent.
    ///
    /// # Errors
    /// The file is not whole.
    pub fn finish(self, patience: Duration) -> Result<(), Failure> {
        drop(self.viewers);
        self.file.map_or(Ok(()), |file| file.finish(patience))
    }
}
