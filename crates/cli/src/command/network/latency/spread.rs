//! Many times as a few figures.

use std::time::Duration;

use hdrhistogram::Histogram;
use serde::Serialize;

/// Bars of a histogram.
const BINS: u64 = 16;

/// Times, counted in classes that are 0.1 % wide: however many there are, the memory stays.
#[derive(Clone, Debug)]
pub(super) struct Times {
    counts: Histogram<u64>,
    lost: u64,
}

/// What came of [`Times`], in µs.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Spread {
    pub(super) count: u64,
    /// Answers that did not come.
    pub(super) lost: u64,
    pub(super) min_us: f64,
    pub(super) median_us: f64,
    pub(super) p99_us: f64,
    pub(super) p999_us: f64,
    pub(super) max_us: f64,
    /// Bars of equal width from the least to the 99.9 %; the last one reaches to the most.
    pub(super) histogram: Vec<Bin>,
}

/// A bar.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct Bin {
    pub(super) from_us: f64,
    pub(super) to_us: f64,
    pub(super) count: u64,
}

impl Default for Times {
    fn default() -> Self {
        // From 1 ns, with three figures; grows with the longest time.
        let counts = Histogram::new(3).expect("three figures are between 0 and 5");
        Self { counts, lost: 0 }
    }
}

impl Times {
    pub(super) fn record(&mut self, time: Duration) {
        let nanos = u64::try_from(time.as_nanos()).unwrap_or(u64::MAX / 2);
        // Fails only where the histogram may not grow.
        let _ = self.counts.record(nanos);
    }

    pub(super) fn lose(&mut self) {
        self.lost += 1;
    }

    pub(super) fn count(&self) -> u64 {
        self.counts.len()
    }

    /// The figures; `None` where nothing was measured.
    pub(super) fn spread(&self) -> Option<Spread> {
        if self.counts.is_empty() && self.lost == 0 {
            return None;
        }
        let micros = |nanos: u64| nanos as f64 / 1e3;
        let at = |part: f64| micros(self.counts.value_at_quantile(part));
        Some(Spread {
            count: self.counts.len(),
            lost: self.lost,
            min_us: micros(self.counts.min()),
            median_us: at(0.5),
            p99_us: at(0.99),
            p999_us: at(0.999),
            max_us: micros(self.counts.max()),
            histogram: self.bins(),
        })
    }

    fn bins(&self) -> Vec<Bin> {
        let (min, max) = (self.counts.min(), self.counts.max());
        let top = self.counts.value_at_quantile(0.999).max(min + 1);
        // No finer than the resolution of the times.
        let width = (top - min).div_ceil(BINS).max(top / 500).max(1);
        let mut bins: Vec<Bin> = (0..BINS)
            .map(|place| min + place * width)
            .take_while(|from| *from <= max)
            .map(|from| Bin { from_us: from as f64 / 1e3, to_us: (from + width) as f64 / 1e3, count: 0 })
            .collect();
        for value in self.counts.iter_recorded() {
            let place = (value.value_iterated_to().saturating_sub(min) / width) as usize;
            if let Some(last) = bins.len().checked_sub(1) {
                bins[place.min(last)].count += value.count_at_value();
            }
        }
        if let Some(last) = bins.last_mut() {
            last.to_us = last.to_us.max(max as f64 / 1e3);
        }
        bins
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 1 to 1000 µs: the quantiles are known.
    #[test]
    fn figures_are_those_of_an_even_spread() {
        let mut times = Times::default();
        (1..=1000).for_each(|micros| times.record(Duration::from_micros(micros)));
        times.lose();
        let spread = times.spread().unwrap();
        assert_eq!((spread.count, spread.lost), (1000, 1));
        for (figure, expected) in [
            (spread.min_us, 1.0),
            (spread.median_us, 500.0),
            (spread.p99_us, 990.0),
            (spread.p999_us, 999.0),
            (spread.max_us, 1000.0),
        ] {
            assert!((figure - expected).abs() <= expected * 0.002, "{figure} for {expected}");
        }
        assert_eq!(spread.histogram.iter().map(|bin| bin.count).sum::<u64>(), 1000);
        assert!(spread.histogram.iter().all(|bin| (55..=70).contains(&bin.count)), "{:?}", spread.histogram);
    }

    #[test]
    fn a_far_value_stands_in_the_last_bar() {
        let mut times = Times::default();
        (0..9_999).for_each(|place| times.record(Duration::from_micros(100 + place % 10)));
        times.record(Duration::from_secs(1));
        let spread = times.spread().unwrap();
        let last = spread.histogram.last().unwrap();
        assert!(last.to_us >= 999_000.0 && spread.p999_us < 120.0 && spread.histogram.len() > 8, "{spread:?}");
    }

    #[test]
    fn nothing_is_nothing_and_one_is_one() {
        assert!(Times::default().spread().is_none());
        let mut one = Times::default();
        one.record(Duration::from_micros(7));
        let spread = one.spread().unwrap();
        assert_eq!(spread.histogram.iter().map(|bin| bin.count).sum::<u64>(), 1);
        let mut lost = Times::default();
        lost.lose();
        assert_eq!(lost.spread().unwrap().lost, 1);
    }
}
