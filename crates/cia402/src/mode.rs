use core::fmt;

/// Modes of operation, objects 6060h and 6061h. Open: drives have modes of their own. Source: CiA 402-2, table 46.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct ModeOfOperation(pub i8);

impl ModeOfOperation {
    /// No mode chosen.
    pub const NONE: Self = Self(0);
    /// Profile position.
    #[doc(alias = "PP")]
    pub const PROFILE_POSITION: Self = Self(1);
    /// Velocity (frequency converters).
    #[doc(alias = "VL")]
    pub const VELOCITY: Self = Self(2);
    /// Profile velocity.
    #[doc(alias = "PV")]
    pub const PROFILE_VELOCITY: Self = Self(3);
    /// Profile torque.
    #[doc(alias = "PT")]
    pub const PROFILE_TORQUE: Self = Self(4);
    /// Homing.
    pub const HOMING: Self = Self(6);
    /// Interpolated position.
    pub const INTERPOLATED_POSITION: Self = Self(7);
    /// Cyclic synchronous position.
    #[doc(alias = "CSP")]
    pub const CYCLIC_SYNCHRONOUS_POSITION: Self = Self(8);
    /// Cyclic synchronous velocity.
    #[doc(alias = "CSV")]
    pub const CYCLIC_SYNCHRONOUS_VELOCITY: Self = Self(9);
    /// Cyclic synchronous torque.
    #[doc(alias = "CST")]
    pub const CYCLIC_SYNCHRONOUS_TORQUE: Self = Self(10);

    /// Cyclic synchronous torque with commutation angle.
    #[doc(alias = "CSTCA")]
    pub const CYCLIC_SYNCHRONOUS_TORQUE_WITH_COMMUTATION_ANGLE: Self = Self(11);

    /// True for the modes whose set-point comes with every SYNC (8 to 11).
    pub const fn is_cyclic_synchronous(self) -> bool {
        matches!(self.0, 8..=11)
    }

    /// The standard's name; `None` for numbers it reserves or leaves to manufacturers.
    pub const fn name(self) -> Option<&'static str> {
        Some(match self.0 {
            0 => "no mode",
            1 => "profile position",
            2 => "velocity",
            3 => "profile velocity",
            4 => "profile torque",
            6 => "homing",
            7 => "interpolated position",
            8 => "cyclic synchronous position",
            9 => "cyclic synchronous velocity",
            10 => "cyclic synchronous torque",
            11 => "cyclic synchronous torque with commutation angle",
            _ => return None,
        })
    }
}

/// Which modes a drive has, object 6502h: bit *n* - 1 is mode *n*. Source: CiA 402-2, supported drive modes.
///
/// The upper half belongs to the manufacturer: its bits name no mode here.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct SupportedModes(pub u32);

impl SupportedModes {
    /// Bits of the lower half, one for each mode from 1 to 11; 5 is reserved.
    const STANDARD: u32 = 0x07FF & !(1 << 4);

    /// True if the drive has the mode. [`ModeOfOperation::NONE`] is not a mode to have; a mode below 0 is never listed here.
    pub const fn has(self, mode: ModeOfOperation) -> bool {
        match Self::bit(mode) {
            Some(bit) => self.0 & bit != 0,
            None => false,
        }
    }

    /// The same with one more mode; unchanged for modes that have no bit.
    #[must_use]
    pub const fn with(self, mode: ModeOfOperation) -> Self {
        match Self::bit(mode) {
            Some(bit) => Self(self.0 | bit),
            None => self,
        }
    }

    /// The modes, ascending.
    pub fn modes(self) -> impl Iterator<Item = ModeOfOperation> {
        (1..=11).map(ModeOfOperation).filter(move |mode| self.has(*mode))
    }

    const fn bit(mode: ModeOfOperation) -> Option<u32> {
        if mode.0 < 1 || mode.0 > 11 {
            return None;
        }
        let bit = 1 << (mode.0 - 1);
        if bit & Self::STANDARD == 0 { None } else { Some(bit) }
    }
}

impl fmt::Display for ModeOfOperation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.name() {
            Some(name) => write!(f, "{} ({name})", self.0),
            None => self.0.fmt(f),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bits_of_6502h_are_those_of_the_standard() {
        // CiA 402-2, 6502h: pp 0, vl 1, pv 2, tq 3, hm 5, ip 6, csp 7, csv 8, cst 9, cstca 10.
        let bits = [(1, 0), (2, 1), (3, 2), (4, 3), (6, 5), (7, 6), (8, 7), (9, 8), (10, 9), (11, 10)];
        for (mode, bit) in bits {
            assert_eq!(SupportedModes::default().with(ModeOfOperation(mode)), SupportedModes(1 << bit), "mode {mode}");
            assert!(SupportedModes(1 << bit).has(ModeOfOperation(mode)), "mode {mode}");
        }
        assert!(SupportedModes(u32::MAX).modes().map(|mode| mode.0).eq(bits.map(|(mode, _)| mode)));
    }

    #[test]
    fn no_mode_reserved_modes_and_makers_modes_are_never_supported() {
        for mode in [i8::MIN, -1, 0, 5, 12, 33, i8::MAX] {
            assert!(!SupportedModes(u32::MAX).has(ModeOfOperation(mode)), "{mode}");
        }
    }
}
