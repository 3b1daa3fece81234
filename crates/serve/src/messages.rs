//! Lines for a stream whose reader may be slow or absent: written by a thread of its own, so that the caller never waits.
//!
//! Lines keep their order. When 4 MiB wait unread, further ones are dropped and counted; the count takes their place as
//! soon as there is room, and is written to a second stream if there is one.

use std::collections::VecDeque;
use std::io::{self, Write};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use serde::Serialize;

use words::failure::{Failure, FailureBody};
use words::plain;

/// Bytes that may wait: some 7,000 answers to `get`.
const MAX_BYTES: usize = 4 << 20;

/// Speaks to one stream. A copy speaks to the same.
#[derive(Clone)]
pub struct Messages(Arc<MessageQueue>);

/// What replaces answers that were not read in time.
#[derive(Serialize)]
struct Gap {
    ok: bool,
    error: FailureBody,
    dropped: u64,
}

struct MessageQueue {
    queue: Mutex<Queue>,
    changed: Condvar,
    /// The line that stands for as many dropped ones.
    gap: fn(u64) -> String,
    /// Where they are reported too.
    warned: Option<Messages>,
}

#[derive(Default)]
struct Queue {
    lines: VecDeque<String>,
    bytes: usize,
    dropped: u64,
    /// A line is being written.
    writing: bool,
    /// Nothing was read for as long as a caller was ready to wait.
    stalled: bool,
}

impl Messages {
    /// Standard output, of lines that answer world commands.
    pub fn of_answers(warned: Messages) -> Self {
        Self::answers_to(io::stdout(), warned)
    }

    /// The same to another stream.
    pub fn answers_to(stream: impl Write + Send + 'static, warned: Messages) -> Self {
        let gap = |dropped| {
            let failure = Failure::new(format!("{dropped} answers are missing here: they were not read in time"))
                .of_kind("dropped")
                .next("read the answers as they come");
            sim::json::line(&Gap { ok: false, error: (&failure).into(), dropped })
        };
        Self::start(stream, gap, Some(warned))
    }

    /// Standard error.
    pub fn of_warnings() -> Self {
        Self::warnings_to(io::stderr())
    }

    /// The same to another stream.
    pub fn warnings_to(stream: impl Write + Send + 'static) -> Self {
        Self::start(stream, |dropped| format!("warning: {dropped} messages are missing here"), None)
    }

    /// To no reader.
    #[cfg(test)]
    pub fn silent() -> Self {
        Self::start(io::sink(), |_| String::new(), None)
    }

    fn start(stream: impl Write + Send + 'static, gap: fn(u64) -> String, warned: Option<Self>) -> Self {
        let shared = Arc::new(MessageQueue { queue: Mutex::default(), changed: Condvar::new(), gap, warned });
        let served = Arc::clone(&shared);
        std::thread::spawn(move || served.write_all(stream));
        Self(shared)
    }

    /// Says a line. Characters that would steer a terminal are shown instead.
    pub fn say(&self, line: &str) {
        let line = plain(line);
        let mut queue = self.0.lock();
        if queue.bytes + line.len() > MAX_BYTES {
            queue.dropped += 1;
            if let (1, Some(warned)) = (queue.dropped, &self.0.warned) {
                warned.say("warning: standard output is not being read; answers are being dropped");
            }
            return;
        }
        self.0.fill_gap(&mut queue);
        queue.push(line);
        self.0.changed.notify_all();
    }

    /// Waits until half of the room is free, at most for `patience`, and not again before something has been read.
    pub fn wait_for_room(&self, patience: Duration) {
        let queue = self.0.lock();
        if !queue.stalled {
            let crowded = |queue: &mut Queue| queue.bytes > MAX_BYTES / 2;
            let waited = self.0.changed.wait_timeout_while(queue, patience, crowded);
            let (mut queue, outcome) = waited.unwrap_or_else(PoisonError::into_inner);
            queue.stalled = outcome.timed_out();
        }
    }

    /// Waits until everything is written, at most for `patience`; false if it is not by then: what writes to the stream
    /// now would wait too.
    pub fn finish(&self, patience: Duration) -> bool {
        let busy = |queue: &mut Queue| queue.writing || !queue.lines.is_empty() || queue.dropped > 0;
        let waited = self.0.changed.wait_timeout_while(self.0.lock(), patience, busy);
        !waited.unwrap_or_else(PoisonError::into_inner).1.timed_out()
    }
}

