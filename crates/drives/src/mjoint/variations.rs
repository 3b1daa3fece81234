//! What the choices of a drive mean to its firmware; the points at which drives may differ are those of the description.

use devices::mjoint::variations::VARIATIONS;
use devices::variant::{Pick, Variant};

/// The first choice of each.
pub const VARIANT: Variant = Variant::first_of(VARIATIONS);

/// It is of the edition with objects of its own.
pub(super) const FIRMWARE_1_66: Pick = Pick::of(VARIATIONS, "firmware", "1.66");
/// The joint stays free at power-on.
pub(super) const STAYS_FREE: Pick = Pick::of(VARIATIONS, "J005", "free");
/// 2600h forbids no access.
pub(super) const FORBIDS_NOTHING: Pick = Pick::of(VARIATIONS, "J037", "nothing");
/// Homing's origin is at the switch's edge.
pub(super) const ORIGIN_AT_EDGE: Pick = Pick::of(VARIATIONS, "J113", "edge");
const COUNTS_AMPLITUDE: Pick = Pick::of(VARIATIONS, "J047", "amplitude");

/// Amplitude of a phase's current for each ampere of 261Dh and 6078h.
pub(super) const fn amplitude_per_a(variant: &Variant) -> f32 {
    if variant.is(COUNTS_AMPLITUDE) { 1.0 } else { core::f32::consts::SQRT_2 }
}
