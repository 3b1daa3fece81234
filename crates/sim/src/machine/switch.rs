use crate::SwitchRange;

/// What a digital input of a drive is wired to.
#[derive(Clone, Copy, Debug)]
pub(super) enum Input {
    /// A level that somebody sets; low when nothing is connected.
    Level(bool),
    /// A switch beside the shaft: high while the shaft is in this stretch of its own counts.
    Switch(SwitchRange),
}

impl Default for Input {
    fn default() -> Self {
        Self::Level(false)
    }
}

impl Input {
    /// A switch at `range` of a drive that now shows `position` while its shaft is at `shaft`, `scale` of whose counts
    /// are one of the drive's. A bound takes in the half of a drive's count beyond it.
    pub(super) fn switch(range: SwitchRange, position: i64, shaft: i64, scale: i64, reversed: bool) -> Self {
        let place = |at: i64, margin: i64| {
            let way = at.saturating_sub(position).saturating_mul(scale).saturating_add(margin);
            shaft.saturating_add(if reversed { way.saturating_neg() } else { way })
        };
        let margin = scale / 2;
        let (low, high) = (range.low.map(|at| place(at, -margin)), range.high.map(|at| place(at, margin)));
        Self::Switch(if reversed { SwitchRange { low: high, high: low } } else { SwitchRange { low, high } })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RANGE: SwitchRange = SwitchRange { low: Some(-50), high: Some(-40) };

    fn is_high(input: Input, shaft: i64) -> bool {
        matches!(input, Input::Switch(range) if range.contains(shaft))
    }

    #[test]
    fn a_switch_stays_where_it_is_when_the_drive_zeroes_its_position() {
        // The drive shows 100 with the shaft at 1000: -50..-40 is 850..860 of the shaft for ever.
        let switch = Input::switch(RANGE, 100, 1000, 1, false);
        for (shaft, level) in [(849, false), (850, true), (860, true), (861, false)] {
            assert_eq!(is_high(switch, shaft), level, "{shaft}");
        }
    }

    #[test]
    fn a_drive_that_counts_backwards_has_its_switch_on_the_other_side() {
        let switch = Input::switch(RANGE, 100, 1000, 1, true);
        for (shaft, level) in [(1139, false), (1140, true), (1150, true), (1151, false)] {
            assert_eq!(is_high(switch, shaft), level, "{shaft}");
        }
    }

    #[test]
    fn finer_shaft_counts_round_to_those_of_the_drive() {
        let switch = Input::switch(SwitchRange { low: Some(2), high: Some(3) }, 0, 0, 10, false);
        for (shaft, level) in [(14, false), (15, true), (35, true), (36, false)] {
            assert_eq!(is_high(switch, shaft), level, "{shaft}");
        }
    }

    #[test]
    fn an_open_end_reaches_for_ever_in_the_drives_direction() {
        let range = SwitchRange { low: Some(0), high: None };
        assert!(is_high(Input::switch(range, 0, 0, 1, false), i64::MAX));
        assert!(is_high(Input::switch(range, 0, 0, 1, true), i64::MIN));
        assert!(!is_high(Input::switch(range, 0, 0, 1, true), 1));
    }
}
