//! Requests to a node's SDO server and its answers, of whichever client: a server answers each request once (CiA 301, 7.2.4.3), so
//! that an answer without a request is another device's, with the same node-ID.

use std::time::Duration;

use can::{Frame, Instant};
use canopen::AbortCode;
use canopen::sdo::wire::{Reply, Request};

/// After so long without a request no client waits for an answer any more: servers that slow are not known.
const FORGOTTEN: Duration = Duration::from_secs(5);

/// In a block transfer there are many frames to one answer, or to one request. It is at its end after so long a silence.
const BLOCK_SILENCE: Duration = Duration::from_secs(2);

/// Requests that may be open: each client has one, and some have been given up.
const MOST_OPEN: u8 = 8;

/// Surplus answers that are reported: one alone may be the answer to a request that was lost on the way here.
pub(super) const ENOUGH: u32 = 2;

/// See the [module](self).
#[derive(Clone, Debug, Default)]
pub(super) struct Answers {
    open: u8,
    asked_at: Instant,
    block_until: Instant,
    /// Answers without a request.
    second: u32,
}

impl Answers {
    /// A client asks, this master or another.
    pub(super) fn asked(&mut self, request: &Frame, now: Instant) {
        if now > self.asked_at + FORGOTTEN {
            self.open = 0;
        }
        self.asked_at = now;
        match Request::parse(request.padded()) {
            // Nothing answers that.
            Request::Abort(..) => return,
            Request::Unknown { .. } => self.block_until = now + BLOCK_SILENCE,
            _ if now < self.block_until => self.block_until = now + BLOCK_SILENCE,
            _ => {}
        }
        self.open = (self.open + 1).min(MOST_OPEN);
    }

    /// The server answers; how many answers too many there have been, if this is one.
    pub(super) fn answered(&mut self, reply: &Frame, now: Instant) -> Option<u32> {
        if now < self.block_until {
            self.block_until = now + BLOCK_SILENCE;
            return None;
        }
        // A server that has waited in vain for the next segment aborts unasked.
        if matches!(Reply::parse(reply.padded()), Reply::Abort(_, AbortCode::TIMED_OUT)) {
            return None;
        }
        if self.open > 0 {
            self.open -= 1;
            return None;
        }
        self.second = self.second.saturating_add(1);
        Some(self.second)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is counted of frames that pass 1 ms after each other.
    fn counted(frames: &[&str]) -> u32 {
        let mut answers = Answers::default();
        for (place, text) in frames.iter().enumerate() {
            let (frame, now) = (text.parse().unwrap(), Instant::from_millis(place as u64));
            if text.starts_with("604") {
                answers.asked(&frame, now);
            } else {
                answers.answered(&frame, now);
            }
        }
        answers.second
    }

    #[test]
    fn each_request_has_one_answer_whosever_it_is() {
        const READ: &str = "604#4000100000000000";
        const VALUE: &str = "584#4300100092010400";
        const REFUSED: &str = "584#8000100000000206";
        assert_eq!(counted(&[READ, VALUE, READ, VALUE]), 0);
        // Two clients at one time, and one answer that comes after its client has given up.
        assert_eq!(counted(&[READ, READ, VALUE, VALUE]), 0);
        assert_eq!(counted(&[READ, "604#8000100000000405", READ, VALUE, VALUE]), 0);
        // Two devices: with two values, or a value and a refusal.
        assert_eq!(counted(&[READ, VALUE, VALUE]), 1);
        assert_eq!(counted(&[READ, VALUE, REFUSED, READ, REFUSED, VALUE]), 2);
    }

    #[test]
    fn what_a_server_may_say_by_itself_is_no_second_answer() {
        // CiA 301, 7.2.4.3.17: 0504 0000h, SDO protocol timed out.
        assert_eq!(counted(&["604#4008100000000000", "584#4108100014000000", "584#8008100000000405"]), 0);
    }

    #[test]
    fn a_block_transfer_of_others_is_passed_over() {
        // CiA 301, 7.2.4.3.12: initiate, start, two segments, the client's acknowledgement, the end.
        let upload = [
            "604#A008100002000000",
            "584#C208100009000000",
            "604#A300000000000000",
            "584#0161626364656667",
            "584#8268690000000000",
            "604#A202020000000000",
            "584#D500000000000000",
            "604#A100000000000000",
        ];
        assert_eq!(counted(&upload), 0);
        assert_eq!(counted(&[&upload[..], &["604#4000100000000000", "584#4300100092010400"]].concat()), 0);
    }
}
