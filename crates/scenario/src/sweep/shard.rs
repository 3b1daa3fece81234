//! Parts of a sweep that are made apart from each other: by other processes, on other machines.

use std::fmt;
use std::str::FromStr;

/// The `index`-th of `count` parts, from 1 on: the runs `index - 1`, `index - 1 + count` and so on. Each part meets each value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    index: u64,
    count: u64,
}

impl Shard {
    /// All runs in one.
    pub const WHOLE: Self = Self { index: 1, count: 1 };

    /// One of `count` parts; `None` if there is no such part.
    pub fn new(index: u64, count: u64) -> Option<Self> {
        (1..=count).contains(&index).then_some(Self { index, count })
    }

    /// Which part, from 1 on.
    pub fn index(self) -> u64 {
        self.index
    }

    /// How many parts there are.
    pub fn count(self) -> u64 {
        self.count
    }

    /// How many of so many runs are its.
    pub fn share(self, runs: u64) -> u64 {
        runs.saturating_sub(self.index - 1).div_ceil(self.count)
    }

    /// The number in the sweep of its `nth` run, both from 0 on.
    pub fn number(self, nth: u64) -> u64 {
        self.index - 1 + nth * self.count
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.split_once('/').and_then(|(index, count)| Some((index.parse().ok()?, count.parse().ok()?)));
        let shard = parts.and_then(|(index, count)| Self::new(index, count));
        shard.ok_or_else(|| format!("expected I/N with I from 1 to N, e.g. 3/8 for the third of eight, got '{text}'"))
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn the_parts_have_each_run_once_however_many_they_are() {
        for runs in 1..=20 {
            for count in 1..=25 {
                let shards = (1..=count).filter_map(|index| Shard::new(index, count));
                let numbers: Vec<u64> =
                    shards.flat_map(|shard| (0..shard.share(runs)).map(move |nth| shard.number(nth))).collect();
                let once: BTreeSet<u64> = numbers.iter().copied().collect();
                assert_eq!((numbers.len() as u64, once), (runs, (0..runs).collect()), "{runs} runs in {count}");
            }
        }
    }

    #[test]
    fn a_part_is_written_as_i_of_n() {
        assert_eq!("3/8".parse(), Ok(Shard { index: 3, count: 8 }));
        assert_eq!(Shard::WHOLE.to_string(), "1/1");
        for wrong in ["", "3", "0/8", "9/8", "0/0", "a/8", "3/8/1", "-1/2"] {
            assert!(wrong.parse::<Shard>().is_err_and(|reason| reason.contains("3/8")), "{wrong}");
        }
    }
}
