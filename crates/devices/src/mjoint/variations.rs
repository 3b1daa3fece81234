//! At which points two drives of these models may differ.

use crate::variant::{Choice, Trust, Variation, VariationKind};

/// All of them.
pub const VARIATIONS: &[Variation] = &[POWER_OFF_POSITION, MODBUS_ENABLE, AMPERES, ORIGIN];

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
