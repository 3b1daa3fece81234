//! Files that a thread of their own writes: a slow disk costs what is in the file, never time of the bus.

use std::io;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, channel, sync_channel};
use std::time::Duration;

use crate::failure::Failure;
use crate::serve::messages::Messages;

/// Whether time passes by the clock while a batch waits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Pace {
    /// The bus goes with the clock: what the disk has no time for is left out.
    RealTime,
    /// The bus waits for the disk: everything is written, and little waits.
    Free,
}

impl Pace {
    /// Batches that may wait for the disk: some 10 s of a bus that goes with the clock; where the bus waits too, one is written while
    /// the next is filled.
    pub(super) const fn room(self) -> usize {
        match self {
            Self::RealTime => 100,
            Self::Free => 2,
        }
    }
}

/// What the file is called in messages, and what it is made of.
#[derive(Clone, Copy)]
pub(super) struct Words {
    /// "the log".
    pub(super) file: &'static str,
    /// "frames".
    pub(super) pieces: &'static str,
}

/// See the [module](self).
pub(super) struct Background<B> {
    batches: SyncSender<B>,
    /// Says how it ended, when everything is written.
    written: Receiver<Result<(), String>>,
    words: Words,
    pace: Pace,
    missing: u64,
    /// Pieces that are missing before the file was written again.
    lost: u64,
    messages: Messages,
}

impl<B: Send + 'static> Background<B> {
    /// Hands batches to `write` until it fails or all are written, then calls `end`. Errors are reported to `messages`.
    pub(super) fn start<W: Send + 'static>(
        words: Words,
        writer: W,
        write: impl Fn(&mut W, B) -> io::Result<()> + Send + 'static,
        end: impl FnOnce(W) -> io::Result<()> + Send + 'static,
        pace: Pace,
        messages: Messages,
    ) -> Self {
        let (batches, incoming) = sync_channel(pace.room());
        let (done, written) = channel();
        let reporter = messages.clone();
        std::thread::spawn(move || {
            let mut writer = writer;
            let all = incoming.iter().try_for_each(|batch| write(&mut writer, batch));
            let ended = all.and_then(|()| end(writer)).map_err(|error| error.to_string());
            if let Err(error) = &ended {
                // The drives are worth more than what is written about them.
                reporter.say(&format!("warning: cannot write {}: {error}; it ends here", words.file));
            }
            // The receiver may have gone.
            let _ = done.send(ended);
            drop(incoming);
        });
        Self { batches, written, words, pace, missing: 0, lost: 0, messages }
    }

    /// Takes a batch of so many pieces; one that the disk has no time for is left out and reported, or waited for, by the pace.
    pub(super) fn write(&mut self, batch: B, pieces: u64) {
        if self.pace == Pace::Free {
            // Why the file has ended has been said.
            let _ = self.batches.send(batch);
            return;
        }
        let Words { file, pieces: what } = self.words;
        match self.batches.try_send(batch) {
            Ok(()) if self.missing > 0 => {
                let missing = std::mem::take(&mut self.missing);
                self.lost += missing;
                self.messages
                    .say(&format!("warning: {file} is being written again; {missing} {what} are missing in it"));
            }
            // When the file has ended for good, that has been said.
            Ok(()) | Err(TrySendError::Disconnected(_)) => {}
            Err(TrySendError::Full(_)) => {
                if self.missing == 0 {
                    self.messages.say(&format!(
                        "warning: {file} cannot be written as fast as the bus runs; {what} are left out"
                    ));
                }
                self.missing += pieces;
            }
        }
    }

    /// How many pieces are missing since the file was last written.
    #[cfg(test)]
    pub(super) fn missing(&self) -> u64 {
        self.missing
    }

    /// Waits until everything is written, at most for `patience`.
    ///
    /// # Errors
    /// The file is not whole.
    pub(super) fn finish(self, patience: Duration) -> Result<(), Failure> {
        drop(self.batches);
        let Words { file, pieces } = self.words;
        let torn = |why: String| Failure::new(format!("{file} is not complete")).of_kind("file").because(why);
        let lost = self.lost + self.missing;
        match self.written.recv_timeout(patience) {
            Ok(Err(error)) => Err(torn(format!("{error}; it ends there")).next("see that the disk has room")),
            Ok(Ok(())) if lost == 0 => Ok(()),
            Ok(Ok(())) if self.missing == 0 => Err(torn(format!("the disk was too slow: {lost} {pieces} are missing"))),
            Ok(Ok(())) | Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => {
                self.messages
                    .say(&format!("warning: the end of {file} is missing, and {} {pieces} before", self.missing));
                Err(torn(format!("the disk was too slow: its end is missing, and {lost} {pieces} before")))
            }
        }
    }
}
