//! What the choices of a drive mean to its firmware; the points at which drives may differ are those of the description.

use devices::variant::{Pick, Variant};
use devices::zltech::zlac8030l::variations::VARIATIONS;

/// The first choice of each.
pub const VARIANT: Variant = Variant::first_of(VARIATIONS);

/// It has 202Fh:06, and a target velocity above 200Ah is a fault.
pub(super) const FIRMWARE_2_01: Pick = Pick::of(VARIATIONS, "firmware", "2.01");

/// The fast winding is wired to it.
pub const FAST_MOTOR: Pick = Pick::of(VARIATIONS, "motor", "fast");

/// An external stop that releases the shaft leaves operation enabled.
pub(super) const STOPPED_ENABLED: Pick = Pick::of(VARIATIONS, "L039", "enabled");

/// SYNC keeps the watch over the host quiet.
pub(super) const SYNC_FEEDS_WATCHDOG: Pick = Pick::of(VARIATIONS, "L083", "sync");

/// A save does not keep the mode.
pub(super) const MODE_NOT_SAVED: Pick = Pick::of(VARIATIONS, "L090", "marked");

/// Nothing below 2012h is overload.
pub(super) const OVERLOAD_FROM_FACTOR: Pick = Pick::of(VARIATIONS, "L101", "factor");

/// An emergency stop takes the ramp of 6085h.
pub(super) const EMERGENCY_RAMP: Pick = Pick::of(VARIATIONS, "L123", "ramp");

/// An emergency stop lets the motor coast.
pub(super) const EMERGENCY_COAST: Pick = Pick::of(VARIATIONS, "L123", "coast");
