//! Faults of the generic servo, with the error codes of CiA 402-2.

use cia402::ErrorCode;

use crate::faults::FaultRow;
use crate::faults::error_register::{COMMUNICATION, CURRENT, GENERIC, PROFILE, TEMPERATURE, VOLTAGE};

/// Number of faults.
pub const FAULT_COUNT: usize = 13;

/// The place of each fault in [`FAULTS`].
pub mod row {
    /// A phase carries more than the power stage bears.
    pub const OVER_CURRENT: usize = 0;
    /// More than the rated current for too long.
    pub const OVERLOAD: usize = 1;
    /// Bus voltage too high.
    pub const OVER_VOLTAGE: usize = 2;
    /// Bus voltage too low.
    pub const UNDER_VOLTAGE: usize = 3;
    /// Power stage too hot.
    pub const DRIVE_TEMPERATURE: usize = 4;
    /// Motor too hot.
    pub const MOTOR_TEMPERATURE: usize = 5;
    /// Parameter store.
    pub const STORE: usize = 6;
    /// Encoder.
    pub const ENCODER: usize = 7;
    /// Heartbeat or guarding lost.
    pub const HEARTBEAT: usize = 8;
    /// Following error.
    pub const FOLLOWING_ERROR: usize = 9;
    /// The controller was bus-off.
    pub const BUS_OFF: usize = 10;
    /// The node was stopped, or its communication reset, while the axis was under control.
    pub const NMT: usize = 11;
    /// An RPDO has missed its deadline.
    pub const RPDO_DEADLINE: usize = 12;
}

/// All faults.
#[rustfmt::skip]
pub static FAULTS: [FaultRow; FAULT_COUNT] = [
    fault(ErrorCode::SHORT_CIRCUIT, "Over-current", CURRENT, "Look for a short circuit in motor and cable; then reset."),
    fault(ErrorCode::LOAD_LEVEL, "Overload", CURRENT, "Relieve the motor; let it rest; then reset."),
    fault(ErrorCode::DC_LINK_OVER_VOLTAGE, "Bus over-voltage", VOLTAGE, "Slow down more gently, or add a braking resistor."),
    fault(ErrorCode::DC_LINK_UNDER_VOLTAGE, "Bus under-voltage", VOLTAGE, "Look after the supply and its fuse."),
    fault(ErrorCode::DEVICE_OVER_TEMPERATURE, "Power stage too hot", TEMPERATURE, "Let it cool; look after its ventilation."),
    fault(ErrorCode::DRIVE_OVER_TEMPERATURE, "Motor too hot", TEMPERATURE, "Let it cool; relieve it."),
    fault(ErrorCode::DATA_STORAGE, "Parameter store", 0, "Restore the default parameters (1011h) and store them (1010h)."),
    fault(ErrorCode::ENCODER_1, "Encoder", PROFILE, "Look after the encoder's cable.").hiding_motion(),
    fault(ErrorCode::LIFE_GUARD_OR_HEARTBEAT, "Heartbeat lost", COMMUNICATION, "Look after the node that is watched (1016h); then reset."),
    fault(ErrorCode::FOLLOWING_ERROR, "Following error", PROFILE, "Ask for less speed or acceleration, or widen 6065h and 6066h."),
    fault(ErrorCode::RECOVERED_FROM_BUS_OFF, "Bus-off", COMMUNICATION, "Look after cable, termination and bit rates; then reset."),
    fault(ErrorCode::COMMUNICATION, "Stopped by NMT", COMMUNICATION, "Do not stop or reset the node while it moves, or see 6007h; then reset."),
    fault(ErrorCode::RPDO_TIMEOUT, "RPDO overdue", COMMUNICATION, "Send the RPDO within its event timer (1400h:05); then reset."),
];

const fn fault(code: ErrorCode, name: &'static str, register: u8, remedy: &'static str) -> FaultRow {
    FaultRow::new(code.0, name, register | GENERIC, remedy)
}
