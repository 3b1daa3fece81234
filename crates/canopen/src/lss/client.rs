//! The master's side of LSS: one request at a time, and how long its answer may take.

use core::time::Duration;

use can::{Frame, Instant};

use super::wire::{Reply, Request};

/// How long a slave may take, as a client waits without other instructions. A guess: CiA 305 leaves it to the master.
pub const TIMEOUT: Duration = Duration::from_millis(100);

/// The master's side: one request at a time.
#[derive(Clone, Debug)]
pub struct Client {
    timeout: Duration,
    waiting: Option<Waiting>,
    frame: Option<Frame>,
}

#[derive(Clone, Copy, Debug)]
struct Waiting {
    request: Request,
    /// From when the wire has taken the request.
    deadline: Instant,
}

impl Default for Client {
    fn default() -> Self {
        Self::new(TIMEOUT)
    }
}

impl Client {
    /// A client that waits this long for each answer.
    pub const fn new(timeout: Duration) -> Self {
        Self { timeout, waiting: None, frame: None }
    }

    /// Asks. A request under way is forgotten.
    pub fn ask(&mut self, request: Request, now: Instant) {
        self.frame = Some(request.emit());
        self.waiting = request.is_answered().then(|| Waiting { request, deadline: now + self.timeout });
    }

    /// True while an answer may come.
    pub const fn is_waiting(&self) -> bool {
        self.waiting.is_some()
    }

    /// A frame arrived: the answer, if it is one to the request under way.
    pub fn handle_frame(&mut self, frame: &Frame) -> Option<Reply> {
        let waiting = self.waiting?;
        let reply = Reply::parse(frame).filter(|reply| waiting.request.is_answered_by(reply))?;
        self.waiting = None;
        Some(reply)
    }

    /// Time has reached `now`: true if the request under way is given up.
    pub fn handle_timeout(&mut self, now: Instant) -> bool {
        let over = self.waiting.is_some_and(|waiting| now >= waiting.deadline);
        if over {
            self.waiting = None;
        }
        over
    }

    /// The next frame to send.
    pub const fn poll_transmit(&mut self) -> Option<Frame> {
        self.frame.take()
    }

    /// When [`handle_timeout`](Self::handle_timeout) should next be called.
    pub fn poll_timeout(&self) -> Option<Instant> {
        self.waiting.map(|waiting| waiting.deadline)
    }
}
