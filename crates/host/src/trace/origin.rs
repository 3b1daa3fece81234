//! The line of a frame of the bus in a log.

use core::fmt::Write;
use std::time::Duration;

use can::BusFrame;

/// The contents of a log besides frames.
#[derive(Clone, Debug)]
pub struct Origin {
    /// Name of the bus's interface, a single word.
    pub interface: String,
    /// Unix time of the bus's zero.
    pub unix_zero: Duration,
}

impl Default for Origin {
    fn default() -> Self {
        Self { interface: "can0".into(), unix_zero: Duration::ZERO }
    }
}

impl Origin {
    /// `(1700000000.123456) can0 604#4041600000000000 T`.
    pub(super) fn push_line(&self, out: &mut String, passed: &BusFrame) {
        let at = passed.at + self.unix_zero;
        let (seconds, micros) = (at.as_nanos() / 1_000_000_000, at.as_nanos() % 1_000_000_000 / 1_000);
        let direction = if passed.own { 'T' } else { 'R' };
        // Writing to a string cannot fail.
        let _ = writeln!(out, "({seconds:010}.{micros:06}) {} {} {direction}", self.interface, passed.frame);
    }
}
