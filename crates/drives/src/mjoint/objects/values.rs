//! Listed values of objects, with what they mean.

/// A list of values.
pub(super) type Values = &'static [(i64, &'static str)];

/// 2600h, 2601h, 2609h.
pub(super) const OFF_ON: Values = &[(0, "forbidden"), (1, "enabled")];

/// 6060h.
pub(super) const MODES: Values =
    &[(1, "position mode"), (3, "speed mode"), (6, "origin finding"), (7, "motion interpolation")];
