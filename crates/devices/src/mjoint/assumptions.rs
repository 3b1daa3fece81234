//! Figures of the description that the manual ("M Robot Joint Motor CanOpen Manual") gives in passing or not at all, each with
//! the reason for its value.

/// Counts of the encoder in one turn of the motor's shaft: "15 bit absolute encoder, one lap pulse up to 32768".
pub const COUNTS_PER_TURN: u32 = 32768;

/// 6081h as delivered, r/min: rated speed of the M4230, highest speed of the M8025.
pub const PROFILE_VELOCITY_RPM: i64 = 1500;

/// 6083h as delivered, (r/min)/s: the value of the examples in 5.06.
pub const ACCELERATION_RPM_S: i64 = 20_000;

/// From this value of 6083h on there is no ramp ("Parameter debugging", 1).
pub const NO_RAMP_FROM: u32 = 60_000;

/// 60F9h:01 as delivered: see the gains of the firmware. Its ones digit is even.
pub const VELOCITY_KP: i64 = 3000;

/// 60F9h:02 as delivered: see the gains of the firmware.
pub const VELOCITY_INTEGRAL_TIME_MS: i64 = 30;

/// 60FBh:01 as delivered: what the manual gives for a stiff load ("Wire rod load"). Its ones digit is even.
pub const POSITION_KP: i64 = 3000;

/// 2618h as delivered: 16 % for 5 s. Enough to start the printed torque with a winding of 85 degC (M8025: 2 N·m take 9.9 A
/// of amplitude, 3.4 V of 20.8 V). A locked output then stays under 95 % of the 10 A of 261Dh (M8025
/// cold: 8.6 A), so that it is 14h that comes, the alarm that is called stall.
pub const STATIONARY_MAX_OUTPUT: i64 = 165;

/// 261Dh as delivered: 10 A, the most that it takes, for 5 s. The printed torques behind the reducers take 3.5 and 7 A.
pub const MAX_ALLOWABLE_CURRENT: i64 = 10005;

/// 2604h as delivered, 0.1 degrees: the whole range, with which the motors reach their printed maximum speed. The range
/// and the unit are those of the AIM servos' manual.
pub const WEAK_MAGNETIC_ANGLE: i64 = 200;
