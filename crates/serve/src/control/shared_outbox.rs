//! Where the world's loop leaves lines for a client's task.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use host::control::{Class, Outbox, Sink};
use tokio::sync::{Notify, watch};

/// Lines for one client, and whether more will come.
#[derive(Debug, Default)]
pub struct SharedOutbox {
    content: Mutex<Content>,
    filled: Notify,
    emptied: Notify,
    standing: watch::Sender<Standing>,
}

/// Whether its client may stay.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Standing {
    #[default]
    Stranger,
    Admitted,
    SentAway,
}

#[derive(Debug, Default)]
struct Content {
    outbox: Outbox,
    closed: bool,
}

/// The world's end of a shared_outbox. Dropped, it closes it: what is there is still sent.
#[derive(Debug)]
pub struct OutboxSender(pub Arc<SharedOutbox>);

impl Sink for OutboxSender {
    fn put(&mut self, class: Class, line: String) {
        self.0.put(class, line);
    }

    fn admit(&mut self) {
        self.0.standing.send_replace(Standing::Admitted);
    }
}

impl Drop for OutboxSender {
    fn drop(&mut self) {
        self.0.content().closed = true;
        self.0.filled.notify_one();
    }
}

impl SharedOutbox {
    fn content(&self) -> MutexGuard<'_, Content> {
        self.content.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adds a line, without its end.
    pub(super) fn put(&self, class: Class, line: String) {
        self.content().outbox.put(class, line);
        self.filled.notify_one();
    }

    /// The next line for its client, if there is one.
    pub fn next_line(&self) -> Option<String> {
        let line = self.content().outbox.next_line();
        self.emptied.notify_one();
        line
    }

    /// The world has not admitted its client yet.
    pub(super) fn is_stranger(&self) -> bool {
        *self.standing.borrow() == Standing::Stranger
    }

    /// Its client is not to stay.
    pub(super) fn send_away(&self) {
        self.standing.send_replace(Standing::SentAway);
    }

    /// Waits until its client is admitted; false if it is not to stay.
    pub(super) async fn is_admitted(&self) -> bool {
        let mut standing = self.standing.subscribe();
        let decided = standing.wait_for(|standing| *standing != Standing::Stranger).await;
        decided.is_ok_and(|standing| *standing == Standing::Admitted)
    }

    /// Waits while too many answers are unread.
    pub(super) async fn wait_for_room(&self) {
        while self.content().outbox.is_full() {
            self.emptied.notified().await;
        }
    }

    /// Waits for lines and puts them into `text`, each with its end, until that has `enough` bytes; false when there are none and
    /// no more will come.
    pub(super) async fn fetch(&self, text: &mut String, enough: usize) -> bool {
        loop {
            {
                let mut content = self.content();
                while text.len() < enough
                    && let Some(line) = content.outbox.next_line()
                {
                    text.push_str(&line);
                    text.push('\n');
                }
                if text.is_empty() && content.closed {
                    return false;
                }
            }
            if !text.is_empty() {
                self.emptied.notify_one();
                return true;
            }
            self.filled.notified().await;
        }
    }
}
