//! Digital inputs and outputs, objects 60FDh and 60FEh. Source: CiA 402-2, clause on general I/O.
//!
//! The lower half is the standard's, the upper half the maker's.

/// Digital inputs, object 60FDh: what each switch says, active being 1 whatever its wiring.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DigitalInputs(pub u32);

impl DigitalInputs {
    /// Bit 0.
    pub const NEGATIVE_LIMIT_SWITCH: u32 = 1 << 0;
    /// Bit 1.
    pub const POSITIVE_LIMIT_SWITCH: u32 = 1 << 1;
    /// Bit 2.
    pub const HOME_SWITCH: u32 = 1 << 2;
    /// Bit 3: an interlock such as a guard door.
    pub const INTERLOCK: u32 = 1 << 3;
    /// Bits 16 to 31: the maker's.
    pub const MANUFACTURER: u32 = 0xFFFF_0000;

    /// True if all bits of `mask` are set.
    pub const fn has(self, mask: u32) -> bool {
        self.0 & mask == mask
    }

    /// The same with the bits of `mask` set or cleared.
    #[must_use]
    pub const fn with(self, mask: u32, on: bool) -> Self {
        Self(if on { self.0 | mask } else { self.0 & !mask })
    }
}

/// Digital outputs, object 60FEh: sub-index 1 the levels, sub-index 2 the mask of outputs that the host drives.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DigitalOutputs {
    /// 60FEh:01.
    pub physical_outputs: u32,
    /// 60FEh:02; a drive without it drives all.
    pub bit_mask: u32,
}

impl DigitalOutputs {
    /// Bit 0: the brake is set (1), unless the drive does so itself.
    pub const SET_BRAKE: u32 = 1 << 0;

    /// The levels at the pins: the host's where the mask has a 1, the drive's own elsewhere.
    pub const fn levels(self, own: u32) -> u32 {
        self.physical_outputs & self.bit_mask | own & !self.bit_mask
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mask_shows_whose_level_an_output_has() {
        let outputs = DigitalOutputs { physical_outputs: 0b1100, bit_mask: 0b1010 };
        assert_eq!(outputs.levels(0b0000), 0b1000);
        assert_eq!(outputs.levels(0b1111), 0b1101);
    }

    #[test]
    fn inputs_are_set_and_cleared_by_mask() {
        let inputs = DigitalInputs::default().with(DigitalInputs::HOME_SWITCH, true).with(1 << 16, true);
        assert_eq!(inputs, DigitalInputs(0x0001_0004));
        assert!(inputs.has(DigitalInputs::HOME_SWITCH) && !inputs.has(DigitalInputs::NEGATIVE_LIMIT_SWITCH));
        assert_eq!(inputs.with(DigitalInputs::HOME_SWITCH, false), DigitalInputs(0x0001_0000));
    }
}
