//! Seeded input for property tests: the same bytes in each run, other bytes for another seed.
//!
//! `FERRODRIVE_SEED=123 cargo test -p ferrodrive-tests` tries other input; a failure prints the seed that it needs.

/// How many inputs a property test tries, unless its law takes long.
pub const RUNS: u64 = 20_000;

/// A small generator (SplitMix64). Not for secrets.
#[derive(Debug, Clone)]
pub struct Seeded(u64);

impl Seeded {
    /// A generator that gives the same sequence for the same seed.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// The next 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ (mixed >> 31)
    }

    /// A number below `limit`, which must not be 0.
    pub fn below(&mut self, limit: usize) -> usize {
        usize::try_from(self.bits() % limit as u64).unwrap_or_default()
    }

    /// Up to `limit` bytes of any value.
    pub fn bytes(&mut self, limit: usize) -> Vec<u8> {
        let length = self.below(limit + 1);
        (0..length).map(|_| self.bits().to_le_bytes()[0]).collect()
    }

    /// One of `samples`, or two in a row, now and then damaged: a byte changed, dropped, doubled, or the tail cut off.
    pub fn damaged(&mut self, samples: &[&[u8]]) -> Vec<u8> {
        let mut bytes = samples[self.below(samples.len())].to_vec();
        if self.below(4) == 0 {
            bytes.extend_from_slice(samples[self.below(samples.len())]);
        }
        for _ in 0..self.below(4) {
            if bytes.is_empty() {
                break;
            }
            let at = self.below(bytes.len());
            match self.below(4) {
                0 => bytes[at] = self.bits().to_le_bytes()[0],
                1 => drop(bytes.remove(at)),
                2 => bytes.insert(at, bytes[at]),
                _ => bytes.truncate(at),
            }
        }
        bytes
    }
}

/// Calls `law` with input from as many seeds as there are `runs`, half of it random and half damaged samples.
pub fn check(runs: u64, samples: &[&[u8]], law: impl Fn(&[u8]) + std::panic::RefUnwindSafe) {
    let first = std::env::var("FERRODRIVE_SEED").ok().and_then(|seed| seed.parse().ok()).unwrap_or(1);
    for seed in first..first + runs {
        let mut seeded = Seeded::new(seed);
        let input = if seed % 2 == 0 { seeded.bytes(96) } else { seeded.damaged(samples) };
        if let Err(panic) = std::panic::catch_unwind(|| law(&input)) {
            let text = String::from_utf8_lossy(&input);
            let message = panic.downcast_ref::<String>().map_or("a panic", String::as_str);
            panic!("FERRODRIVE_SEED={seed} input {input:02X?} {text:?}: {message}");
        }
    }
}
