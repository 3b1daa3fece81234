//! The log of `--log`, written by a thread of its own: a slow disk costs frames of the log, never time of the bus.

use std::io::{BufWriter, Write};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, channel, sync_channel};
use std::time::Duration;

use can::{Frame, Instant};
use transport::log::LogWriter;

use super::speaker::Speaker;

/// Batches that may wait for the disk: some 10 s of the bus.
const MAX_BATCHES: usize = 100;

/// Frames, and when the bus carried them.
type Batch = Vec<(Instant, Frame)>;

/// See the [module](self).
pub(crate) struct FrameLog {
    batches: SyncSender<Batch>,
    /// Ends when everything is written.
    written: Receiver<()>,
    missing: u64,
    speaker: Speaker,
}

impl FrameLog {
    /// Writes to `file` from now on, with times counted from `unix_zero`. What goes wrong is told to `speaker`.
    pub(crate) fn start(file: impl Write + Send + 'static, unix_zero: Duration, speaker: Speaker) -> Self {
        let (batches, incoming) = sync_channel(MAX_BATCHES);
        let (done, written) = channel();
        let told = speaker.clone();
        std::thread::spawn(move || {
            write_all(file, unix_zero, &incoming, &told);
            drop(done);
        });
        Self { batches, written, missing: 0, speaker }
    }

    /// Takes frames that were carried.
    pub(crate) fn write(&mut self, batch: Batch) {
        let count = batch.len() as u64;
        if count == 0 {
            return;
        }
        match self.batches.try_send(batch) {
            Ok(()) if self.missing > 0 => {
                let missing = std::mem::take(&mut self.missing);
                self.speaker.say(&format!("warning: the log is written again; {missing} frames are missing in it"));
            }
            // When the log has ended for good, that has been said.
            Ok(()) | Err(TrySendError::Disconnected(_)) => {}
            Err(TrySendError::Full(_)) => {
                if self.missing == 0 {
                    self.speaker.say("warning: the log cannot be written as fast as the bus goes; frames are left out");
                }
                self.missing += count;
            }
        }
    }

    /// Waits until everything is written, at most for `patience`.
    pub(crate) fn finish(self, patience: Duration) {
        drop(self.batches);
        let ended = self.written.recv_timeout(patience);
        if ended == Err(std::sync::mpsc::RecvTimeoutError::Timeout) || self.missing > 0 {
            self.speaker.say(&format!("warning: the end of the log is missing, and {} frames before", self.missing));
        }
    }
}

fn write_all(file: impl Write, unix_zero: Duration, incoming: &Receiver<Batch>, speaker: &Speaker) {
    let mut log = LogWriter::new(BufWriter::new(file), "can0");
    for batch in incoming {
        let written = batch.iter().try_for_each(|(at, frame)| log.write(*at + unix_zero, frame));
        if let Err(error) = written.and_then(|()| log.flush()) {
            // The drives are worth more than their log.
            speaker.say(&format!("warning: cannot write the log: {error}; it ends here"));
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io;

    const SOON: Duration = Duration::from_secs(20);

    /// A disk that takes nothing until it is allowed to, and hands out what it has taken.
    struct Disk(Receiver<()>, SyncSender<Vec<u8>>);

    impl Write for Disk {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            // An end of allowances allows everything.
            let _ = self.0.recv();
            self.1.send(bytes.to_vec()).map(|()| bytes.len()).map_err(|_| io::ErrorKind::StorageFull.into())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    fn batch(second: usize) -> Batch {
        vec![(Instant::from_secs(second as u64), "701#05".parse().expect("a frame"))]
    }

    #[test]
    fn a_disk_that_stands_still_holds_up_nobody_and_costs_the_newest_frames() {
        let (allow, allowed) = channel();
        let (taken, disk) = sync_channel(1000);
        let mut log = FrameLog::start(Disk(allowed, taken), Duration::ZERO, Speaker::of_warnings());
        for second in 0..MAX_BATCHES + 50 {
            log.write(batch(second));
        }
        // One batch may have been taken out of the queue.
        assert!((49..=50).contains(&log.missing), "{}", log.missing);
        let missing = log.missing as usize;
        drop(allow);
        log.finish(SOON);
        let text = String::from_utf8(disk.try_iter().flatten().collect()).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), MAX_BATCHES + 50 - missing);
        assert_eq!(lines[lines.len() - 1], format!("({:010}.000000) can0 701#05", lines.len() - 1));
    }

    #[test]
    fn a_disk_that_fails_ends_the_log_and_nothing_else() {
        let (allow, allowed) = channel();
        let (taken, disk) = sync_channel(0);
        drop((allow, disk));
        let mut log = FrameLog::start(Disk(allowed, taken), Duration::ZERO, Speaker::of_warnings());
        for second in 0..3 * MAX_BATCHES {
            log.write(batch(second));
        }
        log.finish(SOON);
    }
}
