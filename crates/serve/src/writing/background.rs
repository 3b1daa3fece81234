//! Files that a thread of their own writes: a slow disk costs what is in the file, never time of the bus.

use std::collections::VecDeque;
use std::io;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use crate::messages::Messages;
use words::failure::Failure;

/// What a disk needs for a file that is not whole.
pub const ROOM: &str = "make sure that the disk has room and is fast enough";

/// Whether time passes by the clock while a batch waits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pace {
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

/// A file, and what it is called in messages.
pub(super) trait Output<B>: Send + 'static {
    /// "the log".
    const FILE: &'static str;
    /// "frames".
    const PIECES: &'static str;

    /// Writes a batch.
    fn write(&mut self, batch: B) -> io::Result<()>;

    /// Hands what was written to the system, when nothing waits any more.
    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }

    /// Writes the end.
    fn end(self) -> io::Result<()>;
}

/// How batches wait.
#[derive(Clone, Copy)]
pub(super) struct WaitingRules {
    pub(super) pace: Pace,
    /// So many find room.
    pub(super) room: usize,
    /// How long the first of several may wait for the others, so that small ones are written together.
    pub(super) gathers: Duration,
}

impl WaitingRules {
    /// Each batch is written as soon as it comes.
    pub(super) const fn of(pace: Pace) -> Self {
        Self { pace, room: pace.room(), gathers: Duration::ZERO }
    }
}

/// A file under way; the clones hand batches to the same one.
pub(super) struct Background<B>(Arc<SharedQueue<B>>);

impl<B> Clone for Background<B> {
    fn clone(&self) -> Self {
        Self(Arc::clone(&self.0))
    }
}

struct SharedQueue<B> {
    queue: Mutex<BatchQueue<B>>,
    /// Notified when a first batch waits, when there is room again, when nothing more comes, and when the file has ended.
    changed: Condvar,
    waiting: WaitingRules,
    file: &'static str,
    pieces: &'static str,
    messages: Option<Messages>,
}

struct BatchQueue<B> {
    batches: VecDeque<B>,
    /// Nothing more comes.
    over: bool,
    /// How the file has ended.
    ended: Option<Result<(), String>>,
    missing: u64,
    /// Pieces that are missing before the file was written again.
    lost: u64,
}

impl<B: Send + 'static> Background<B> {
    /// Hands batches to `output` until it fails or all are written. Errors are reported to `messages`, if there are any.
    pub(super) fn start<O: Output<B>>(output: O, waiting: WaitingRules, messages: Option<Messages>) -> Self {
        let queue = BatchQueue { batches: VecDeque::new(), over: false, ended: None, missing: 0, lost: 0 };
        let (queue, changed) = (Mutex::new(queue), Condvar::new());
        let shared = Arc::new(SharedQueue { queue, changed, waiting, file: O::FILE, pieces: O::PIECES, messages });
        let mut ending = Ending(Arc::clone(&shared), Err("its writer has failed".to_owned()));
        std::thread::spawn(move || ending.come(output));
        Self(shared)
    }

    /// Takes a batch of so many pieces; one that the disk has no time for is left out and reported, or waited for, by the pace.
    pub(super) fn write(&self, batch: B, pieces: u64) {
        let SharedQueue { changed, waiting: WaitingRules { pace, room, .. }, file, pieces: what, .. } = &*self.0;
        let is_full = |queue: &mut BatchQueue<B>| queue.ended.is_none() && queue.batches.len() >= *room;
        let mut queue = self.0.lock();
        if *pace == Pace::Free {
            queue = changed.wait_while(queue, is_full).unwrap_or_else(PoisonError::into_inner);
        }
        if queue.ended.is_some() {
            // Why it has ended has been said.
            return;
        }
        if is_full(&mut queue) {
            if queue.missing == 0 {
                self.0.say(&format!("{file} cannot be written as fast as the bus runs; {what} are left out"));
            }
            queue.missing += pieces;
            return;
        }
        if queue.missing > 0 {
            let missing = std::mem::take(&mut queue.missing);
            queue.lost += missing;
            self.0.say(&format!("{file} is being written again; {missing} {what} are missing in it"));
        }
        queue.batches.push_back(batch);
        if queue.batches.len() == 1 || queue.batches.len() == *room {
            changed.notify_all();
        }
    }

    /// How many batches wait, and how many pieces are missing.
    #[cfg(test)]
    pub(super) fn waiting_and_missing(&self) -> (usize, u64) {
        let queue = self.0.lock();
        (queue.batches.len(), queue.lost + queue.missing)
    }

    /// Waits until everything is written, at most for `patience`.
    ///
    /// # Errors
    /// The file is not whole.
    pub(super) fn finish(self, patience: Duration) -> Result<(), Failure> {
        let SharedQueue { changed, file, pieces, .. } = &*self.0;
        let mut queue = self.0.lock();
        queue.over = true;
        changed.notify_all();
        let is_written = changed.wait_timeout_while(queue, patience, |queue| queue.ended.is_none());
        let queue = is_written.unwrap_or_else(PoisonError::into_inner).0;
        let torn =
            |why: String| Failure::new(format!("{file} is not complete")).of_kind("file").because(why).next(ROOM);
        let (missing, lost) = (queue.missing, queue.lost + queue.missing);
        match &queue.ended {
            Some(Err(error)) => Err(torn(format!("{error}; it ends there"))),
            Some(Ok(())) if lost == 0 => Ok(()),
            Some(Ok(())) if missing == 0 => Err(torn(format!("the disk was too slow: {lost} {pieces} are missing"))),
            Some(Ok(())) | None => {
                self.0.say(&format!("the end of {file} is missing, and {missing} {pieces} before"));
                Err(torn(format!("the disk was too slow: its end is missing, and {lost} {pieces} before")))
            }
        }
    }
}

