//! What the tests of several modules share: seeded random bytes and frames, and streams cut at random points.

use can::{CanId, Frame};

/// A seeded generator (splitmix64).
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed)
    }

    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mixed = (self.0 ^ self.0 >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ mixed >> 31
    }

    pub(crate) fn below(&mut self, limit: usize) -> usize {
        (self.next() % limit as u64) as usize
    }

    pub(crate) fn frame(&mut self) -> Frame {
        let bits = self.next();
        let id = if bits & 1 == 0 { CanId::standard(self.next() as u16) } else { CanId::extended(self.next() as u32) };
        let length = self.below(9);
        match bits & 6 {
            0 => Frame::remote(id, length as u8),
            _ => Frame::new(id, &self.next().to_le_bytes()[..length]),
        }
    }

    /// Up to `count` pieces, each one of `words` or, one time in eight, a random byte.
    pub(crate) fn salad(&mut self, words: &[&[u8]], count: usize) -> Vec<u8> {
        let mut bytes = Vec::new();
        for _ in 0..self.below(count + 1) {
            match self.below(8) {
                0 => bytes.push(self.next() as u8),
                _ => bytes.extend_from_slice(words[self.below(words.len())]),
            }
        }
        bytes
    }
}

/// Everything that `next` finds in `bytes`, which it gets whole and then again cut at random points: both must agree.
pub(crate) fn all<T: PartialEq + std::fmt::Debug>(
    bytes: &[u8],
    mut next: impl FnMut(&mut &[u8]) -> Option<T>,
) -> Vec<T> {
    let mut pull = |mut input: &[u8], found: &mut Vec<T>| {
        while let Some(item) = next(&mut input) {
            found.push(item);
        }
        assert!(input.is_empty(), "input left over");
    };
    let mut whole = Vec::new();
    pull(bytes, &mut whole);
    let mut random = Random::new(bytes.len() as u64);
    let mut cut = Vec::new();
    let mut rest = bytes;
    while !rest.is_empty() {
        let (head, tail) = rest.split_at(1 + random.below(rest.len()).min(random.below(12)));
        pull(head, &mut cut);
        rest = tail;
    }
    assert_eq!(whole, cut, "the same bytes cut differently");
    whole
}
