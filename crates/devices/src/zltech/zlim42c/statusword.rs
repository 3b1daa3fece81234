//! Bits of the statusword that are of this drive's own (5.3.4 to 5.3.6).

/// Bit 8: the last homing found its home position. Stays until the next homing begins.
pub const HOMING_ATTAINED: u16 = 1 << 8;
/// Bit 11: bit 4 of the controlword.
pub const BIT_4_OF_CONTROLWORD: u16 = 1 << 11;
/// Bit 12 in profile velocity.
pub const SPEED_IS_ZERO: u16 = 1 << 12;
/// Bit 13: the motor is energised.
pub const ENERGISED: u16 = 1 << 13;
/// Bit 14.
pub const RUNNING: u16 = 1 << 14;
/// Bit 15 in profile position: as bit 10.
pub const IN_POSITION: u16 = 1 << 15;
