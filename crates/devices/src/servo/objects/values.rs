//! What the values of the option codes, modes and methods mean (CiA 402-2), in our words.

use crate::row::Values;

pub(super) const MODES: Values = &[
    (0, "no mode"),
    (1, "profile position"),
    (2, "velocity"),
    (3, "profile velocity"),
    (4, "profile torque"),
    (6, "homing"),
    (7, "interpolated position"),
    (8, "cyclic synchronous position"),
    (9, "cyclic synchronous velocity"),
    (10, "cyclic synchronous torque"),
    (11, "cyclic synchronous torque with commutation angle"),
];

pub(super) const ABORT_CONNECTION: Values = &[(0, "nothing"), (1, "fault"), (2, "disable voltage"), (3, "quick stop")];

pub(super) const QUICK_STOP: Values = &[
    (0, "off at once"),
    (1, "slow down, then off"),
    (2, "quick stop, then off"),
    (3, "current limit, then off"),
    (4, "voltage limit, then off"),
    (5, "slow down and stay"),
    (6, "quick stop and stay"),
    (7, "current limit and stay"),
    (8, "voltage limit and stay"),
];

pub(super) const SHUTDOWN: Values = &[(0, "off at once"), (1, "slow down, then off")];

pub(super) const HALT: Values = &[(1, "slow down"), (2, "quick stop"), (3, "current limit"), (4, "voltage limit")];

pub(super) const FAULT_REACTION: Values =
    &[(0, "off at once"), (1, "slow down"), (2, "quick stop"), (3, "current limit"), (4, "voltage limit")];

pub(super) const PROFILE_TYPES: Values = &[(0, "linear"), (3, "jerk-limited")];

pub(super) const JERK_USES: Values = &[
    (1, "jerk 1 for all"),
    (2, "jerk 1 to speed up, jerk 2 to slow down"),
    (4, "jerks 1 and 2 at beginning and end of speeding up, 3 and 4 of slowing down"),
];

pub(super) const HOMING_METHODS: Values = &[
    (0, "no method"),
    (1, "negative limit switch, then index pulse"),
    (2, "positive limit switch, then index pulse"),
    (3, "positive home switch, then index pulse below it"),
    (4, "positive home switch, then index pulse on it"),
    (5, "negative home switch, then index pulse above it"),
    (6, "negative home switch, then index pulse on it"),
    (7, "home switch from below: index pulse below its lower edge"),
    (8, "home switch from below: index pulse above its lower edge"),
    (9, "home switch from below: index pulse below its upper edge"),
    (10, "home switch from below: index pulse above its upper edge"),
    (11, "home switch from above: index pulse above its upper edge"),
    (12, "home switch from above: index pulse below its upper edge"),
    (13, "home switch from above: index pulse above its lower edge"),
    (14, "home switch from above: index pulse below its lower edge"),
    (17, "negative limit switch"),
    (18, "positive limit switch"),
    (19, "positive home switch, going off"),
    (20, "positive home switch, going on"),
    (21, "negative home switch, going off"),
    (22, "negative home switch, going on"),
    (23, "home switch from below: lower edge, going off"),
    (24, "home switch from below: lower edge, going on"),
    (25, "home switch from below: upper edge, going on"),
    (26, "home switch from below: upper edge, going off"),
    (27, "home switch from above: upper edge, going off"),
    (28, "home switch from above: upper edge, going on"),
    (29, "home switch from above: lower edge, going on"),
    (30, "home switch from above: lower edge, going off"),
    (33, "index pulse below"),
    (34, "index pulse above"),
    (35, "here (the number of the first edition)"),
    (37, "here"),
];
