use core::fmt;

/// An SDO abort code. Open: a peer may say anything. Source: CiA 301, table 22.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct AbortCode(pub u32);

macro_rules! abort_codes {
    ($($(#[$doc:meta])* $name:ident = $value:literal, $text:literal;)*) => {
        impl AbortCode {
            $($(#[$doc])* #[doc = concat!("`", stringify!($value), "`: ", $text, ".")] pub const $name: Self = Self($value);)*

            /// What the code means, in the words of the standard; `None` for a code that it does not list.
            pub const fn meaning(self) -> Option<&'static str> {
                match self.0 {
                    $($value => Some($text),)*
                    _ => None,
                }
            }
        }
    };
}

abort_codes! {
    TOGGLE_BIT = 0x0503_0000, "toggle bit not alternated";
    TIMED_OUT = 0x0504_0000, "SDO protocol timed out";
    UNKNOWN_COMMAND = 0x0504_0001, "client/server command specifier not valid or unknown";
    INVALID_BLOCK_SIZE = 0x0504_0002, "invalid block size (block mode only)";
    INVALID_SEQUENCE_NUMBER = 0x0504_0003, "invalid sequence number (block mode only)";
    CRC_ERROR = 0x0504_0004, "CRC error (block mode only)";
    OUT_OF_MEMORY = 0x0504_0005, "out of memory";
    UNSUPPORTED_ACCESS = 0x0601_0000, "unsupported access to an object";
    WRITE_ONLY = 0x0601_0001, "attempt to read a write-only object";
    READ_ONLY = 0x0601_0002, "attempt to write a read-only object";
    NO_SUCH_OBJECT = 0x0602_0000, "object does not exist in the object dictionary";
    NOT_MAPPABLE = 0x0604_0041, "object cannot be mapped to the PDO";
    PDO_TOO_LONG = 0x0604_0042, "number and length of the mapped objects would exceed the PDO length";
    PARAMETER_INCOMPATIBLE = 0x0604_0043, "general parameter incompatibility";
    DEVICE_INCOMPATIBLE = 0x0604_0047, "general internal incompatibility in the device";
    HARDWARE_ERROR = 0x0606_0000, "access failed due to a hardware error";
    LENGTH_MISMATCH = 0x0607_0010, "data type does not match, length of service parameter does not match";
    TOO_LONG = 0x0607_0012, "data type does not match, length of service parameter too high";
    TOO_SHORT = 0x0607_0013, "data type does not match, length of service parameter too low";
    NO_SUCH_SUB_INDEX = 0x0609_0011, "sub-index does not exist";
    INVALID_VALUE = 0x0609_0030, "invalid value for parameter";
    VALUE_TOO_HIGH = 0x0609_0031, "value of parameter written too high";
    VALUE_TOO_LOW = 0x0609_0032, "value of parameter written too low";
    MAX_LESS_THAN_MIN = 0x0609_0036, "maximum value is less than minimum value";
    RESOURCE_NOT_AVAILABLE = 0x060A_0023, "resource not available: SDO connection";
    GENERAL = 0x0800_0000, "general error";
    CANNOT_TRANSFER = 0x0800_0020, "data cannot be transferred or stored to the application";
    LOCAL_CONTROL = 0x0800_0021, "data cannot be transferred or stored because of local control";
    DEVICE_STATE = 0x0800_0022, "data cannot be transferred or stored because of the present device state";
    NO_DICTIONARY = 0x0800_0023, "object dictionary not present or dynamic generation failed";
    NO_DATA = 0x0800_0024, "no data available";
}

/// `0602 0000h (object does not exist in the object dictionary)`.
impl fmt::Display for AbortCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text = self.meaning().unwrap_or("not a code of CiA 301");
        write!(f, "{:04X} {:04X}h ({text})", self.0 >> 16, self.0 & 0xFFFF)
    }
}

impl fmt::Debug for AbortCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "AbortCode({self})")
    }
}

impl core::error::Error for AbortCode {}
