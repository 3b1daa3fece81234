//! The kept frames as a candump log, which `ferrodrive dump` and can-utils read.

use can::BusFrame;

use super::origin::Origin;
use super::query::Query;
use super::ring::{CHUNK, Held};

/// A part of a log, and where the next one begins.
#[derive(Debug)]
pub struct Part {
    pub text: String,
    pub next: u64,
}

impl Query {
    /// The next lines of the log, of frames from this number on; `None` at its end. Nodes and services are chosen as for the view;
    /// words are not, since a transfer cannot be decoded without some of its frames.
    pub fn log_part(&self, held: &Held, origin: &Origin, from: u64) -> Option<Part> {
        let (floor, ceiling) = self.bounds(held);
        let from = from.max(floor);
        let next = ceiling.min(from + CHUNK as u64);
        if from >= next {
            return None;
        }
        let mut text = String::new();
        self.frames(held, from, next, |passed| origin.push_line(&mut text, passed));
        Some(Part { text, next })
    }

    /// Visits all frames of the log.
    pub fn all_frames(&self, held: &Held, visit: impl FnMut(&BusFrame)) {
        let (floor, ceiling) = self.bounds(held);
        self.frames(held, floor, ceiling, visit);
    }

    fn frames(&self, held: &Held, from: u64, to: u64, mut visit: impl FnMut(&BusFrame)) {
        held.decode(from, to, |_, passed, decoded| {
            if self.chooses(decoded) {
                visit(passed);
            }
        });
    }
}
