//! Faults of a device: where it shows them, and what a row of its fault list says.

use canopen::{EmcyErrorCode, Mux};

/// How faults are reported.
#[derive(Clone, Copy)]
pub struct Faults {
    /// The object with the present code (603Fh), where there is one.
    pub code: Option<Mux>,
    /// The code is a bit field: several faults at once.
    pub bit_field: bool,
    /// All faults.
    pub table: &'static [FaultRow],
    /// Where the manual ([`crate::Description::manual`]) lists them, by its own numbers or headings.
    pub section: &'static str,
}

/// One fault of a drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FaultRow {
    /// Its value in the drive's fault code object.
    pub code: u16,
    /// What it is.
    pub name: &'static str,
    /// What may cause it and what to do about it.
    pub remedy: &'static str,
    /// Bits of the error register 1001h. Source: CiA 301, 7.5.2.2.
    pub error_register: u8,
    /// Error code of the EMCY message.
    pub emcy: EmcyErrorCode,
    /// The sensor of the shaft is at fault: the position and the speed that the drive shows are not the shaft's.
    pub hides_motion: bool,
}

impl FaultRow {
    /// A fault whose EMCY error code is the value of the drive's fault code object.
    pub const fn new(code: u16, name: &'static str, error_register: u8, remedy: &'static str) -> Self {
        Self { code, name, remedy, error_register, emcy: EmcyErrorCode(code), hides_motion: false }
    }

    /// The same, of the sensor of the shaft.
    pub const fn hiding_motion(self) -> Self {
        Self { hides_motion: true, ..self }
    }
}

/// Bits of the error register 1001h (CiA 301, 7.5.2.2). Bit 0, generic, is set with each other.
pub mod error_register {
    /// Any error.
    pub const GENERIC: u8 = 1 << 0;
    /// Current.
    pub const CURRENT: u8 = 1 << 1;
    /// Voltage.
    pub const VOLTAGE: u8 = 1 << 2;
    /// Temperature.
    pub const TEMPERATURE: u8 = 1 << 3;
    /// Communication.
    pub const COMMUNICATION: u8 = 1 << 4;
    /// Device profile specific.
    pub const PROFILE: u8 = 1 << 5;
    /// Manufacturer specific.
    pub const MANUFACTURER: u8 = 1 << 7;
}
