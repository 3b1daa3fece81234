use devices::AxisId;

use crate::SwitchRange;

/// What the digital inputs of a drive are wired to: levels that a command sets, low when nothing is connected, and
/// switches beside the shaft.
#[derive(Clone, Debug, Default)]
pub(super) struct Inputs {
    levels: u64,
    switches: Vec<Switch>,
}

/// A switch beside a shaft.
#[derive(Clone, Copy, Debug)]
struct Switch {
    input: usize,
    axis: AxisId,
    range: SwitchRange,
}

impl Inputs {
    /// Sets the level at input `n`; removes a switch tied to it.
    pub(super) fn set(&mut self, n: usize, level: bool) {
        self.switches.retain(|switch| switch.input != n);
        self.levels = self.levels & !(1 << n) | u64::from(level) << n;
    }

    /// Ties input `n` to a switch that is high while the shaft of an axis is in a stretch of its own counts.
    pub(super) fn tie(&mut self, n: usize, axis: AxisId, range: SwitchRange) {
        self.set(n, false);
        self.switches.push(Switch { input: n, axis, range });
    }

    /// Bit `n` is the level of input `n` while the shafts are at these counts.
    #[inline]
    pub(super) fn levels(&self, shaft_counts: impl Fn(AxisId) -> i64) -> u64 {
        let high = |switch: &Switch| u64::from(switch.range.contains(shaft_counts(switch.axis))) << switch.input;
        self.switches.iter().map(high).fold(self.levels, |levels, level| levels | level)
    }
}

/// The stretch of the shaft's own counts of a switch at `range` of a drive that now shows `position` while its shaft is at
/// `shaft`, `scale` of whose counts are one of the drive's. A bound takes in the half of a drive's count beyond it.
pub(super) fn stretch(range: SwitchRange, position: i64, shaft: i64, scale: i64, reversed: bool) -> SwitchRange {
    let place = |at: i64, margin: i64| {
        let way = at.saturating_sub(position).saturating_mul(scale).saturating_add(margin);
        shaft.saturating_add(if reversed { way.saturating_neg() } else { way })
    };
    let margin = scale / 2;
    let (low, high) = (range.low.map(|at| place(at, -margin)), range.high.map(|at| place(at, margin)));
    if reversed { SwitchRange { low: high, high: low } } else { SwitchRange { low, high } }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RANGE: SwitchRange = SwitchRange { low: Some(-50), high: Some(-40) };

    fn is_high(stretch: SwitchRange, shaft: i64) -> bool {
        let mut inputs = Inputs::default();
        inputs.tie(1, AxisId::FIRST, stretch);
        inputs.levels(|_| shaft) == 2
    }

    #[test]
    fn a_switch_stays_where_it_is_when_the_drive_zeroes_its_position() {
        // The drive shows 100 with the shaft at 1000: -50..-40 is 850..860 of the shaft for ever.
        let switch = stretch(RANGE, 100, 1000, 1, false);
        for (shaft, level) in [(849, false), (850, true), (860, true), (861, false)] {
            assert_eq!(is_high(switch, shaft), level, "{shaft}");
        }
    }

    #[test]
    fn a_drive_that_counts_backwards_has_its_switch_on_the_other_side() {
        let switch = stretch(RANGE, 100, 1000, 1, true);
        for (shaft, level) in [(1139, false), (1140, true), (1150, true), (1151, false)] {
            assert_eq!(is_high(switch, shaft), level, "{shaft}");
        }
    }

    #[test]
    fn finer_shaft_counts_round_to_those_of_the_drive() {
        let switch = stretch(SwitchRange { low: Some(2), high: Some(3) }, 0, 0, 10, false);
        for (shaft, level) in [(14, false), (15, true), (35, true), (36, false)] {
            assert_eq!(is_high(switch, shaft), level, "{shaft}");
        }
    }

    #[test]
    fn an_open_end_reaches_for_ever_in_the_drives_direction() {
        let range = SwitchRange { low: Some(0), high: None };
        assert!(is_high(stretch(range, 0, 0, 1, false), i64::MAX));
        assert!(is_high(stretch(range, 0, 0, 1, true), i64::MIN));
        assert!(!is_high(stretch(range, 0, 0, 1, true), 1));
    }
}
