//! Bits of the statusword that are of this drive's own (chapter 7).

/// Bit 12 in profile velocity; never with [`RUNNING`], which slower than the threshold of standstill means that the motor is
/// to turn.
pub const SPEED_IS_ZERO: u16 = 1 << 12;
/// Bit 13 in profile position: the deviation is within 2002h.
pub const IN_POSITION: u16 = 1 << 13;
/// Bit 14.
pub const RUNNING: u16 = 1 << 14;
/// Bit 15: an input stops the motor.
pub const EXTERNAL_STOP: u16 = 1 << 15;