impl Queue {
    fn push(&mut self, line: String) {
        self.bytes += line.len();
        self.lines.push_back(line);
    }
}

impl MessageQueue {
    fn lock(&self) -> MutexGuard<'_, Queue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Puts the count of dropped lines into their place.
    fn fill_gap(&self, queue: &mut Queue) {
        let dropped = std::mem::take(&mut queue.dropped);
        if dropped > 0 {
            queue.push((self.gap)(dropped));
            if let Some(warned) = &self.warned {
                warned.say(&format!("warning: standard output is read again; {dropped} answers were dropped"));
            }
        }
    }

    fn write_all(&self, mut stream: impl Write) {
        let mut queue = self.lock();
        loop {
            if queue.lines.is_empty() {
                self.fill_gap(&mut queue);
            }
            let Some(line) = queue.lines.pop_front() else {
                self.changed.notify_all();
                queue = self.changed.wait(queue).unwrap_or_else(PoisonError::into_inner);
                continue;
            };
            queue.writing = true;
            drop(queue);
            // The drives run on if the reader has gone.
            let _ = writeln!(stream, "{line}").and_then(|()| stream.flush());
            queue = self.lock();
            queue.writing = false;
            queue.bytes -= line.len();
            queue.stalled = false;
            self.changed.notify_all();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

    const SOON: Duration = Duration::from_secs(600);

    /// A stream that takes a write only when it is read.
    struct Pipe(SyncSender<Vec<u8>>);

    impl Write for Pipe {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0.send(bytes.to_vec()).map(|()| bytes.len()).map_err(|_| io::ErrorKind::BrokenPipe.into())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    fn pipe() -> (Pipe, Receiver<Vec<u8>>) {
        let (sender, receiver) = sync_channel(0);
        (Pipe(sender), receiver)
    }

    /// Lines read until `last` comes.
    fn read_until(reader: &Receiver<Vec<u8>>, last: &str) -> Vec<String> {
        let mut text = Vec::new();
        while !text.ends_with(format!("{last}\n").as_bytes()) {
            text.extend(reader.recv_timeout(SOON).expect("a line in time"));
        }
        String::from_utf8(text).unwrap().lines().map(str::to_owned).collect()
    }

    #[test]
    fn what_nobody_reads_is_dropped_and_the_count_stands_in_its_place() {
        let (warnings, warned) = pipe();
        let (answers, reader) = pipe();
        let warner = Messages::start(warnings, |_| String::new(), None);
        let messages = Messages::start(answers, |dropped| format!("{dropped} missing"), Some(warner));
        let filler = "x".repeat(1 << 20);
        (0..3).for_each(|_| messages.say(&filler));
        messages.say("small");
        (0..7).for_each(|_| messages.say(&filler));
        let lines = read_until(&reader, "7 missing");
        assert_eq!(lines.iter().map(String::len).collect::<Vec<_>>(), [1 << 20, 1 << 20, 1 << 20, 5, 9]);
        messages.say("after");
        assert_eq!(read_until(&reader, "after"), ["after"]);
        assert!(read_until(&warned, "being dropped")[0].contains("standard output is not being read"));
        assert!(read_until(&warned, "were dropped")[0].contains("7 answers were dropped"));
        assert!(messages.finish(SOON));
    }

    #[test]
    fn who_waits_for_room_waits_once_for_a_reader_that_is_not_there() {
        let (answers, reader) = pipe();
        let messages = Messages::start(answers, |_| String::new(), None);
        messages.say(&"x".repeat(3 << 20));
        assert!(!messages.finish(Duration::from_millis(1)));
        messages.wait_for_room(Duration::from_millis(1));
        // Would hang if it waited again.
        messages.wait_for_room(Duration::from_secs(u64::MAX >> 32));
        messages.say("read");
        read_until(&reader, "read");
        messages.wait_for_room(Duration::from_secs(u64::MAX >> 32));
    }

    #[test]
    fn a_reader_that_is_gone_holds_up_nobody() {
        let (answers, reader) = pipe();
        drop(reader);
        let messages = Messages::start(answers, |_| String::new(), None);
        messages.say("a");
        assert!(messages.finish(SOON));
        assert!(messages.0.lock().lines.is_empty());
    }
}
