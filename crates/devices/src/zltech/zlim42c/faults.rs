//! The faults of the drive as one table: 603Fh of 5.4 and the lights of 3.4 ("ZLIM42-C user manual V1.03").
//!
//! The two lists do not match one to one. Over-current of the bus has a light (five flashes) and no code: FF02h. The
//! EEPROM has a code and no light. EMCY messages carry the value of 603Fh as error code (5.2).

use crate::faults::FaultRow;
use crate::faults::error_register::{CURRENT, MANUFACTURER, VOLTAGE};

/// Rows of [`FAULTS`].
pub mod row {
    /// FF01h.
    pub const OVER_VOLTAGE: usize = 0;
    /// FF02h: a phase.
    pub const OVER_CURRENT: usize = 1;
    /// FF04h.
    pub const PHASE_LOSS: usize = 2;
    /// FF08h.
    pub const REFERENCE_VOLTAGE: usize = 3;
    /// FF10h.
    pub const EEPROM: usize = 4;
    /// FF02h: the supply.
    pub const BUS_OVER_CURRENT: usize = 5;
}

/// Number of faults.
pub const FAULT_COUNT: usize = 6;

/// All faults that occur.
#[rustfmt::skip]
pub static FAULTS: [FaultRow; FAULT_COUNT] = [
    FaultRow::new(0xFF01, "over-voltage", VOLTAGE,
        "Lower the supply: 24 V, at most 30 V. If it rises while the motor brakes, slow down longer (6084h)."),
    FaultRow::new(0xFF02, "over-current", CURRENT,
        "Look for a short circuit between the motor's wires; lower 2005h; set 2040h and 2041h back."),
    FaultRow::new(0xFF04, "phase loss", MANUFACTURER,
        "A motor wire has bad contact to the drive's board: have it repaired."),
    FaultRow::new(0xFF08, "internal reference voltage", MANUFACTURER,
        "The drive's reference voltage circuit is out of order: replace the drive."),
    FaultRow::new(0xFF10, "EEPROM read and write", MANUFACTURER,
        "Write 1 to 2010h (factory settings). If it comes back, the EEPROM is damaged."),
    FaultRow::new(0xFF02, "bus over-current", CURRENT,
        "The drive draws too much from its supply: lower 2005h; look for a short circuit in the motor."),
];
