//! The log of `sim --log`: the frames of the bus.

use std::io::{self, Seek, Write};
use std::time::Duration;

use can::{Frame, Instant};
use canlog::{LogWriter, Record};

use super::background::{Background, Output, Pace, WaitingRules};
use crate::messages::Messages;
use words::failure::Failure;

/// Frames, and when the bus carried them.
type Batch = Vec<(Instant, Frame)>;

/// The log of `sim --log`, which a thread of its own writes.
pub struct FrameLog(Background<Batch>);

/// A log whose times are counted from this one.
struct Timed<W: Write> {
    log: LogWriter<W>,
    unix_zero: Duration,
}

impl<W: Write + Seek + Send + 'static> Output<Batch> for Timed<W> {
    const FILE: &'static str = "the log";
    const PIECES: &'static str = "frames";

    fn write(&mut self, batch: Batch) -> io::Result<()> {
        batch.iter().try_for_each(|(at, frame)| self.log.write(&Record::of_frame(*at + self.unix_zero, *frame)))?;
        self.log.flush()
    }

    fn end(self) -> io::Result<()> {
        self.log.finish().map(drop)
    }
}

impl FrameLog {
    /// Writes to `log` from now on, with times counted from `unix_zero`. Errors are reported to `messages`.
    pub fn start<W: Write + Seek + Send + 'static>(
        log: LogWriter<W>,
        unix_zero: Duration,
        pace: Pace,
        messages: Messages,
    ) -> Self {
        Self(Background::start(Timed { log, unix_zero }, WaitingRules::of(pace), Some(messages)))
    }

    /// Takes frames that were carried.
    pub fn write(&mut self, batch: Batch) {
        let count = batch.len() as u64;
        if count > 0 {
            self.0.write(batch, count);
        }
    }

    /// Waits until everything is written, at most for `patience`.
    ///
    /// # Errors
    /// The file is not whole.
    pub fn finish(self, patience: Duration) -> Result<(), Failure> {
        self.0.finish(patience)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use canlog::Format;
    use std::sync::mpsc::{Receiver, SyncSender, channel, sync_channel};

    const SOON: Duration = Duration::from_secs(600);
    const ROOM: usize = Pace::RealTime.room();

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

    impl Seek for Disk {
        fn seek(&mut self, _: io::SeekFrom) -> io::Result<u64> {
            Err(io::ErrorKind::Unsupported.into())
        }
    }

    /// A candump log on such a disk.
    fn log(disk: Disk) -> LogWriter<io::BufWriter<Disk>> {
        LogWriter::new(io::BufWriter::new(disk), Format::Candump).unwrap()
    }

    fn batch(second: usize) -> Batch {
        vec![(Instant::from_secs(second as u64), "701#05".parse().expect("a frame"))]
    }

    #[test]
    fn a_disk_that_stands_still_holds_up_nobody_and_costs_the_newest_frames() {
        let (allow, allowed) = channel();
        let (taken, disk) = sync_channel(1000);
        let mut log =
            FrameLog::start(log(Disk(allowed, taken)), Duration::ZERO, Pace::RealTime, Messages::of_warnings());
        log.write(batch(0));
        while log.0.waiting_and_missing().0 > 0 {
            std::thread::yield_now();
        }
        for second in 1..1 + ROOM + 50 {
            log.write(batch(second));
        }
        assert_eq!(log.0.waiting_and_missing(), (ROOM, 50));
        drop(allow);
        // Missing frames are reported at the end, too.
        assert!(log.finish(SOON).is_err());
        let text = String::from_utf8(disk.try_iter().flatten().collect()).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), 1 + ROOM);
        assert_eq!(lines[lines.len() - 1], format!("({:010}.000000) can0 701#05", lines.len() - 1));
    }

    #[test]
    fn a_bus_that_can_wait_does_and_nothing_is_left_out() {
        let (allow, allowed) = channel();
        let (taken, disk) = sync_channel(1000);
        let mut log = FrameLog::start(log(Disk(allowed, taken)), Duration::ZERO, Pace::Free, Messages::of_warnings());
        let batches = 3 * ROOM;
        // The disk takes a piece when the bus has had to wait for it, or a little later.
        let slow = std::thread::spawn(move || {
            for _ in 0..batches {
                std::thread::sleep(Duration::from_micros(200));
                if allow.send(()).is_err() {
                    return;
                }
            }
        });
        (0..batches).for_each(|second| log.write(batch(second)));
        assert_eq!(log.0.waiting_and_missing().1, 0);
        slow.join().unwrap();
        assert_eq!(log.finish(SOON), Ok(()));
        let text = String::from_utf8(disk.try_iter().flatten().collect()).unwrap();
        assert_eq!(text.lines().count(), batches);
    }

    #[test]
    fn a_disk_that_fails_ends_the_log_and_nothing_else() {
        let (allow, allowed) = channel();
        let (taken, disk) = sync_channel(0);
        drop((allow, disk));
        let mut log =
            FrameLog::start(log(Disk(allowed, taken)), Duration::ZERO, Pace::RealTime, Messages::of_warnings());
        for second in 0..3 * ROOM {
            log.write(batch(second));
        }
        let failure = log.finish(SOON).unwrap_err();
        assert_eq!((failure.what.as_str(), failure.kind), ("the log is not complete", "file"), "{failure:?}");
    }
}
