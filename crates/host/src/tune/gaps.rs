//! Samples that did not come in their cycle. A lone one is put between its neighbours: a desktop that is late once in some seconds, or
//! a frame that was repeated, is not why a drive cannot be measured. More of them would be made up, and no measurement.

use tune::Samples;

/// Samples in a row that may be missing: a drive whose set-points stay away for more cycles is stopped anyway.
const IN_A_ROW: u64 = 2;
/// Samples from one gap to the next, at least: what is missing more often has a cause that lasts, such as a period that is too short.
const APART: u64 = 1000;

/// What is missing of the samples of a measurement.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Gaps {
    /// The cycle of the last sample.
    cycle: Option<u64>,
    /// Set-points whose time has passed.
    passed: usize,
    /// How many are missing in a row now.
    in_a_row: u64,
    /// How many came since the last gap; `None` before the first one.
    since: Option<u64>,
    filled: usize,
}

impl Gaps {
    /// Other samples follow, not those of the next cycle.
    pub(super) fn begin(&mut self) {
        (self.cycle, self.passed, self.in_a_row) = (None, 0, 0);
    }

    /// How many cycles have passed unseen since the last one; this is the next.
    pub(super) fn cycles_before(&mut self, cycle: Option<u64>) -> u64 {
        let unseen = self.cycle.zip(cycle).map_or(0, |(before, now)| now.saturating_sub(before + 1));
        self.cycle = cycle;
        unseen
    }

    /// How many set-points are to be left out, for their time has passed.
    pub(super) fn late(&mut self) -> usize {
        std::mem::take(&mut self.passed)
    }

    /// How many were put between their neighbours.
    pub(super) const fn filled(&self) -> usize {
        self.filled
    }

    /// Takes what came in a cycle, current and position, after so many that were not seen, in which the drive kept the set-point before.
    /// `None` where too much is missing.
    pub(super) fn take(
        &mut self,
        samples: &mut Samples,
        unseen: u64,
        (set_point_rad_s, shown): (f64, Option<(f64, f64)>),
    ) -> Option<()> {
        let kept = *samples.set_point_rad_s.last().unwrap_or(&set_point_rad_s);
        let unseen = (0..unseen.min(IN_A_ROW + 1)).map(|_| (kept, true));
        for (set_point, is_late) in unseen.chain(shown.is_none().then_some((set_point_rad_s, false))) {
            let begins_too_soon = self.in_a_row == 0 && self.since.is_some_and(|since| since < APART);
            self.in_a_row += 1;
            let is_lone = self.in_a_row <= IN_A_ROW && !begins_too_soon;
            let last = samples.len().checked_sub(1).filter(|_| is_lone)?;
            // Until the next one comes.
            samples.push(set_point, samples.current_a[last], samples.position_rad[last]);
            (self.filled, self.passed) = (self.filled + 1, self.passed + usize::from(is_late));
            self.since = Some(0);
        }
        let Some((current_a, position_rad)) = shown else { return Some(()) };
        samples.push(set_point_rad_s, current_a, position_rad);
        self.since = self.since.map(|since| since + 1);
        match std::mem::take(&mut self.in_a_row) {
            0 => {}
            count => fill(samples, count as usize),
        }
        Some(())
    }
}

/// Puts the samples before the last one, so many, on the line from the one before them to it.
fn fill(samples: &mut Samples, count: usize) {
    let end = samples.len() - 1;
    let begin = end - count - 1;
    for values in [&mut samples.current_a, &mut samples.position_rad] {
        let (from, to) = (values[begin], values[end]);
        for place in 1..=count {
            values[begin + place] = from + (to - from) * place as f64 / (count + 1) as f64;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The positions of 0.1, 0.2 and so on that came in these cycles; `None` where too much is missing.
    fn positions(cycles: impl IntoIterator<Item = (u64, bool)>) -> Option<(Vec<f64>, usize, usize)> {
        let (mut gaps, mut samples) = (Gaps::default(), Samples { period_s: 1e-3, ..Samples::default() });
        for (cycle, is_shown) in cycles {
            let unseen = gaps.cycles_before(Some(cycle));
            gaps.take(&mut samples, unseen, (cycle as f64, is_shown.then_some((1.0, cycle as f64 / 10.0))))?;
        }
        Some((samples.position_rad, gaps.filled(), gaps.late()))
    }

    #[test]
    fn a_lone_sample_is_put_between_its_neighbours_and_its_set_point_is_left_out() {
        let near = |found: Vec<f64>, expected: &[f64]| {
            assert!(
                found.len() == expected.len() && found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12),
                "{found:?}"
            );
        };
        // The drive's TPDO stayed away.
        let (found, filled, late) = positions([(1, true), (2, false), (3, true)]).unwrap();
        near(found, &[0.1, 0.2, 0.3]);
        assert_eq!((filled, late), (1, 0));
        // The program was late by a cycle: what was to be asked for in it has passed.
        let (found, filled, late) = positions([(1, true), (2, true), (4, true)]).unwrap();
        near(found, &[0.1, 0.2, 0.3, 0.4]);
        assert_eq!((filled, late), (1, 1));
    }

    #[test]
    fn more_than_a_lone_one_is_too_much() {
        assert!(positions([(1, false)]).is_none(), "there is nothing to put it between");
        let some = |lost: &dyn Fn(u64) -> bool| positions((1..=3000).map(|cycle| (cycle, !lost(cycle))));
        let each = |cycles: u64| some(&|cycle| cycle % cycles == 0).map(|(found, filled, _)| (found.len(), filled));
        assert_eq!(each(1100), Some((3000, 2)));
        assert_eq!(each(900), None, "too often");
        let in_a_row = |count: u64| some(&|cycle| (500..500 + count).contains(&cycle)).map(|(_, filled, _)| filled);
        assert_eq!((in_a_row(2), in_a_row(3)), (Some(2), None));
        // Of the set-points of a program that was late for 3 cycles.
        assert!(positions([(1, true), (2, true), (6, true)]).is_none());
    }
}
