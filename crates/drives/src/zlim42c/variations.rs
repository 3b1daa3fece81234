//! At which points two drives of this model may differ.

use crate::variant::{Choice, Pick, Trust, Variant, Variation, VariationKind};

/// All of them.
pub const VARIATIONS: &[Variation] = &[HOMING_DIRECTIONS, EMERGENCY_STOP];

const HOMING_DIRECTIONS: Variation = Variation {
    key: "Z050",
    kind: VariationKind::Reading,
    section: "5.3.6",
    about: "which way homing 17, 18, 24 and 29 go: the labels and the paragraphs contradict each other",
    choices: &[
        Choice::new("labels", "17 and 29 search in negative direction, 18 and 24 in positive", Trust::Guess),
        Choice::new("prose", "17 and 29 search in positive direction, 18 and 24 in negative", Trust::Guess),
    ],
};

const EMERGENCY_STOP: Variation = Variation {
    key: "Z092",
    kind: VariationKind::Reading,
    section: "5.4",
    about: "how an emergency stop stops (605Ah = 7, 605Dh = 3, 200Ah = 1)",
    choices: &[
        Choice::new("ramp", "slows down in the time of 6085h", Trust::Guess),
        Choice::new("brake", "the vector stands still at once, and the rotor may lose steps", Trust::Guess),
        Choice::new("coast", "the bridges are switched off, and the motor coasts", Trust::Guess),
    ],
};

/// The first choice of each.
pub const VARIANT: Variant = Variant::first_of(VARIATIONS);

/// Homing goes the ways of the paragraphs.
pub(super) const HOMING_BY_PROSE: Pick = Pick::of(VARIATIONS, "Z050", "prose");

/// An emergency stop without a ramp.
pub(super) const EMERGENCY_BRAKE: Pick = Pick::of(VARIATIONS, "Z092", "brake");

/// An emergency stop that lets the motor coast.
pub(super) const EMERGENCY_COAST: Pick = Pick::of(VARIATIONS, "Z092", "coast");
