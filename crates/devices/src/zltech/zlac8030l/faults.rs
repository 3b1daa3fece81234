//! The faults of the drive as one table: 603Fh of chapter 9 with the remedies of chapter 8 ("ZLAC8030L quick start guide
//! V1.00").
//!
//! Chapter 8 gives 0800h as the encoder error, as an older sibling has it; chapter 9 gives 0800h to the driver's
//! temperature, which only this model measures, and 1000h to the encoder. The table follows chapter 9. The two codes
//! that chapter 9 calls reserved (0010h, 0040h) never occur.
//!
//! The maker's guide of firmware 2.01 has one more, 2000h: a speed is given above the rated one. Which speed that is, it does
//! not say; 200Ah is the one that the drive knows.
//!
//! EMCY messages carry the value of 603Fh as error code, as the manual of the sibling ZLIM42-C says (V1.03, 5.2).

use crate::faults::FaultRow;
use crate::faults::error_register::{CURRENT, MANUFACTURER, PROFILE, TEMPERATURE, VOLTAGE};

/// Rows of [`FAULTS`].
pub mod row {
    /// 0001h.
    pub const OVER_VOLTAGE: usize = 0;
    /// 0002h.
    pub const UNDER_VOLTAGE: usize = 1;
    /// 0004h.
    pub const OVER_CURRENT: usize = 2;
    /// 0008h.
    pub const OVERLOAD: usize = 3;
    /// 0020h.
    pub const OUT_OF_TOLERANCE: usize = 4;
    /// 0080h.
    pub const REFERENCE_VOLTAGE: usize = 5;
    /// 0100h.
    pub const EEPROM: usize = 6;
    /// 0200h.
    pub const HALL: usize = 7;
    /// 0400h.
    pub const MOTOR_TEMPERATURE: usize = 8;
    /// 0800h.
    pub const DRIVER_TEMPERATURE: usize = 9;
    /// 1000h.
    pub const ENCODER: usize = 10;
    /// 2000h, of firmware 2.01.
    pub const SPEED_SETTING: usize = 11;
}

/// Number of faults.
pub const FAULT_COUNT: usize = 12;

/// All faults that occur.
#[rustfmt::skip]
pub static FAULTS: [FaultRow; FAULT_COUNT] = [
    FaultRow::new(0x0001, "over-voltage", VOLTAGE,
        "Lower the supply. If it rises while the motor brakes, fit a bleeder resistor and set 202Eh:05 = 1."),
    FaultRow::new(0x0002, "under-voltage", VOLTAGE,
        "Raise the supply and check its connector; check the motor parameters 200Bh, 200Ch and 2014h."),
    FaultRow::new(0x0004, "over-current", CURRENT,
        "Check the motor's power cable for a loose or shorted wire; lower 2015h or the current loop gain 2019h."),
    FaultRow::new(0x0008, "overload", CURRENT,
        "Free a blocked motor; check motor cable, wiring, and motor parameters; lower the load or raise 2016h."),
    FaultRow::new(0x0020, "encoder value out of tolerance", PROFILE,
        "Free a blocked motor; check the encoder; ask for moves no faster than the supply lets this motor turn; raise 2017h."),
    FaultRow::new(0x0080, "reference voltage", MANUFACTURER,
        "The drive's reference voltage circuit is out of order: replace the drive."),
    FaultRow::new(0x0100, "EEPROM read and write", MANUFACTURER,
        "After a firmware upgrade write 1 to 2009h (factory settings). If it comes back, the EEPROM is damaged."),
    FaultRow::new(0x0200, "Hall sensor", MANUFACTURER,
        "Check the motor's Hall cable (2028h reads 0 or 7 while it is at fault), then motor and drive."),
    FaultRow::new(0x0400, "motor over-temperature", TEMPERATURE,
        "Lower the motor current and let it cool; check the motor's thermistor; the limit is 2013h:01."),
    FaultRow::new(0x0800, "driver over-temperature", TEMPERATURE,
        "Lower the current and let the drive cool; the limit is 2013h:02."),
    FaultRow::new(0x1000, "encoder", MANUFACTURER,
        "Check the encoder's cable; check 200Bh (lines) and 200Ch (pole pairs) against the motor.").hiding_motion(),
    FaultRow::new(0x2000, "speed setting", PROFILE,
        "Firmware 2.01 only. Ask for no more than 200Ah with 60FFh, then reset the fault."),
];

/// What a code that a fault object of this model may show means; more than one bit may be set.
pub fn faults_of(code: u16) -> impl Iterator<Item = &'static FaultRow> {
    FAULTS.iter().filter(move |fault| fault.code & code != 0)
}
