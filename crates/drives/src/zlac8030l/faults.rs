//! How long the causes of faults must last before they count; the faults themselves are those of the description.

pub use devices::zltech::zlac8030l::faults::*;

use super::assumptions::{
    OVER_CURRENT_DEBOUNCE_PERIODS, SENSOR_DEBOUNCE_PERIODS, TEMPERATURE_DEBOUNCE_PERIODS, VOLTAGE_DEBOUNCE_PERIODS,
};
use crate::engine::faults::debounces;

/// Supervision periods for each row of [`FAULTS`].
pub(super) static DEBOUNCE: [u16; FAULT_COUNT] = debounces(&[
    (row::OVER_VOLTAGE, VOLTAGE_DEBOUNCE_PERIODS),
    (row::UNDER_VOLTAGE, VOLTAGE_DEBOUNCE_PERIODS),
    (row::OVER_CURRENT, OVER_CURRENT_DEBOUNCE_PERIODS),
    (row::REFERENCE_VOLTAGE, SENSOR_DEBOUNCE_PERIODS),
    (row::HALL, SENSOR_DEBOUNCE_PERIODS),
    (row::MOTOR_TEMPERATURE, TEMPERATURE_DEBOUNCE_PERIODS),
    (row::DRIVER_TEMPERATURE, TEMPERATURE_DEBOUNCE_PERIODS),
]);
