//! Profile objects, 6007h to 67FEh (CiA 402-2). Where the standard leaves a default to the maker it is chosen for the
//! motor below, and for position units that are encoder increments.

use canopen::od::Entry;

use super::values::{
    ABORT_CONNECTION, FAULT_REACTION, HALT, HOMING_METHODS, JERK_USES, MODES, PROFILE_TYPES, QUICK_STOP, SHUTDOWN,
};
use crate::row::cia::{ro, rw, wo};
use crate::row::{I8, I16, I32, U8, U16, U32};

/// Encoder increments in a turn: the 17 bits of the default motor's encoder.
pub const INCREMENTS_PER_TURN: i64 = 131_072;

/// Turns per second in the motor's rated 3000 r/min.
const RATED_TURNS_S: i64 = 50;

const TURN: i64 = INCREMENTS_PER_TURN;

const INC: &str = "inc";
const INC_S: &str = "inc/s";
const INC_S2: &str = "inc/s^2";
const INC_S3: &str = "inc/s^3";
const PER_MILLE: &str = "0.1 %";

/// Number of rows.
pub(super) const ROW_COUNT: usize = 144;

#[rustfmt::skip]
pub(super) static ROWS: [Entry; ROW_COUNT] = [
    rw(0x6007, 0, I16).described("What a lost connection does").values(ABORT_CONNECTION).default(1).saved(),
    ro(0x603F, 0, U16).mappable(),
    rw(0x6040, 0, U16).mappable(),
    ro(0x6041, 0, U16).mappable(),
    rw(0x605A, 0, I16).described("What a quick stop does").values(QUICK_STOP).default(2).saved(),
    rw(0x605B, 0, I16).described("What shutdown does").values(SHUTDOWN).default(0).saved(),
    rw(0x605C, 0, I16).described("What disable operation does").values(SHUTDOWN).default(1).saved(),
    rw(0x605D, 0, I16).described("What halt does").values(HALT).default(1).saved(),
    rw(0x605E, 0, I16).described("What a fault does").values(FAULT_REACTION).default(2).saved(),
    rw(0x6060, 0, I8).described("Mode asked for").values(MODES).mappable(),
    ro(0x6061, 0, I8).described("Mode in effect").values(MODES).mappable(),
    ro(0x6062, 0, I32).unit(INC).mappable(),
    ro(0x6063, 0, I32).described("Position by the encoder").unit(INC).mappable(),
    ro(0x6064, 0, I32).unit(INC).mappable(),
    rw(0x6065, 0, U32).described("Following error that is tolerated; FFFFFFFFh is any").default(TURN / 4).unit(INC).mappable().saved(),
    rw(0x6066, 0, U16).described("How long more than that is tolerated").default(100).unit("ms").mappable().saved(),
    rw(0x6067, 0, U32).described("How near a target position is reached; FFFFFFFFh is any").default(TURN / 1000).unit(INC).mappable().saved(),
    rw(0x6068, 0, U16).described("How long it has to be as near").default(10).unit("ms").mappable().saved(),
    ro(0x606B, 0, I32).unit(INC_S).mappable(),
    ro(0x606C, 0, I32).unit(INC_S).mappable(),
    // The standard leaves it to makers. A thousandth of the rated speed, 3 r/min: three times the increment that one supervision
    // period of 0.5 ms may see more or less, and less than what a host that turns anything at all asks for.
    rw(0x606D, 0, U16).described("How near a target velocity is reached").default(RATED_TURNS_S * TURN / 1000).unit(INC_S).mappable().saved(),
    rw(0x606E, 0, U16).described("How long it has to be as near").default(10).unit("ms").mappable().saved(),
    rw(0x606F, 0, U16).described("Velocity that counts as standstill").default(TURN / 10).unit(INC_S).mappable().saved(),
    rw(0x6070, 0, U16).described("How long it has to be as slow").default(10).unit("ms").mappable().saved(),
    rw(0x6071, 0, I16).unit(PER_MILLE).mappable(),
    rw(0x6072, 0, U16).default(3000).unit(PER_MILLE).mappable().saved(),
    rw(0x6073, 0, U16).default(3000).unit(PER_MILLE).saved(),
    ro(0x6074, 0, I16).unit(PER_MILLE).mappable(),
    rw(0x6075, 0, U32).default(2800).unit("mA").saved(),
    rw(0x6076, 0, U32).default(1270).unit("mN m").saved(),
    ro(0x6077, 0, I16).unit(PER_MILLE).mappable(),
    ro(0x6078, 0, I16).unit(PER_MILLE).mappable(),
    ro(0x6079, 0, U32).unit("mV").mappable(),
    rw(0x607A, 0, I32).unit(INC).mappable(),
    rw(0x607C, 0, I32).described("Zero position seen from the home position").unit(INC).saved(),
    ro(0x607D, 0, U8).default(2),
    rw(0x607D, 1, I32).default(i32::MIN as i64).unit(INC).saved(),
    rw(0x607D, 2, I32).default(i32::MAX as i64).unit(INC).saved(),
    rw(0x607E, 0, U8).described("Bit 7: positions, bit 6: velocities change their sign").saved(),
    rw(0x607F, 0, U32).default(RATED_TURNS_S * 5 / 3 * TURN).unit(INC_S).mappable().saved(),
    rw(0x6080, 0, U32).default(5000).unit("r/min").mappable().saved(),
    rw(0x6081, 0, U32).described("Velocity of position moves").default(10 * TURN).unit(INC_S).mappable().saved(),
    rw(0x6083, 0, U32).default(200 * TURN).unit(INC_S2).mappable().saved(),
    rw(0x6084, 0, U32).default(200 * TURN).unit(INC_S2).mappable().saved(),
    rw(0x6085, 0, U32).default(1000 * TURN).unit(INC_S2).mappable().saved(),
    rw(0x6086, 0, I16).described("Shape of ramps").values(PROFILE_TYPES).mappable().saved(),
    rw(0x6087, 0, U32).default(10_000).unit("0.1 %/s").mappable().saved(),
    rw(0x6088, 0, I16).described("Shape of torque ramps").values(&[(0, "linear")]).mappable().saved(),
    ro(0x608F, 0, U8).default(2),
    ro(0x608F, 1, U32).default(TURN),
    ro(0x608F, 2, U32).described("Motor turns that the encoder increments are counted over").default(1),
    ro(0x6091, 0, U8).default(2),
    rw(0x6091, 1, U32).default(1).range(1, u32::MAX as i64).saved(),
    rw(0x6091, 2, U32).described("Turns of the driving shaft for the motor revolutions of sub-index 01h").default(1).range(1, u32::MAX as i64).saved(),
    ro(0x6092, 0, U8).default(2),
    rw(0x6092, 1, U32).described("Position units for the shaft revolutions of sub-index 02h").default(TURN).range(1, u32::MAX as i64).saved(),
    rw(0x6092, 2, U32).described("Turns of the driving shaft for the feed of sub-index 01h").default(1).range(1, u32::MAX as i64).saved(),
    ro(0x6096, 0, U8).default(2),
    rw(0x6096, 1, U32).described("Velocity units").default(1).range(1, u32::MAX as i64).saved(),
    rw(0x6096, 2, U32).described("Position units per second for the velocity units of sub-index 01h").default(1).range(1, u32::MAX as i64).saved(),
    ro(0x6097, 0, U8).default(2),
    rw(0x6097, 1, U32).described("Acceleration units").default(1).range(1, u32::MAX as i64).saved(),
    rw(0x6097, 2, U32).described("Velocity units per second for the acceleration units of sub-index 01h").default(1).range(1, u32::MAX as i64).saved(),
    rw(0x6098, 0, I8).values(HOMING_METHODS).mappable().saved(),
    ro(0x6099, 0, U8).default(2),
    rw(0x6099, 1, U32).described("Velocity of the search for a switch").default(5 * TURN).unit(INC_S).mappable().saved(),
    rw(0x6099, 2, U32).described("Velocity of the search for the home position").default(TURN / 2).unit(INC_S).mappable().saved(),
    rw(0x609A, 0, U32).described("Acceleration and deceleration of homing").default(200 * TURN).unit(INC_S2).mappable().saved(),
    rw(0x60A3, 0, U8).described("Which jerks 60A4h has").values(JERK_USES).default(1).mappable().saved(),
    ro(0x60A4, 0, U8).default(4),
    rw(0x60A4, 1, U32).default(10_000 * TURN).unit(INC_S3).mappable().saved(),
    rw(0x60A4, 2, U32).default(10_000 * TURN).unit(INC_S3).mappable().saved(),
    rw(0x60A4, 3, U32).default(10_000 * TURN).unit(INC_S3).mappable().saved(),
    rw(0x60A4, 4, U32).default(10_000 * TURN).unit(INC_S3).mappable().saved(),
    rw(0x60B0, 0, I32).described("Added to the target position").unit(INC).mappable(),
    rw(0x60B1, 0, I32).described("Added to the velocity demand").unit(INC_S).mappable(),
    rw(0x60B2, 0, I16).described("Added to the torque demand").unit(PER_MILLE).mappable(),
    rw(0x60B8, 0, U16).described("What the two touch probes do").mappable(),
    ro(0x60B9, 0, U16).described("What the two touch probes have").mappable(),
    ro(0x60BA, 0, I32).described("Position at the rising edge of probe 1").unit(INC).mappable(),
    ro(0x60BB, 0, I32).described("Position at the falling edge of probe 1").unit(INC).mappable(),
    ro(0x60BC, 0, I32).described("Position at the rising edge of probe 2").unit(INC).mappable(),
    ro(0x60BD, 0, I32).described("Position at the falling edge of probe 2").unit(INC).mappable(),
    rw(0x60C0, 0, I16).described("How set-points are joined").values(&[(-1, "cubic"), (0, "linear")]).mappable().saved(),
    ro(0x60C1, 0, U8).default(1),
    rw(0x60C1, 1, I32).unit(INC).mappable(),
    ro(0x60C2, 0, U8).default(2),
    rw(0x60C2, 1, U8).described("Time between two set-points").default(1).range(1, 255).mappable().saved(),
    rw(0x60C2, 2, I8).described("Power of ten, in seconds, that the period is multiplied by").default(-3).range(-6, 0).mappable().saved(),
    ro(0x60C4, 0, U8).default(6),
    ro(0x60C4, 1, U32).described("Most set-points that may wait").default(64),
    rw(0x60C4, 2, U32).described("Set-points that may wait; 1: each acts as it comes").default(1).range(1, 64).saved(),
    rw(0x60C4, 3, U8).described("How they wait").values(&[(0, "first in, first out"), (1, "ring")]).saved(),
    rw(0x60C4, 4, U16).described("First in, first out: how many wait; ring: the place to fill").range(0, 64),
    ro(0x60C4, 5, U8).default(4),
    wo(0x60C4, 6, U8).described("Whether set-points may wait").values(&[(0, "cleared and closed"), (1, "open")]),
    rw(0x60C5, 0, U32).default(u32::MAX as i64).unit(INC_S2).mappable().saved(),
    rw(0x60C6, 0, U32).default(u32::MAX as i64).unit(INC_S2).mappable().saved(),
    rw(0x60E0, 0, U16).described("Torque limit towards larger positions").default(3000).unit(PER_MILLE).mappable().saved(),
    rw(0x60E1, 0, U16).described("Torque limit towards smaller positions").default(3000).unit(PER_MILLE).mappable().saved(),
    // INTEGER8 as 6098h is; makers' files have UNSIGNED8 too, which is the same for these.
    ro(0x60E3, 0, U8).default(32),
    ro(0x60E3, 1, I8).default(1),
    ro(0x60E3, 2, I8).default(2),
    ro(0x60E3, 3, I8).default(3),
    ro(0x60E3, 4, I8).default(4),
    ro(0x60E3, 5, I8).default(5),
    ro(0x60E3, 6, I8).default(6),
    ro(0x60E3, 7, I8).default(7),
    ro(0x60E3, 8, I8).default(8),
    ro(0x60E3, 9, I8).default(9),
    ro(0x60E3, 10, I8).default(10),
    ro(0x60E3, 11, I8).default(11),
    ro(0x60E3, 12, I8).default(12),
    ro(0x60E3, 13, I8).default(13),
    ro(0x60E3, 14, I8).default(14),
    ro(0x60E3, 15, I8).default(17),
    ro(0x60E3, 16, I8).default(18),
    ro(0x60E3, 17, I8).default(19),
    ro(0x60E3, 18, I8).default(20),
    ro(0x60E3, 19, I8).default(21),
    ro(0x60E3, 20, I8).default(22),
    ro(0x60E3, 21, I8).default(23),
    ro(0x60E3, 22, I8).default(24),
    ro(0x60E3, 23, I8).default(25),
    ro(0x60E3, 24, I8).default(26),
    ro(0x60E3, 25, I8).default(27),
    ro(0x60E3, 26, I8).default(28),
    ro(0x60E3, 27, I8).default(29),
    ro(0x60E3, 28, I8).default(30),
    ro(0x60E3, 29, I8).default(33),
    ro(0x60E3, 30, I8).default(34),
    ro(0x60E3, 31, I8).default(35),
    ro(0x60E3, 32, I8).default(37),
    ro(0x60F4, 0, I32).unit(INC).mappable(),
    ro(0x60FA, 0, I32).described("Velocity that the position loop asks for").unit(INC_S).mappable(),
    ro(0x60FC, 0, I32).described("Position demand by the encoder").unit(INC).mappable(),
    ro(0x60FD, 0, U32).described("Bit 0: negative limit, 1: positive limit, 2: home switch").mappable(),
    ro(0x60FE, 0, U8).default(2),
    rw(0x60FE, 1, U32).mappable(),
    rw(0x60FE, 2, U32).described("Outputs that the host drives").saved(),
    rw(0x60FF, 0, I32).unit(INC_S).mappable(),
    // Permanent magnets, sine.
    ro(0x6402, 0, U16).default(10),
    // pp, pv, tq, hm, ip, csp, csv, cst.
    ro(0x6502, 0, U32).default(0x03ED),
    // Of the profile: 4.0. Read as major, minor and revision in bits 16 to 23, 8 to 15 and 0 to 7.
    ro(0x67FE, 0, U32).default(0x0004_0000),
];
