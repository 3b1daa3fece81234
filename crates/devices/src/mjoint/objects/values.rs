//! Listed values of objects, with what they mean.

use crate::row::Values;

/// 2600h, 2601h.
pub(super) const OFF_ON: Values = &[(0, "forbidden"), (1, "enabled")];

/// 2609h.
pub(super) const DIR_POLARITY: Values =
    &[(0, "clockwise while DIR does not conduct"), (1, "clockwise while DIR conducts")];

/// 6060h.
pub(super) const MODES: Values =
    &[(1, "position mode"), (3, "speed mode"), (6, "origin finding"), (7, "motion interpolation")];
