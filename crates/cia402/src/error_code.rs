//! Error codes of drives, object 603Fh and the first two bytes of an EMCY. Source: CiA 402-2, clause on error codes.

use core::fmt;

/// Error code, object 603Fh. Open: a drive may have codes of its own from FF00h on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct ErrorCode(pub u16);

macro_rules! error_codes {
    ($($(#[$doc:meta])* $constant:ident = $value:literal, $name:literal;)*) => {
        impl ErrorCode {
            $($(#[$doc])* pub const $constant: Self = Self($value);)*

            /// What the standard calls it, in our words; `None` for codes that are not in the table.
            pub const fn name(self) -> Option<&'static str> {
                match self.0 {
                    $($value => Some($name),)*
                    _ => None,
                }
            }
        }
    };
}

error_codes! {
    /// No error.
    NONE = 0x0000, "no error";
    /// Short circuit or earth fault at the output.
    SHORT_CIRCUIT = 0x2320, "short circuit at the output";
    /// Continuous over-current.
    CONTINUOUS_OVER_CURRENT = 0x2310, "continuous over-current";
    /// Load level fault: I2t in thermal state.
    LOAD_LEVEL = 0x2350, "overload of the motor (I2t)";
    /// Mains over-voltage.
    MAINS_OVER_VOLTAGE = 0x3110, "mains over-voltage";
    /// Mains under-voltage.
    MAINS_UNDER_VOLTAGE = 0x3120, "mains under-voltage";
    /// DC link over-voltage.
    DC_LINK_OVER_VOLTAGE = 0x3210, "bus over-voltage";
    /// DC link under-voltage.
    DC_LINK_UNDER_VOLTAGE = 0x3220, "bus under-voltage";
    /// Excess temperature of the device.
    DEVICE_OVER_TEMPERATURE = 0x4210, "drive too hot";
    /// Excess temperature of the drive, motor included.
    DRIVE_OVER_TEMPERATURE = 0x4310, "motor too hot";
    /// Data storage: EEPROM.
    DATA_STORAGE = 0x5530, "parameter store not readable";
    /// Parameter error.
    PARAMETER = 0x6320, "parameter without sense";
    /// Motor blocked.
    MOTOR_BLOCKED = 0x7121, "motor blocked";
    /// Sensor: incremental encoder 1.
    ENCODER_1 = 0x7305, "encoder fault";
    /// Communication.
    COMMUNICATION = 0x8100, "communication";
    /// Communication: life guard or heartbeat.
    LIFE_GUARD_OR_HEARTBEAT = 0x8130, "life guard or heartbeat lost";
    /// Communication: recovered from bus-off.
    RECOVERED_FROM_BUS_OFF = 0x8140, "recovered from bus-off";
    /// Protocol: an RPDO has stayed away.
    RPDO_TIMEOUT = 0x8250, "RPDO overdue";
    /// Positioning controller: following error.
    FOLLOWING_ERROR = 0x8611, "following error";
    /// Positioning controller: reference limit.
    REFERENCE_LIMIT = 0x8612, "target beyond its limits";
}

impl fmt::Display for ErrorCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.name() {
            Some(name) => write!(f, "{:04X}h ({name})", self.0),
            None => write!(f, "{:04X}h", self.0),
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::string::ToString;

    #[test]
    fn a_code_is_shown_with_its_name_if_it_has_one() {
        assert_eq!(ErrorCode::FOLLOWING_ERROR.to_string(), "8611h (following error)");
        assert_eq!(ErrorCode(0xFF01).to_string(), "FF01h");
    }
}
