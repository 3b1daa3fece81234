use core::fmt;

use crate::PowerState;

/// The statusword, object 6041h. Source: CiA 402-2, 8.4.2.
///
/// Bits 8 and 11 to 15 differ between drives and modes; only what the standard fixes is named here.
#[doc(alias = "status word")]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Statusword(pub u16);

impl Statusword {
    /// Bit 0.
    pub const READY_TO_SWITCH_ON: u16 = 1 << 0;
    /// Bit 1.
    pub const SWITCHED_ON: u16 = 1 << 1;
    /// Bit 2.
    pub const OPERATION_ENABLED: u16 = 1 << 2;
    /// Bit 3.
    pub const FAULT: u16 = 1 << 3;
    /// Bit 4.
    pub const VOLTAGE_ENABLED: u16 = 1 << 4;
    /// Bit 5; active low: 0 while a quick stop acts.
    pub const QUICK_STOP: u16 = 1 << 5;
    /// Bit 6.
    pub const SWITCH_ON_DISABLED: u16 = 1 << 6;
    /// Bit 7.
    pub const WARNING: u16 = 1 << 7;
    /// Bit 9: the controlword is followed.
    pub const REMOTE: u16 = 1 << 9;
    /// Bit 10.
    pub const TARGET_REACHED: u16 = 1 << 10;
    /// Bit 11: a limit of the drive holds the set-point back.
    pub const INTERNAL_LIMIT_ACTIVE: u16 = 1 << 11;
    /// Bit 12 in profile position.
    pub const SET_POINT_ACKNOWLEDGE: u16 = 1 << 12;
    /// Bit 12 in profile velocity: the motor stands.
    pub const SPEED: u16 = 1 << 12;
    /// Bit 12 in homing.
    pub const HOMING_ATTAINED: u16 = 1 << 12;
    /// Bit 12 in interpolated position.
    pub const INTERPOLATION_ACTIVE: u16 = 1 << 12;
    /// Bit 12 in the cyclic synchronous modes.
    pub const FOLLOWS_COMMAND_VALUE: u16 = 1 << 12;
    /// Bit 13 in profile position and cyclic synchronous position.
    pub const FOLLOWING_ERROR: u16 = 1 << 13;
    /// Bit 13 in profile velocity: slower than an asynchronous motor's slip allows.
    pub const MAX_SLIPPAGE_ERROR: u16 = 1 << 13;
    /// Bit 13 in homing.
    pub const HOMING_ERROR: u16 = 1 << 13;

    /// True if all bits of `mask` are set.
    pub const fn has(self, mask: u16) -> bool {
        self.0 & mask == mask
    }

    /// The state of the power drive state machine. Source: CiA 402-2, table 30.
    ///
    /// `None` for patterns that the standard does not list (a drive that mirrors the controlword, say).
    pub const fn state(self) -> Option<PowerState> {
        match self.0 & 0x4F {
            0x00 => Some(PowerState::NotReadyToSwitchOn),
            0x40 => Some(PowerState::SwitchOnDisabled),
            0x0F => Some(PowerState::FaultReactionActive),
            0x08 => Some(PowerState::Fault),
            _ => match self.0 & 0x6F {
                0x21 => Some(PowerState::ReadyToSwitchOn),
                0x23 => Some(PowerState::SwitchedOn),
                0x27 => Some(PowerState::OperationEnabled),
                0x07 => Some(PowerState::QuickStopActive),
                _ => None,
            },
        }
    }
}

impl PowerState {
    /// Bits 0 to 3, 5 and 6 of the statusword in this state, bit 5 set where the standard leaves it open in
    /// Switch on disabled.
    pub const fn statusword_bits(self) -> u16 {
        match self {
            Self::NotReadyToSwitchOn => 0,
            Self::SwitchOnDisabled => Statusword::SWITCH_ON_DISABLED | Statusword::QUICK_STOP,
            Self::ReadyToSwitchOn => 0x21,
            Self::SwitchedOn => 0x23,
            Self::OperationEnabled => 0x27,
            Self::QuickStopActive => 0x07,
            Self::FaultReactionActive => 0x0F,
            Self::Fault => 0x08,
        }
    }
}

impl fmt::Display for Statusword {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let state = self.state().map_or("no state of CiA 402", PowerState::name);
        write!(f, "{:04X}h ({state})", self.0)
    }
}