impl<B> SharedQueue<B> {
    fn lock(&self) -> MutexGuard<'_, BatchQueue<B>> {
        // Nothing is half done between two batches, whichever thread panicked.
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn say(&self, what: &str) {
        self.messages.iter().for_each(|messages| messages.say(&format!("warning: {what}")));
    }

    /// Writes what comes until nothing more does.
    fn write_all(&self, mut output: impl Output<B>) -> io::Result<()> {
        let WaitingRules { room, gathers, .. } = self.waiting;
        loop {
            let idle = |queue: &mut BatchQueue<B>| queue.batches.is_empty() && !queue.over;
            let queue = self.changed.wait_while(self.lock(), idle).unwrap_or_else(PoisonError::into_inner);
            if queue.batches.is_empty() {
                return output.end();
            }
            let gathering = |queue: &mut BatchQueue<B>| !queue.over && queue.batches.len() < room;
            drop(self.changed.wait_timeout_while(queue, gathers, gathering));
            while let Some(batch) = self.next() {
                output.write(batch)?;
            }
            output.flush()?;
        }
    }

    /// The oldest batch that waits.
    fn next(&self) -> Option<B> {
        let mut queue = self.lock();
        let was_full = queue.batches.len() >= self.waiting.room;
        let batch = queue.batches.pop_front();
        if was_full {
            self.changed.notify_all();
        }
        batch
    }
}

/// How the file ends: said when the thread that writes it does, by a panic too.
struct Ending<B>(Arc<SharedQueue<B>>, Result<(), String>);

impl<B> Ending<B> {
    fn come(&mut self, output: impl Output<B>) {
        self.1 = self.0.write_all(output).map_err(|error| error.to_string());
    }
}

impl<B> Drop for Ending<B> {
    fn drop(&mut self) {
        let ended = std::mem::replace(&mut self.1, Ok(()));
        if let Err(error) = &ended {
            // The drives are worth more than what is written about them.
            self.0.say(&format!("cannot write {}: {error}; it ends here", self.0.file));
        }
        self.0.lock().ended = Some(ended);
        self.0.changed.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::{Receiver, Sender, channel};

    use super::*;

    /// An hour: a test that waits for it has failed.
    const LONG: Duration = Duration::from_secs(3600);

    #[derive(Debug, PartialEq)]
    enum Did {
        Write(u8),
        Flush,
        End,
    }

    struct Paper(Sender<Did>);

    impl Output<u8> for Paper {
        const FILE: &'static str = "the log";
        const PIECES: &'static str = "frames";

        fn write(&mut self, batch: u8) -> io::Result<()> {
            assert!(batch < 100, "a writer that panics");
            self.0.send(Did::Write(batch)).map_err(io::Error::other)
        }

        fn flush(&mut self) -> io::Result<()> {
            self.0.send(Did::Flush).map_err(io::Error::other)
        }

        fn end(self) -> io::Result<()> {
            self.0.send(Did::End).map_err(io::Error::other)
        }
    }

    fn log(pace: Pace, room: usize, gathers: Duration) -> (Background<u8>, Receiver<Did>) {
        let (paper, did) = channel();
        (Background::start(Paper(paper), WaitingRules { pace, room, gathers }, None), did)
    }

    #[test]
    fn small_batches_of_every_clone_are_written_together_and_the_end_is_not_waited_for() {
        let (log, did) = log(Pace::RealTime, 10, LONG);
        (0..3).for_each(|batch| log.clone().write(batch, 1));
        assert_eq!(log.finish(LONG), Ok(()));
        assert_eq!(did.iter().collect::<Vec<_>>(), [Did::Write(0), Did::Write(1), Did::Write(2), Did::Flush, Did::End]);
    }

    #[test]
    fn a_full_queue_is_not_gathered_for() {
        let (log, did) = log(Pace::Free, 2, LONG);
        (0..5).for_each(|batch| log.write(batch, 1));
        assert_eq!(log.finish(LONG), Ok(()));
        let written = did.iter().filter_map(|did| if let Did::Write(batch) = did { Some(batch) } else { None });
        assert_eq!(written.collect::<Vec<_>>(), [0, 1, 2, 3, 4]);
    }

    #[test]
    fn a_writer_that_fails_or_panics_holds_up_nobody() {
        let (failing, did) = log(Pace::Free, 1, Duration::ZERO);
        drop(did);
        (0..5).for_each(|batch| failing.write(batch, 1));
        assert!(failing.finish(LONG).is_err());
        let (panicking, _did) = log(Pace::Free, 1, Duration::ZERO);
        (100..105).for_each(|batch| panicking.write(batch, 1));
        let failure = panicking.finish(LONG).expect_err("it has panicked");
        assert_eq!(failure.because, ["its writer has failed; it ends there"]);
    }
}
