//! At which points two drives of these models may differ.

use crate::variant::{Choice, Pick, Trust, Variant, Variation, VariationKind};

/// All of them.
pub const VARIATIONS: &[Variation] = &[Variation {
    key: "J047",
    kind: VariationKind::Reading,
    section: "5.04, 6078h and 261Dh",
    about: "what their amperes count",
    choices: &[
        Choice::new("rms", "the r.m.s. current of a phase, as the rated current of the table", Trust::Guess),
        Choice::new("amplitude", "its amplitude, as a drive measures it", Trust::Guess),
    ],
}];

/// The first choice of each.
pub const VARIANT: Variant = Variant::first_of(VARIATIONS);

const COUNTS_AMPLITUDE: Pick = Pick::of(VARIATIONS, "J047", "amplitude");

/// Amplitude of a phase's current for each ampere of 261Dh and 6078h.
pub(super) const fn amplitude_per_a(variant: &Variant) -> f32 {
    if variant.is(COUNTS_AMPLITUDE) { 1.0 } else { core::f32::consts::SQRT_2 }
}
