//! At which points two drives of these models may differ.

use crate::variant::{Choice, Trust, Variation, VariationKind};

/// All of them.
pub const VARIATIONS: &[Variation] = &[POWER_OFF_POSITION, MODBUS_ENABLE, AMPERES, ORIGIN, FIRMWARE];

const FIRMWARE: Variation = Variation {
    key: "firmware",
    kind: VariationKind::Build,
    section: "5.04, 5.08",
    about: "its edition",
    choices: &[
        Choice::new("manual", "as the manual has it", Trust::Vendor),
        Choice::new(
            "1.66",
            "as the maker's EDS YZ_MOTOR_SN2 and manual 1.66: TPDO1 each 100 ms, 180xh:04 and :05, mappings that can be \
             written, 606Ch with 32 bits, 1006h, 260Ch and 260Eh read-only",
            Trust::Vendor,
        ),
    ],
};

const POWER_OFF_POSITION: Variation = Variation {
    key: "J005",
    kind: VariationKind::Reading,
    section: "Characteristic",
    about: "what a joint that takes pulses does at power-on",
    choices: &[
        Choice::new("return", "goes back to where it was at power-off, and holds", Trust::Vendor),
        Choice::new("free", "stays free where it is until the first pulse", Trust::Guess),
    ],
};

const MODBUS_ENABLE: Variation = Variation {
    key: "J037",
    kind: VariationKind::Reading,
    section: "5.04, 2600h",
    about: "what \"modbus forbid\" forbids",
    choices: &[
        Choice::new("writes", "every write over Modbus but that of 2600h itself: exception 01", Trust::Guess),
        Choice::new("nothing", "no access: it only says whether pulses count", Trust::Sibling),
    ],
};

const AMPERES: Variation = Variation {
    key: "J047",
    kind: VariationKind::Reading,
    section: "5.04, 6078h and 261Dh",
    about: "what their amperes count",
    choices: &[
        Choice::new("rms", "the r.m.s. current of a phase, as the rated current of the table", Trust::Guess),
        Choice::new("amplitude", "its amplitude, as a drive measures it", Trust::Guess),
    ],
};

const ORIGIN: Variation = Variation {
    key: "J113",
    kind: VariationKind::Reading,
    section: "5.10.1, note 3",
    about: "where the origin of homing is",
    choices: &[
        Choice::new("stand", "where the motor stands after slowing down, so that 6064h is about 0", Trust::Vendor),
        Choice::new("edge", "at the switch's edge: 6064h is the way of the ramp beyond it", Trust::Standard),
    ],
};
