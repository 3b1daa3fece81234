//! Bits of the statusword that are of this drive's own (5.04).

/// Bit 4: the power stage drives the motor.
pub const LIVE: u16 = 1 << 4;
/// Bit 12 in mode 6: the origin is found.
pub const HOMING_ATTAINED: u16 = 1 << 12;
/// Bit 13 in mode 6: the origin was not found.
pub const HOMING_ERROR: u16 = 1 << 13;
