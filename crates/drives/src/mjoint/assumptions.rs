//! Figures that the manual ("M Robot Joint Motor CanOpen Manual") does not give, each with the reason for its value.

pub use devices::mjoint::assumptions::*;

/// Counts/s in one r/min.
pub const COUNTS_S_PER_RPM: f64 = COUNTS_PER_TURN as f64 / 60.0;

/// Control period: 20 kHz, usual for the switching of such a power stage.
pub const CONTROL_PERIOD_NS: u64 = 50_000;

/// Control period in seconds.
pub const CONTROL_PERIOD_S: f32 = 50e-6;

/// Control periods in one supervision period.
pub const SUPERVISION_DIVIDER: u8 = 10;

/// Supervision period: "location sampling frequency 2 kHz".
pub const SUPERVISION_PERIOD_S: f32 = 0.5e-3;

/// Communication task: with the supervision.
pub const COMMUNICATION_PERIOD_NS: u64 = 500_000;

/// Supervision periods in the time base of the interpolation, 2 ms (261Ch).
pub const INTERPOLATION_PERIODS: u8 = 4;

/// Value of 261Ch with which DIR is the clock of the interpolation.
pub const DIR_IS_CLOCK: u16 = 255;

/// What one change of DIR's level stands for then ("switch between high and low levels every 0.1ms").
pub const DIR_CLOCK_S: f64 = 0.1e-3;

/// With 2618h without an alarm (ones digit 0), the output of a motor that has stalled for so long is halved. The manual of
/// the same maker's AIM servos, special function 18h.
pub const HALVED_AFTER_S: f32 = 3.0;

/// Turning for so long, it has its whole output again: longer than a gear that unwinds swings.
pub const TURNS_AGAIN_S: f32 = 0.2;

/// Field weakening keeps the voltage at this share of what the power stage can give.
pub const WEAKENING_VOLTAGE_SHARE: f32 = 0.99;

/// Its regulator uses up the whole angle within 25 ms at a tenth of voltage too much, and is far slower than the
/// current loop.
pub const WEAKENING_PER_S: f32 = 400.0;

/// Over-voltage alarm ("Alarm over 52V").
pub const OVER_VOLTAGE_V: f32 = 52.0;

/// How far the voltage has to come back before the alarm can be reset.
pub const VOLTAGE_HYSTERESIS_V: f32 = 1.0;

/// 1 ms: longer than a switching transient, shorter than what the capacitors survive.
pub const VOLTAGE_DEBOUNCE_PERIODS: u16 = 2;

/// The current counts as at its limit from this share of it: a regulated current swings about its set-point.
pub const AT_CURRENT_LIMIT_SHARE: f32 = 0.95;

/// Under this speed the motor is stationary: 2618h limits its output then, and it can stall, r/min. An eighth of
/// the slowest homing speed.
pub const STATIONARY_RPM: f32 = 12.0;

/// Under this speed the motor counts as standing for bit 10, r/min: two counts in a supervision period.
pub const STANDSTILL_RPM: f32 = 8.0;

/// Tolerance of "target position reached", counts: a third of a degree of the motor's shaft.
pub const POSITION_REACHED_COUNTS: u32 = 30;

/// Tolerance of "given speed reached", r/min: 1 % of the rated speeds.
pub const SPEED_REACHED_RPM: f64 = 10.0;

/// Longest span over which the velocity is taken from counts: a supervision period, of which one count is 4 r/min.
pub const VELOCITY_WINDOW_S: f32 = 0.5e-3;

/// Without a count for so long the velocity reads zero: 0.1 r/min.
pub const VELOCITY_STANDSTILL_S: f32 = 20e-3;

/// Time constant of the measured velocity: a tenth of the velocity loop's own, and four noisy samples.
pub const VELOCITY_FILTER_S: f32 = 0.2e-3;

/// Time constant of what 606Ch and 6078h show: a host sees the mean of its cycle, not one sample.
pub const DISPLAY_FILTER_S: f32 = 5e-3;

/// How long an input must hold a level to be shown in 60FDh: two supervision periods.
pub const INPUT_DEBOUNCE_PERIODS: u8 = 2;

/// Duty cycle of speed 0 and of [`DUTY_FULL_RPM`], and that speed ("10%~90% for 0~1000RPM").
pub const DUTY_ZERO: f32 = 0.1;
/// See [`DUTY_ZERO`].
pub const DUTY_FULL: f32 = 0.9;
/// See [`DUTY_ZERO`].
pub const DUTY_FULL_RPM: f64 = 1000.0;

/// 6063h in the parameter store of a joint that has never been switched off: beyond its 60000 turns.
pub const NO_RECORD: i32 = i32::MIN;

/// 260Ah: the first and second value of setting the multi-turn origin.
pub const SET_ORIGIN: [u16; 2] = [60006, 60016];
