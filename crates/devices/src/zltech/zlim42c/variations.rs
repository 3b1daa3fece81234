//! At which points two drives of this model may differ.

use crate::variant::{Choice, Preset, Trust, Variation, VariationKind};

/// All of them.
pub const VARIATIONS: &[Variation] = &[FAULT_RESET, HOMING_DIRECTIONS, EMERGENCY_STOP, DEFAULTS];

const FAULT_RESET: Variation = Variation {
    key: "Z010",
    kind: VariationKind::Reading,
    section: "3.4",
    about: "what clears a fault whose cause is gone",
    choices: &[
        Choice::new("reset", "bit 7 of 6040h or 2011h = 1, as 5.3.1 and 5.4 have it", Trust::Guess),
        Choice::new("power-cycle", "switching off and on only, as 3.4 has it", Trust::Guess),
    ],
};

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

const DEFAULTS: Variation = Variation {
    key: "defaults",
    kind: VariationKind::Build,
    section: "5.4",
    about: "whose factory values it has",
    choices: &[
        Choice::new("manual", "those of the object table", Trust::Vendor),
        Choice::new(
            "eds",
            "those of the maker's EDS: 6040h and 6060h in RPDO0, 6041h in TPDO0, TPDOs of type 254 at most every 50 ms, \
             6081h 60 r/min, 60FFh 120 r/min",
            Trust::Vendor,
        )
        .factory(EDS),
    ],
};

/// Where the maker's EDS of this drive differs from the manual's table. It counts four entries in each mapping; here those
/// that map something.
const EDS: &[Preset] = &[
    Preset::new(0x1600, 0, 2),
    Preset::new(0x1600, 2, 0x6060_0008),
    Preset::new(0x1800, 2, 254),
    Preset::new(0x1800, 3, 100),
    Preset::new(0x1801, 2, 254),
    Preset::new(0x1801, 3, 100),
    Preset::new(0x1802, 2, 254),
    Preset::new(0x1802, 3, 100),
    Preset::new(0x1803, 2, 254),
    Preset::new(0x1803, 3, 100),
    Preset::new(0x1A00, 0, 1),
    Preset::new(0x1A00, 1, 0x6041_0010),
    Preset::new(0x2030, 0, 14),
    Preset::new(0x6081, 0, 60),
    Preset::new(0x60FF, 0, 120),
];
