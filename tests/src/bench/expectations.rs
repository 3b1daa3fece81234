//! What a test expects to see: each call asserts, and says what was there, what was expected, and when.

use std::time::Duration;

use sim::Report;

use super::{Abort, Bench, BenchSubject, ObjectAddress, head};

impl<S: BenchSubject> Bench<S> {
    /// Asserts that this and nothing else was heard since the last call; `n` stands for the node.
    #[track_caller]
    pub fn hears(&mut self, expected: &[&str]) -> &mut Self {
        self.hears_of("", expected)
    }

    /// Asserts that of what begins like this, this and nothing else was heard since the last call.
    #[track_caller]
    pub fn hears_of(&mut self, beginning: &str, expected: &[&str]) -> &mut Self {
        let expected: Vec<_> = expected.iter().map(|frame| self.named(frame)).collect();
        assert_eq!(self.heard_of(beginning), expected, "heard, and expected, at {} s", self.seconds());
        self
    }

    /// Asserts that an object reads this value now.
    #[track_caller]
    pub fn reads(&mut self, object: impl ObjectAddress, expected: i64) -> &mut Self {
        let (value, (index, sub)) = (self.get(object), object.place());
        let at = self.seconds();
        assert_eq!(value, expected, "{index:04X}h:{sub:02X} is {value:X}h, expected {expected:X}h, at {at} s");
        self
    }

    /// Asserts that the statusword has these bits among those of `mask` now.
    #[track_caller]
    pub fn shows(&mut self, mask: u16, bits: u16) -> &mut Self {
        let (statusword, at) = (self.statusword(), self.seconds());
        let text = format!("6041h is {statusword:04X}h, expected {bits:04X}h of {mask:04X}h, at {at} s");
        assert_eq!(statusword & mask, bits, "{text}");
        self
    }

    /// Asserts that the motor turns with a speed between these, r/min.
    #[track_caller]
    pub fn turns_at(&mut self, low_rpm: f64, high_rpm: f64) -> &mut Self {
        assert_within("speed in r/min", self.report().velocity_rpm, low_rpm, high_rpm);
        self
    }

    /// Asserts that a write is refused with this code.
    #[track_caller]
    pub fn refuses(&mut self, object: impl ObjectAddress, value: i64, code: Abort) -> &mut Self {
        let (answer, (index, sub)) = (self.write(object, value), object.place());
        assert_eq!(answer, Err(code), "{index:04X}h:{sub:02X} = {value:X}h: {answer:08X?}, expected {code:08X}h");
        self
    }

    /// Asserts that an SDO request gets this answer.
    #[track_caller]
    pub fn answers(&mut self, request: [u8; 8], answer: [u8; 8]) -> &mut Self {
        assert_eq!(self.sdo(&request), Some(answer), "to {request:02X?}");
        self
    }

    /// Asserts that no node answers an SDO request.
    #[track_caller]
    pub fn is_silent(&mut self) -> &mut Self {
        assert_eq!(self.sdo(&head(0x40, 0x6041, 0)), None, "at {} s", self.seconds());
        self
    }

    /// Asserts that the motor turns at this speed, r/min, give or take.
    #[track_caller]
    pub fn turns_about(&mut self, rpm: f64, tolerance_rpm: f64) -> &mut Self {
        self.turns_at(rpm - tolerance_rpm, rpm + tolerance_rpm)
    }

    /// Asserts that 6064h reads this, give or take.
    #[track_caller]
    pub fn is_at(&mut self, position: i64, tolerance: i64) -> &mut Self {
        let (read, at) = (self.get(0x6064), self.seconds());
        assert!((read - position).abs() <= tolerance, "6064h is {read}, expected {position} ± {tolerance}, at {at} s");
        self
    }

    /// Runs until `done`, looking every `step`; the seconds that it took.
    #[track_caller]
    pub fn seconds_until(&mut self, limit_s: f64, step: Duration, mut done: impl FnMut(&Report) -> bool) -> f64 {
        let start = self.seconds();
        loop {
            let report = self.report();
            if done(&report) {
                return self.seconds() - start;
            }
            assert!(self.seconds() - start < limit_s, "not within {limit_s} s: {report:?}");
            self.run(step);
        }
    }

    /// Milliseconds until `done`, which may ask the drive; panics after `limit_ms`.
    #[track_caller]
    pub fn until(&mut self, limit_ms: u64, mut done: impl FnMut(&mut Self) -> bool) -> u64 {
        for ms in 0..limit_ms {
            if done(self) {
                return ms;
            }
            self.run_ms(1);
        }
        panic!("not within {limit_ms} ms: statusword {:04X}h, {:?}", self.statusword(), self.report());
    }
}

/// Asserts that a value lies within bounds on both sides.
#[track_caller]
pub fn assert_within(what: &str, value: f64, low: f64, high: f64) {
    assert!((low..=high).contains(&value), "{what} is {value}, expected {low} to {high}");
}
