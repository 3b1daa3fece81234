//! At which points two servos may differ: the motor that is wired to them.

use crate::variant::{Choice, Trust, Variation, VariationKind};

/// All of them; of a drive that is described by a file too.
pub const VARIATIONS: &[Variation] = &[Variation {
    key: "motor",
    kind: VariationKind::Build,
    section: "",
    about: "which motor is wired to it",
    choices: &[
        Choice::new("sgmah-04a", "Yaskawa SGMAH-04A, 400 W, 3000 r/min, 17-bit encoder, on 283 V", Trust::Vendor),
        Choice::new("sgmah-04a-brake", "the same with its holding brake", Trust::Vendor),
        Choice::new(
            "zllg65asm250-l",
            "ZLTECH ZLLG65ASM250-L, a wheel motor of 6 N m, 4096 counts, on 48 V",
            Trust::Vendor,
        ),
    ],
}];
