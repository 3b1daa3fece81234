//! Figures that the manual ("ZLIM42-C user manual V1.03") does not give, each with the reason for its value.

use crate::engine::actuator::stepper::AtLimit;

pub use devices::zltech::zlim42c::assumptions::*;

/// Rotor teeth of a motor with 200 full steps: electrical turns in a turn of the shaft.
pub const TEETH: u32 = 50;

/// Control period: 20 kHz, usual for the switching of such a power stage, and inaudible.
pub const CONTROL_PERIOD_NS: u64 = 50_000;

/// Control period in seconds.
pub const CONTROL_PERIOD_S: f32 = 50e-6;

/// Control periods in one supervision period: 0.5 ms, the unit of the sibling's PDO timers.
pub const SUPERVISION_DIVIDER: u8 = 10;

/// Supervision period in seconds.
pub const SUPERVISION_PERIOD_S: f64 = 0.5e-3;

/// Supervision periods in a tick at fidelity mechanical: nothing here is regulated by what is measured, and a field whose way is
/// straight for 1 ms turns a rotor that swings at some 300 Hz as smoothly.
pub const MECHANICAL_SUPERVISIONS: u16 = 2;

/// Communication task: 0.5 ms, the unit of the sibling's PDO timers.
pub const COMMUNICATION_PERIOD_NS: u64 = 500_000;

/// Highest speed of 6081h and 60FFh, r/min.
pub const MAX_SPEED_RPM: f64 = 3000.0;

/// Bus voltage above which the drive reports over-voltage (2.1).
pub const OVER_VOLTAGE_V: f32 = 40.0;

/// How far the bus voltage has to come back before the fault's cause counts as gone.
pub const VOLTAGE_HYSTERESIS_V: f32 = 1.0;

/// 1 ms: longer than a switching transient, shorter than what the capacitors of the bus survive.
pub const VOLTAGE_DEBOUNCE_PERIODS: u16 = 2;

/// Phase current that counts as over-current, A: three times the highest setting (2.2 A). What a vector that jumps from 3000
/// r/min or a rotor that slips drives through the windings stays below, what a short circuit draws is far above.
pub const OVER_CURRENT_A: f32 = 6.6;

/// Phase over-current is watched every control period and acts at once.
pub const OVER_CURRENT_DEBOUNCE_PERIODS: u16 = 1;

/// Current drawn from the supply that counts as over-current, A, mean over a supervision period: both phases of a vector
/// of the highest setting with the full bus voltage are the most that a sound motor draws (2.2 A times the root of 2).
pub const BUS_OVER_CURRENT_A: f32 = 3.2;

/// 10 ms: the capacitors of the bus carry shorter pulses.
pub const BUS_OVER_CURRENT_DEBOUNCE_PERIODS: u16 = 20;

/// A phase counts as lost when it is asked for at least this share of the amplitude ...
pub const PHASE_ASKED_SHARE: f32 = 0.3;

/// ... and carries less than this share of it ...
pub const PHASE_CARRIED_SHARE: f32 = 0.05;

/// ... in all periods in which it is asked, for so many of them: 10 ms, ten times the rise time of the current.
pub const PHASE_LOSS_DEBOUNCE_PERIODS: u16 = 20;

/// Above this speed, r/min, a phase without current counts only beside a sound one. The motor's own voltage reaches a bus
/// of 20 V from 580 r/min on (82 mm, `K = 0.72 N m / 2.2 A`), and where both are equal an unloaded motor takes no current.
pub const PHASE_COMPARED_RPM: f64 = 300.0;

/// The other phase is sound if it carries at least this share of the amplitude: three hundredths of the smallest are 9 mA, and
/// more than the offset of a current measurement.
pub const PHASE_SOUND_SHARE: f32 = 0.03;

/// A phase that carries this share of the other one's current is not a lost one: the lower of two equal phases has 0.38 of the
/// higher, at the least, in a supervision period at the speed from which they are compared (an eighth of an electrical turn).
pub const PHASE_BESIDE_SHARE: f32 = 0.25;

