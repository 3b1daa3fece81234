//! The listed values of objects, with their meaning ("ZLAC8030L quick start guide V1.00", chapter 9).

use crate::row::Values;

pub(super) const OFF_ON: Values = &[(0, "off"), (1, "on")];
pub(super) const DIRECTIONS: Values = &[(0, "clockwise, from the shaft side"), (1, "counter-clockwise")];
pub(super) const BAUD_RATES: Values =
    &[(0, "1000 kbit/s"), (1, "500 kbit/s"), (2, "250 kbit/s"), (3, "125 kbit/s"), (4, "100 kbit/s")];
pub(super) const RS485_BAUD_RATES: Values =
    &[(1, "128000"), (2, "115200"), (3, "57600"), (4, "38400"), (5, "19200"), (6, "9600")];
pub(super) const IO_STOP: Values = &[(0, "lock shaft"), (1, "release shaft")];
pub(super) const OUTPUT_FUNCTIONS: Values =
    &[(0, "undefined"), (1, "alarm"), (2, "drive status"), (3, "NC"), (4, "in position")];
pub(super) const BRAKE: Values = &[(0, "open"), (1, "closed")];
pub(super) const QUICK_STOP_OPTIONS: Values = &[
    (5, "normal stop, stay in quick stop active"),
    (6, "quick stop ramp, stay in quick stop active"),
    (7, "emergency stop, stay in quick stop active"),
];
pub(super) const DISABLE_OPTIONS: Values = &[(0, "power off at once"), (1, "normal stop, then switched on")];
pub(super) const HALT_OPTIONS: Values = &[(1, "normal stop"), (2, "quick stop ramp"), (3, "emergency stop")];
pub(super) const MODES: Values =
    &[(0, "undefined"), (1, "profile position"), (3, "profile velocity"), (4, "profile torque")];
