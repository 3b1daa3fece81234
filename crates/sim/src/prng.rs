//! The only source of chance in a world.

/// Seeded pseudo-random numbers: SplitMix64.
///
/// State `s += 9E3779B97F4A7C15h`, then two xor-shift-multiply rounds over `s` (Steele, Lea, Flood:
/// "Fast Splittable Pseudorandom Number Generators", OOPSLA 2014). The period is 2^64; good enough
/// for faults, no good for secrets.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Prng(u64);

impl Prng {
    /// The sequence that belongs to `seed`.
    pub const fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// The next 64 bits.
    pub fn next_u64(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Uniform in `0..bound`; 0 if `bound` is 0. By the high half of a 128-bit product.
    pub fn below(&mut self, bound: u64) -> u64 {
        ((u128::from(self.next_u64()) * u128::from(bound)) >> 64) as u64
    }

    /// True with `probability` (0 never, 1 always).
    pub fn chance(&mut self, probability: f64) -> bool {
        // 53 bits fill a double's mantissa exactly: uniform in [0, 1).
        let uniform = (self.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
        uniform < probability
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gives_the_published_sequence_of_seed_1234567() {
        // Vector of the reference implementation (Vigna, splitmix64.c), widely reproduced.
        let mut prng = Prng::new(1_234_567);
        let first: Vec<u64> = (0..5).map(|_| prng.next_u64()).collect();
        assert_eq!(
            first,
            [
                6_457_827_717_110_365_317,
                3_203_168_211_198_807_973,
                9_817_491_932_198_370_423,
                4_593_380_528_125_082_431,
                16_408_922_859_458_223_821
            ]
        );
    }

    #[test]
    fn chance_never_at_zero_and_always_at_one() {
        let mut prng = Prng::new(7);
        assert!((0..1_000).all(|_| !prng.chance(0.0)));
        assert!((0..1_000).all(|_| prng.chance(1.0)));
        let hits = (0..100_000).filter(|_| prng.chance(0.25)).count();
        assert!((24_000..26_000).contains(&hits), "{hits}");
        assert!((0..1_000).all(|_| prng.below(7) < 7));
        assert_eq!(prng.below(0), 0);
    }
}
