//! Figures that the manual ("ZLAC8030L quick start guide V1.00") does not give, each with the reason for its value.

pub use devices::zltech::zlac8030l::assumptions::*;

/// Control period: 20 kHz, usual for the switching of such a power stage.
pub const CONTROL_PERIOD_NS: u64 = 50_000;

/// Control periods in one supervision period: 0.5 ms, the unit of the drive's PDO timers.
pub const SUPERVISION_DIVIDER: u8 = 10;

/// Supervision period in seconds.
pub const SUPERVISION_PERIOD_S: f32 = 0.5e-3;

/// Supervision periods that one at fidelity mechanical stands for: 1 ms, an eighth of the velocity loop's time with the faster of the
/// two windings.
pub const MECHANICAL_SUPERVISIONS: u16 = 2;

/// Communication task: 0.5 ms, the unit of the drive's PDO timers (6.1).
pub const COMMUNICATION_PERIOD_NS: u64 = 500_000;

/// Bus voltage below which the drive reports under-voltage. Source: the maker's "ZLAC8030L hardware manual" V1.00, as is
/// that of over-voltage. The sibling ZLAC8015D has the same.
pub const UNDER_VOLTAGE_V: f32 = 16.0;

/// Bus voltage above which the drive reports over-voltage.
pub const OVER_VOLTAGE_V: f32 = 75.0;

/// How far the bus voltage has to come back before the fault's cause counts as gone.
pub const VOLTAGE_HYSTERESIS_V: f32 = 1.0;

/// 1 ms: longer than a switching transient, shorter than what the capacitors of the bus survive.
pub const VOLTAGE_DEBOUNCE_PERIODS: u16 = 2;

/// Phase current that counts as over-current, A. Above the largest current that 2015h allows (60 A) by the
/// overshoot of a well damped current loop and measurement error, a third.
pub const OVER_CURRENT_A: f32 = 80.0;

/// Over-current is watched every control period and acts at once; the cause must be there at one look.
pub const OVER_CURRENT_DEBOUNCE_PERIODS: u16 = 1;

/// A motor wire counts as loose when the voltage is at its limit and the current stays under this share of what is
/// asked for: chapter 8 names a loose power cable as a cause of over-current (0004h).
pub const LOOSE_WIRE_CURRENT_SHARE: f32 = 0.5;

/// Least current set-point at which a loose wire can be detected, A.
pub const LOOSE_WIRE_LEAST_A: f32 = 1.0;

/// Above this speed the motor's own voltage can hold the current down, and missing current says nothing by itself, r/min.
pub const LOOSE_WIRE_MOST_RPM: f32 = 20.0;

/// How long it must be so: ten electrical time constants of a hub motor (3 ms) and more.
pub const LOOSE_WIRE_PERIODS: u16 = 200;

/// A wire of a turning motor counts as loose when it carries less than this share of what the largest of the others does. In a
/// sound motor that is so in a seventh of an electrical turn, in two pieces.
pub const LOOSE_WIRE_CARRIED_SHARE: f32 = 0.25;

/// Least current of the others, A: a quarter of it is more than a reading of nothing is off by (a step and a half of 29 mA). A
/// hub motor without a load takes twice as much.
pub const LOOSE_WIRE_OTHERS_A: f32 = 0.2;

/// How far the motor turns meanwhile, there and back counted, in electrical turns: seven times what a sound one does at a stretch.
pub const LOOSE_WIRE_TURNS: f32 = 0.5;

/// How far apart the ends of that way are, in electrical turns: twice a stretch in which a sound motor leaves a wire empty. A
/// heavy load makes a motor with a loose wire swing over more.
pub const LOOSE_WIRE_SPAN_TURNS: f32 = 0.15;

/// The most that one supervision period counts, in electrical turns: a wire is watched for 10 ms at the least.
pub const LOOSE_WIRE_MOST_TURNS: f32 = 0.025;

/// 5 ms: a Hall edge that is caught half way reads 0 or 7 for one control period at most.
pub const SENSOR_DEBOUNCE_PERIODS: u16 = 10;

/// 50 ms: temperatures are slow, a noisy reading is not a fault.
pub const TEMPERATURE_DEBOUNCE_PERIODS: u16 = 100;

/// How far a temperature has to fall below its threshold before the fault's cause counts as gone, degC.
pub const TEMPERATURE_HYSTERESIS_C: f32 = 5.0;

/// Reference of the current measurement, V: the supply of the controller.
pub const REFERENCE_V: f32 = 3.3;

/// Tolerance of the reference: a current reading off by more would let the drive exceed its limits.
pub const REFERENCE_TOLERANCE_V: f32 = 0.33;

/// Largest disagreement of encoder and Hall sensors at a Hall edge, in electrical turns. A dead encoder is off by a
/// sixth of a turn; sampling at 1000 r/min and 64 pole pairs is off by a nineteenth.
pub const HALL_DISAGREEMENT_TURNS: f32 = 0.125;

/// Current in parking mode (5.2).
pub const PARKING_CURRENT_A: f32 = 3.0;

/// Tolerance of "speed in place" (bit 10 in profile velocity), r/min: there is no 606Dh.
pub const VELOCITY_REACHED_RPM: f32 = 5.0;

/// Tolerance of "target torque reached" (bit 10 in profile torque), A: two counts of 6077h.
pub const TORQUE_REACHED_A: f32 = 0.2;

/// Speed below which the motor counts as standing (bits 12 and 14, 2027h), r/min: twice the speed of one encoder count
/// (4096 to the turn) in 30 ms.
pub const STANDSTILL_RPM: f32 = 1.0;

/// How long a digital input must hold a level: more than 10 ms, by the maker's hardware manual V1.00.
pub const INPUT_DEBOUNCE_PERIODS: u8 = 21;

/// Control period in seconds.
pub const CONTROL_PERIOD_S: f32 = 50e-6;

/// Longest span over which velocity is taken from counts: 2 to 4 ms, of which one control period is at most 2.5 %.
pub const VELOCITY_WINDOW_S: f32 = 4e-3;

/// Without a count for so long the velocity reads zero: 0.15 r/min with 4096 counts a turn.
pub const VELOCITY_STANDSTILL_S: f32 = 0.1;

/// Time constant of what 606Ch and 6077h show: a host's PDO sees the mean of its cycle, not one sample.
pub const DISPLAY_FILTER_S: f32 = 5e-3;

/// Supply voltage from which the firmware trusts its supply after power-on, and how long it waits: the
/// capacitors charge through the source's resistance.
pub const SUPPLY_SETTLING_PERIODS: u16 = 100;

/// Times of the note below the object table as shares of the one at rated current, which is 2016h: 20 s, 6 s and 4 s at once,
/// twice and three times the rated current.
pub const OVERLOAD_TIME_SHARES: [(f32, f32); 3] = [(1.0, 1.0), (2.0, 0.3), (3.0, 0.2)];

/// Multiple of the rated current from which time is counted, where 2012h does not put it lower. Guess: the rated current
/// itself can be carried for ever, and a regulated current swings about it by less than this.
pub const OVERLOAD_FROM: f32 = 1.05;

/// Energy that the bleeder resistor bears beyond its rated power (202Eh:02), as a time of that power: ten seconds, of the
/// order that makers of wire-wound resistors allow (ten times the power for a second or two).
pub const BLEEDER_OVERLOAD_S: f32 = 10.0;
