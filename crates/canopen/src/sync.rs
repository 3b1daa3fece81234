//! SYNC (CiA 301, 7.2.5): the frame that starts a synchronous cycle.

use can::{CanId, Frame};

/// A SYNC frame; its identifier is that of 1005h.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sync {
    /// The counter, 1 to 240, if the producer counts (1019h).
    pub counter: Option<u8>,
}

impl Sync {
    /// Reads the payload of a SYNC frame. Any length is a SYNC: a counter may be there whether or not it is expected.
    pub fn parse(frame: &Frame) -> Self {
        Self { counter: frame.data().first().copied() }
    }

    /// The frame on `id`.
    pub fn emit(self, id: CanId) -> Frame {
        match self.counter {
            Some(counter) => Frame::new(id, &[counter]),
            None => Frame::new(id, &[]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::connection_set;

    #[test]
    fn what_is_emitted_is_parsed_back() {
        for sync in [Sync { counter: None }, Sync { counter: Some(1) }, Sync { counter: Some(240) }] {
            assert_eq!(Sync::parse(&sync.emit(connection_set::SYNC)), sync);
        }
    }
}
