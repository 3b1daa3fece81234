//! Factory values that the manual ("ZLAC8030L quick start guide V1.00") does not give, each with the reason for its value.

/// 1009h. The manual prints no value; the maker's EDS has 2608h.
pub const HARDWARE_VERSION: i64 = 0x2608;

/// 100Ah and 2025h. The manual prints no value: version 1.00, as the manual itself.
pub const SOFTWARE_VERSION: i64 = 0x0100;
/// The same with firmware 2.01.
pub const SOFTWARE_VERSION_2_01: i64 = 0x0201;
