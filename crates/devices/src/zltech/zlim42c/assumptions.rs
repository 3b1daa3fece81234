//! Factory values that the manual ("ZLIM42-C user manual V1.03") does not give, each with the reason for its value.

/// 1009h. The manual prints no value: version 1.00.
pub const HARDWARE_VERSION: i64 = 0x0100;

/// 100Ah and 2088h. The manual prints no value: version 1.03, as the manual itself.
pub const SOFTWARE_VERSION: i64 = 0x0103;

/// Factory value of 204Bh and 204Ch, ms: 3.2 asks for pulses longer than 10 ms. No unit is printed.
pub const INPUT_FILTER_MS: i64 = 10;

/// Factory values of 2040h and 2041h: those of the sibling ZLAC8030L, since none are printed.
pub const CURRENT_KP: i64 = 600;

/// See [`CURRENT_KP`].
pub const CURRENT_KI: i64 = 300;
