//! A short number for a whole run, for golden tests.

use can::{Frame, Instant};

/// A running FNV-1a hash (64 bits) over what a world did: equal digests, equal runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Digest(u64);

const OFFSET_BASIS: u64 = 0xCBF2_9CE4_8422_2325;
const PRIME: u64 = 0x0000_0100_0000_01B3;

impl Digest {
    /// The hash of these bytes.
    pub fn of(bytes: &[u8]) -> Self {
        let mut digest = Self::default();
        digest.bytes(bytes);
        digest
    }

    /// The hash of all that was added so far: two runs that are alike have the same.
    pub fn value(self) -> u64 {
        self.0
    }

    pub(super) fn bytes(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.0 = (self.0 ^ u64::from(*byte)).wrapping_mul(PRIME);
        }
    }

    /// A frame and the time of its last bit.
    pub(super) fn frame(&mut self, frame: &Frame, at: Instant) {
        self.bytes(&at.as_nanos().to_le_bytes());
        self.bytes(&frame.id().raw().to_le_bytes());
        self.bytes(&[u8::from(frame.id().is_extended()) | u8::from(frame.is_remote()) << 1, frame.dlc()]);
        self.bytes(frame.data());
    }
}

impl Default for Digest {
    fn default() -> Self {
        Self(OFFSET_BASIS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_the_published_vectors_of_fnv_1a() {
        for (text, hash) in
            [("", 0xCBF2_9CE4_8422_2325u64), ("a", 0xAF63_DC4C_8601_EC8C), ("foobar", 0x8594_4171_F739_67E8)]
        {
            assert_eq!(Digest::of(text.as_bytes()).value(), hash, "{text:?}");
        }
    }
}
