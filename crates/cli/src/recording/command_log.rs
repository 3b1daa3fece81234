//! `--log` of a command: every frame that it sends and hears, with the time.
//!
//! A thread of its own writes what has come ten times a second, so that a command that is killed loses less than a second,
//! and a slow disk costs frames of the log, never time of the bus.

use std::io;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use can::{Frame, Instant, Station};
use transport::log::{Content, Direction, Interface, Record};

use super::background::Pace;
use super::log_options::NewLog;

/// How long frames may wait in memory.
const INTERVAL: Duration = Duration::from_millis(100);

/// Frames that may wait for the disk: some 10 s of a full bus at 1 Mbit/s.
const MOST_WAITING: usize = 1 << 17;

/// A log under way; the clones write the same file. Without a file nothing is kept.
#[derive(Clone, Default)]
pub(crate) struct CommandLog(Option<Arc<Shared>>);

struct Shared {
    waiting: Mutex<Waiting>,
    /// Notified when there is nothing more to come.
    ended: Condvar,
    /// Notified when there is room again.
    taken: Condvar,
    /// Whether frames wait for the disk; else they are left out.
    patient: bool,
    interface: Interface,
    unix_zero: Duration,
}

#[derive(Default)]
struct Waiting {
    records: Vec<Record>,
    missing: u64,
    over: bool,
}

/// The thread that writes; its owner waits for the end.
pub(crate) struct Writing(Option<(CommandLog, JoinHandle<io::Result<u64>>)>);

impl CommandLog {
    /// Writes to `file` from now on. `unix_zero` is the Unix time of the bus's zero; a bus of virtual time waits for the
    /// disk.
    pub(crate) fn start(
        file: Option<NewLog>,
        interface: Interface,
        unix_zero: Duration,
        pace: Pace,
    ) -> (Self, Writing) {
        let Some(file) = file else { return (Self(None), Writing(None)) };
        let waiting = Mutex::new(Waiting::default());
        let (ended, taken, patient) = (Condvar::new(), Condvar::new(), pace == Pace::Free);
        let shared = Arc::new(Shared { waiting, ended, taken, patient, interface, unix_zero });
        let log = Self(Some(Arc::clone(&shared)));
        let thread = std::thread::spawn(move || {
            let written = shared.write(file);
            // A writer that has failed is not waited for.
            shared.lock().over = true;
            shared.taken.notify_all();
            written
        });
        (log.clone(), Writing(Some((log, thread))))
    }

    /// Takes a frame that passed.
    pub(crate) fn frame(&self, frame: &Frame, now: Instant, direction: Direction) {
        self.take(Content::Frame(*frame), now, Some(direction));
    }

    /// Takes what was on the bus.
    pub(crate) fn take(&self, content: Content, now: Instant, direction: Option<Direction>) {
        let Some(shared) = &self.0 else { return };
        let at = Some(now + shared.unix_zero);
        self.record(&Record { at, interface: shared.interface, direction, content });
    }

    /// Takes a record of another log as it is; what the disk has no time for is counted.
    pub(crate) fn record(&self, record: &Record) {
        let Some(shared) = &self.0 else { return };
        let mut waiting = shared.lock();
        while shared.patient && !waiting.over && waiting.records.len() >= MOST_WAITING {
            waiting = shared.taken.wait(waiting).unwrap_or_else(PoisonError::into_inner);
        }
        if waiting.records.len() >= MOST_WAITING {
            waiting.missing += 1;
            return;
        }
        waiting.records.push(record.clone());
    }
}

impl Shared {
    fn write(&self, mut file: NewLog) -> io::Result<u64> {
        let mut missing = 0;
        loop {
            let mut waiting = self.lock();
            if !waiting.over {
                let ended = self.ended.wait_timeout(waiting, INTERVAL);
                waiting = ended.unwrap_or_else(PoisonError::into_inner).0;
            }
            let (records, over) = (std::mem::take(&mut waiting.records), waiting.over);
            missing += std::mem::take(&mut waiting.missing);
            drop(waiting);
            self.taken.notify_all();
            records.iter().try_for_each(|record| file.write(record))?;
            if over {
                return file.finish().map(|_| missing);
            }
            if !records.is_empty() {
                file.flush()?;
            }
        }
    }

    fn lock(&self) -> MutexGuard<'_, Waiting> {
        // Nothing is half done between two frames, whichever thread panicked.
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Writing {
    /// Waits until everything is written; what is missing, in words for people.
    pub(crate) fn finish(self) -> Option<String> {
        let (log, thread) = self.0?;
        if let Some(shared) = &log.0 {
            shared.lock().over = true;
            shared.ended.notify_one();
        }
        match thread.join() {
            Ok(Ok(0)) => None,
            Ok(Ok(missing)) => Some(format!("{missing} frames are missing in the log: the disk was too slow")),
            Ok(Err(error)) => Some(format!("cannot write the log: {error}; its end is missing")),
            Err(_) => Some("the end of the log was not written".to_owned()),
        }
    }
}

/// A station whose frames are logged as they pass.
#[derive(Clone)]
pub(crate) struct Logged<S> {
    station: S,
    log: CommandLog,
}

impl<S> Logged<S> {
    /// `station`, whose frames go to `log`.
    pub(crate) const fn new(station: S, log: CommandLog) -> Self {
        Self { station, log }
    }
}

impl<S: Station> Station for Logged<S> {
    fn handle_frame(&mut self, frame: &Frame, now: Instant) {
        self.log.frame(frame, now, Direction::Received);
        self.station.handle_frame(frame, now);
    }

    fn handle_timeout(&mut self, now: Instant) {
        self.station.handle_timeout(now);
    }

    fn poll_transmit(&mut self) -> Option<Frame> {
        self.station.poll_transmit()
    }

    fn poll_timeout(&self) -> Option<Instant> {
        self.station.poll_timeout()
    }

    fn handle_bus_off(&mut self, off: bool, now: Instant) {
        self.station.handle_bus_off(off, now);
    }

    fn handle_transmitted(&mut self, frame: &Frame, now: Instant) {
        self.log.frame(frame, now, Direction::Transmitted);
        self.station.handle_transmitted(frame, now);
    }
}
