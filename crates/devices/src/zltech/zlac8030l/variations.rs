//! At which points two drives of this model may differ.

use crate::variant::{Choice, Preset, Trust, Variation, VariationKind};

/// All of them.
pub const VARIATIONS: &[Variation] = &[
    Variation {
        key: "firmware",
        kind: VariationKind::Build,
        section: "8",
        about: "its version",
        choices: &[
            Choice::new("1.00", "as the manual V1.00 of 2023 has it", Trust::Vendor),
            Choice::new("2.01", "as the guide V2.01 of 2024: it has 202Fh:06, and a target velocity above 200Ah is fault 2000h", Trust::Vendor),
        ],
    },
    Variation {
        key: "motor",
        kind: VariationKind::Build,
        section: "9, 200Ah",
        about: "which winding of the wheel motor is wired to it",
        choices: &[
            Choice::new("slow", "ZLLG65ASM250-L: 0.76 N m/A, up to some 510 r/min at 48 V", Trust::Vendor),
            Choice::new("fast", "ZLLG65ASM250: 0.30 N m/A, up to the drive's 1000 r/min at 48 V", Trust::Vendor),
        ],
    },
    Variation {
        key: "defaults",
        kind: VariationKind::Build,
        section: "9",
        about: "whose factory values it has",
        choices: &[
            Choice::new("manual", "those of the object table", Trust::Vendor),
            Choice::new(
                "eds",
                "those of the maker's EDS: 6040h and 6060h in RPDO0, 6041h in TPDO0 of type 254, 30 A rated, 60 A at most, \
                 60FFh 120 r/min, the speed observer on",
                Trust::Vendor,
            )
            .factory(EDS),
        ],
    },
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
        key: "L083",
        kind: VariationKind::Reading,
        section: "9, 2000h",
        about: "which frames keep the watch over the host (2000h) quiet",
        choices: &[
            Choice::new("node", "SDO requests and receive PDOs of this node", Trust::Guess),
            Choice::new("sync", "those and SYNC", Trust::Guess),
        ],
    },
    Variation {
        key: "L090",
        kind: VariationKind::Reading,
        section: "9, 2009h",
        about: "whether a save (2009h = 2) keeps the mode 6060h, which is marked RW and not RW/S",
        choices: &[
            Choice::new("mode", "it does: after a restart the drive is in the mode that was saved", Trust::Traffic),
            Choice::new("marked", "it does not: after a restart the mode is 0", Trust::Vendor),
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

/// What the maker's EDS has where the manual has another default. Left out: 2005h, to which it gives 3 where 0 and 1 are
/// listed.
const EDS: &[Preset] = &[
    Preset::new(0x1600, 0, 4),
    Preset::new(0x1600, 2, 0x6060_0008),
    Preset::new(0x1601, 0, 4),
    Preset::new(0x1602, 0, 4),
    Preset::new(0x1603, 0, 4),
    Preset::new(0x1800, 2, 254),
    Preset::new(0x1800, 3, 100),
    Preset::new(0x1801, 2, 254),
    Preset::new(0x1801, 3, 100),
    Preset::new(0x1802, 2, 254),
    Preset::new(0x1802, 3, 100),
    Preset::new(0x1803, 2, 254),
    Preset::new(0x1803, 3, 100),
    Preset::new(0x1A00, 0, 4),
    Preset::new(0x1A00, 1, 0x6041_0010),
    Preset::new(0x1A01, 0, 4),
    Preset::new(0x1A02, 0, 4),
    Preset::new(0x1A03, 0, 4),
    Preset::new(0x2014, 0, 300),
    Preset::new(0x2015, 0, 600),
    Preset::new(0x201F, 0, 100),
    Preset::new(0x2023, 0, 4),
    Preset::new(0x202A, 0, 1000),
    Preset::new(0x202B, 0, 750),
    Preset::new(0x202C, 0, 350),
    Preset::new(0x202D, 0, 1000),
    Preset::new(0x2030, 0, 14),
    Preset::new(0x60FF, 0, 120),
];