/// Reference of the current measurement, V: the supply of the controller.
pub const REFERENCE_V: f32 = 3.3;

/// Tolerance of the reference: a current reading off by more would let the drive exceed its limits.
pub const REFERENCE_TOLERANCE_V: f32 = 0.33;

/// 5 ms.
pub const REFERENCE_DEBOUNCE_PERIODS: u16 = 10;

/// Supervision periods from the last pulse until the current falls to the lock current (2007h): 100 ms, long enough for
/// the rotor to settle after its last step.
pub const HOLD_AFTER_PERIODS: u16 = 200;

/// How far beyond the home switch methods 24 and 29 go before they come back slowly (5.3.6, "goes back some way"), in
/// turns: 18 degrees, ten full steps, more than a switch's hysteresis and the way of its filter time at 60 r/min.
pub const HOMING_BACK_OFF_TURNS: f64 = 0.05;

/// One count of 2040h, V/A: 600 counts give 15 V/A, a loop gain `kp T / L` of 0.27 and 0.14 with the windings of the two
/// lengths (2.8 and 5.4 mH). A voltage acts one control period late, so 0.25 is critically damped and 1 unstable.
pub const CURRENT_KP_V_PER_A: f32 = 25e-3;

/// One count of 2041h, V/(A s): 300 counts give an integral time of 10 ms. It is long against the swing of a rotor at high
/// speed, where the voltage is at its limit: a tenth of it feeds the swing until the rotor falls out of step before 3000
/// r/min.
pub const CURRENT_KI_V_PER_A_S: f32 = 5.0;

/// Share of the bus voltage that the bridges can give; the rest is dead time.
pub const MODULATION_LIMIT: f32 = 0.98;

/// What a voltage vector at its limit does against the rotor's swing. A guess, as such drives damp a swing in the middle of
/// their range of speed: 1 rad/A falls back about as far as the rotor does, since the current changes by `psi / L`, 1.6 and
/// 1.2 A for a radian of the two lengths.
pub const AT_LIMIT: AtLimit = AtLimit {
    turns_per_a: 1.0 / core::f32::consts::TAU,
    // A swing shows along the vector as the sine of the angles of load and impedance, 1 without a load and 0.4 at pull-out, and
    // across it as their cosine. More of that damps more near pull-out, and swings the rotor of 82 mm at half of it.
    across_share: 0.15,
    // Behind 0.7 ms, between a bare rotor's swing (230 Hz at 0.3 N m) and one of ten times its inertia (70 Hz): there the way
    // back comes a quarter of a swing late, which is what damps. Up to 30 ms: a load that stays turns nothing. Of what swings
    // slower the way back comes in time and damps nothing: a load of forty times the rotor's inertia (36 Hz) falls out of step
    // above the corner speed. Behind 3 ms it would not, but then a bare rotor would.
    passed: [CONTROL_PERIOD_S / 0.7e-3, CONTROL_PERIOD_S / 30e-3],
    // The integrals' own time is near the swing of a heavy load, which they feed.
    integral_share: 0.3,
};

/// Current across the vector that balances the detent, A: four fifths of it arrive in the motor, since the current loop passes
/// 0.87 and 0.80 of it at 60 r/min (`kp / (kp + R + j w L)` of the two lengths, four periods in an electrical turn), and that is
/// four fifths of the detent, 2.5 % of the holding torque's 2.2 A. A guess: the maker calls the vibration ultra-low (1.2), and
/// motor and drive are one unit, so that its wave of microsteps can be made for its motor. What the motors of a series differ
/// by remains.
pub const DETENT_CURRENT_A: f32 = 0.05;

/// Settings of 2006h from which microsteps lie where the detent is not zero: a quarter step and finer.
pub const DETENT_FROM_PULSES: u16 = 800;

/// How far ahead of the angle it is asked for, control periods: 1.5 until the voltage acts, and what the current loop lags at
/// that frequency, 3.3 and 5.8 with the windings of the two lengths.
pub const DETENT_LEAD_PERIODS: f32 = 5.0;
