//! What the choices of a drive mean to its firmware; the points at which drives may differ are those of the description.

use devices::variant::{Pick, Variant};
use devices::zltech::zlim42c::variations::VARIATIONS;

/// The first choice of each.
pub const VARIANT: Variant = Variant::first_of(VARIATIONS);

/// Faults stay until the supply goes.
pub(super) const FAULTS_STAY: Pick = Pick::of(VARIATIONS, "Z010", "power-cycle");

/// Homing goes the ways of the paragraphs.
pub(super) const HOMING_BY_PROSE: Pick = Pick::of(VARIATIONS, "Z050", "prose");

/// An emergency stop without a ramp.
pub(super) const EMERGENCY_BRAKE: Pick = Pick::of(VARIATIONS, "Z092", "brake");

/// An emergency stop that lets the motor coast.
pub(super) const EMERGENCY_COAST: Pick = Pick::of(VARIATIONS, "Z092", "coast");
