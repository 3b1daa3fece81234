//! The listed values of objects, with their meaning ("ZLIM42-C user manual V1.03", 5.4).

use crate::row::Values;

pub(super) const CURRENTS: Values = &[
    (0, "0.21 A rms, 0.3 A peak"),
    (1, "0.35 A rms, 0.5 A peak"),
    (2, "0.57 A rms, 0.8 A peak"),
    (3, "0.85 A rms, 1.2 A peak"),
    // Printed 1.10 A rms; the other rows are the peak over the root of 2.
    (4, "1.06 A rms, 1.5 A peak"),
    (5, "1.20 A rms, 1.7 A peak"),
    (6, "1.34 A rms, 1.9 A peak"),
    (7, "1.56 A rms, 2.2 A peak"),
];
pub(super) const MICROSTEPS: Values = &[
    (0, "200 pulses a turn"),
    (1, "400 pulses a turn"),
    (2, "800 pulses a turn"),
    (3, "1600 pulses a turn"),
    (4, "3200 pulses a turn"),
    (5, "6400 pulses a turn"),
    (6, "12800 pulses a turn"),
    (7, "25600 pulses a turn"),
    (8, "1000 pulses a turn"),
    (9, "2000 pulses a turn"),
    (10, "4000 pulses a turn"),
    (11, "5000 pulses a turn"),
    (12, "8000 pulses a turn"),
    (13, "10000 pulses a turn"),
    (14, "20000 pulses a turn"),
    (15, "25000 pulses a turn"),
];
pub(super) const LOCK_CURRENTS: Values = &[(0, "half current"), (1, "full current")];
pub(super) const BAUD_RATES: Values = &[
    (0, "1000 kbit/s"),
    (1, "500 kbit/s"),
    (2, "250 kbit/s"),
    (3, "125 kbit/s"),
    (4, "100 kbit/s"),
    (5, "50 kbit/s"),
    (6, "25 kbit/s"),
];
pub(super) const RESET: Values = &[(0, "invalid"), (1, "reset the fault")];
pub(super) const OUTPUT_FUNCTIONS: Values =
    &[(0, "undefined"), (1, "alarm"), (2, "drive status"), (3, "homing done"), (4, "in position")];
pub(super) const QUICK_STOP_OPTIONS: Values = &[
    (5, "normal stop, stay in quick stop active"),
    (6, "quick stop ramp, stay in quick stop active"),
    (7, "emergency stop, stay in quick stop active"),
];
pub(super) const DISABLE_OPTIONS: Values = &[(0, "stop at once"), (1, "normal stop, then switched on")];
pub(super) const HALT_OPTIONS: Values = &[(1, "normal stop"), (2, "quick stop ramp"), (3, "emergency stop")];
pub(super) const MODES: Values = &[(0, "undefined"), (1, "profile position"), (3, "profile velocity"), (6, "homing")];
pub(super) const HOMING_METHODS: Values = &[
    (0, "none"),
    (17, "negative limit switch"),
    (18, "positive limit switch"),
    (24, "home switch, positive first"),
    (29, "home switch, negative first"),
];
