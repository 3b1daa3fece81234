//! How long the causes of faults must last before they count; the faults themselves are those of the description.

pub use devices::zltech::zlim42c::faults::*;

use super::assumptions::{
    BUS_OVER_CURRENT_DEBOUNCE_PERIODS, OVER_CURRENT_DEBOUNCE_PERIODS, REFERENCE_DEBOUNCE_PERIODS,
    VOLTAGE_DEBOUNCE_PERIODS,
};
use crate::engine::faults::debounces;

/// Supervision periods for each row of [`FAULTS`].
pub(super) static DEBOUNCE: [u16; FAULT_COUNT] = debounces(&[
    (row::OVER_VOLTAGE, VOLTAGE_DEBOUNCE_PERIODS),
    (row::OVER_CURRENT, OVER_CURRENT_DEBOUNCE_PERIODS),
    (row::REFERENCE_VOLTAGE, REFERENCE_DEBOUNCE_PERIODS),
    (row::BUS_OVER_CURRENT, BUS_OVER_CURRENT_DEBOUNCE_PERIODS),
]);

/// Red flashes of each row of [`FAULTS`] (3.4). None is printed for the EEPROM: the next free count.
pub const FLASHES: [u8; FAULT_COUNT] = [1, 2, 3, 4, 6, 5];
