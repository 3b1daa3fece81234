//! What alarms do to the motor and what ends them; the alarms themselves are those of the description.

pub use devices::mjoint::alarms::*;

use super::assumptions::VOLTAGE_DEBOUNCE_PERIODS;
use crate::engine::faults::{FaultSet, debounces};

/// Supervision periods that the cause of each row of [`ALARMS`] must last.
pub(super) static DEBOUNCE: [u16; ALARM_COUNT] = debounces(&[(row::OVER_VOLTAGE, VOLTAGE_DEBOUNCE_PERIODS)]);

/// Alarms that stop the motor and leave it free until a reset.
pub const RELEASING: FaultSet = FaultSet(1 << row::OVER_VOLTAGE | 1 << row::LOCKED_ROTOR | 1 << row::STALL);

/// Alarms that a reset does not clear: the next heartbeat does, and a new multi-turn origin.
pub const LASTING: FaultSet = FaultSet(1 << row::COMMUNICATION | 1 << row::BATTERY);

/// The value of 260Eh.
pub fn code(latched: FaultSet) -> u16 {
    latched.rows().next().map_or(0, |row| ALARMS[row].code)
}
