//! A program as a station: what a test of stopping may do to it. The tests of crate `host` read this file too.

use can::{Frame, Instant, Station};
use master::Network;

/// A program with its master, which may be killed, or frozen for a while.
#[derive(Clone)]
pub(super) struct Process {
    network: Network,
    pub(super) killed: bool,
    /// Until then nothing of it runs; what comes meanwhile waits.
    pub(super) frozen_until: Option<Instant>,
    mailbox: Vec<Frame>,
}

impl Process {
    pub(super) fn of(network: &Network) -> Self {
        Self { network: network.clone(), killed: false, frozen_until: None, mailbox: Vec::new() }
    }
}

impl Station for Process {
    fn handle_frame(&mut self, frame: &Frame, now: Instant) {
        if self.killed {
            return;
        }
        match self.frozen_until {
            Some(until) if now < until => self.mailbox.push(*frame),
            _ => self.network.handle_frame(frame, now),
        }
    }

    fn handle_timeout(&mut self, now: Instant) {
        if self.killed || self.frozen_until.is_some_and(|until| now < until) {
            return;
        }
        self.frozen_until = None;
        for frame in self.mailbox.drain(..) {
            self.network.handle_frame(&frame, now);
        }
        self.network.handle_timeout(now);
    }

    fn poll_transmit(&mut self) -> Option<Frame> {
        if self.killed || self.frozen_until.is_some() { None } else { self.network.poll_transmit() }
    }

    fn poll_timeout(&self) -> Option<Instant> {
        if self.killed { None } else { self.frozen_until.or_else(|| self.network.poll_timeout()) }
    }
}
