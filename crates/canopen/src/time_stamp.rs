//! TIME (CiA 301, 7.2.6): the frame that tells the time of day. No drive here consumes it.

use can::{CanId, Frame};

/// TIME_OF_DAY. Source: CiA 301, 7.1.6.5.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TimeOfDay {
    /// Milliseconds after midnight, 28 bits.
    pub millis: u32,
    /// Days since 1 January 1984.
    pub days: u16,
}

const MILLIS_MASK: u32 = 0x0FFF_FFFF;

impl TimeOfDay {
    /// Reads a frame of at least six bytes; `None` for a shorter one. The identifier is the caller's to check.
    pub fn parse(frame: &Frame) -> Option<Self> {
        let [a, b, c, d, e, f, ..] = frame.data() else { return None };
        let millis = u32::from_le_bytes([*a, *b, *c, *d]) & MILLIS_MASK;
        Some(Self { millis, days: u16::from_le_bytes([*e, *f]) })
    }

    /// The frame on `id`. Milliseconds beyond 28 bits are dropped.
    pub fn emit(self, id: CanId) -> Frame {
        let [a, b, c, d] = (self.millis & MILLIS_MASK).to_le_bytes();
        let [e, f] = self.days.to_le_bytes();
        Frame::new(id, &[a, b, c, d, e, f])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::connection_set;

    #[test]
    fn what_is_emitted_is_parsed_back() {
        // Noon of 2 January 1984.
        let time = TimeOfDay { millis: 43_200_000, days: 1 };
        let frame = time.emit(connection_set::TIME);
        assert_eq!(frame, "100#002E93020100".parse().unwrap());
        assert_eq!(TimeOfDay::parse(&frame), Some(time));
        assert_eq!(TimeOfDay::parse(&"100#002E930201".parse().unwrap()), None);
    }
}
