//! At which points two drives of this model may differ.

use crate::variant::{Choice, Pick, Trust, Variant, Variation, VariationKind};

/// All of them.
pub const VARIATIONS: &[Variation] = &[
    Variation {
        key: "L039",
        kind: VariationKind::Reading,
        section: "5.4.2",
        about: "how an external stop that releases the shaft (202Fh:03 = 1) ends",
        choices: &[
            Choice::new("disabled", "in switch on disabled: the host enables it anew", Trust::Vendor),
            Choice::new("enabled", "in operation enabled, the power stage off until the input goes off", Trust::Guess),
        ],
    },
    Variation {
        key: "L101",
        kind: VariationKind::Reading,
        section: "9, 2012h and the note",
        about: "what overload below 2012h times the rated current does while 202Fh:02 = 0",
        choices: &[
            Choice::new("proportion", "lasts longer than 2016h in the proportion of the note", Trust::Guess),
            Choice::new("factor", "nothing: overload begins at 2012h times the rated current", Trust::Guess),
        ],
    },
    Variation {
        key: "L123",
        kind: VariationKind::Reading,
        section: "9, 605Ah and 605Dh",
        about: "what an emergency stop is (605Ah = 7, 605Dh = 3)",
        choices: &[
            Choice::new("limit", "the motor brakes as hard as the current limit allows", Trust::Guess),
            Choice::new("ramp", "the motor slows down in the time of 6085h", Trust::Guess),
            Choice::new("coast", "the power stage is off while it lasts, and the motor coasts", Trust::Guess),
        ],
    },
];

/// The first choice of each.
pub const VARIANT: Variant = Variant::first_of(VARIATIONS);

/// An external stop that releases the shaft leaves operation enabled.
pub(super) const STOPPED_ENABLED: Pick = Pick::of(VARIATIONS, "L039", "enabled");

/// Nothing below 2012h is overload.
pub(super) const OVERLOAD_FROM_FACTOR: Pick = Pick::of(VARIATIONS, "L101", "factor");

/// An emergency stop takes the ramp of 6085h.
pub(super) const EMERGENCY_RAMP: Pick = Pick::of(VARIATIONS, "L123", "ramp");

/// An emergency stop lets the motor coast.
pub(super) const EMERGENCY_COAST: Pick = Pick::of(VARIATIONS, "L123", "coast");
