//! Drive profile parameters, 603Fh to 60FFh ("ZLIM42-C user manual V1.03", 5.4, CiA 402 group).
//!
//! Where chapter 5.3 and the table of 5.4 differ, the table holds: 607Ch, 6099h and 609Ah have narrower ranges there.

use canopen::od::Entry;

use super::values::{DISABLE_OPTIONS, HALT_OPTIONS, HOMING_METHODS, MODES, QUICK_STOP_OPTIONS};
use crate::row::cia::{ro, rw};
use crate::row::{I8, I16, I32, U8, U16, U32};
use crate::zltech::values::SHUTDOWN_OPTIONS;

crate::row::rows! { pub(super) const ROWS: [Entry; 24], profile_objects:
    ro(0x603F, 0, U16).described("Last fault code").mappable() => ERROR_CODE;
    rw(0x6040, 0, U16).mappable() => CONTROLWORD;
    ro(0x6041, 0, U16).mappable() => STATUSWORD;
    rw(0x605A, 0, I16).described("Quick stop code").values(QUICK_STOP_OPTIONS).default(5);
    rw(0x605B, 0, I16).described("Shutdown code").values(SHUTDOWN_OPTIONS).default(1);
    rw(0x605C, 0, I16).described("Disable operation code")
        .values(DISABLE_OPTIONS).default(1);
    rw(0x605D, 0, I16).described("Halt control register").values(HALT_OPTIONS).default(1);
    // 5.3.3 prints type 18, not mappable, and 2 for velocity.
    rw(0x6060, 0, I8).described("Operating mode").values(MODES).mappable() => MODES_OF_OPERATION;
    ro(0x6061, 0, I8).described("Operating mode status").values(MODES).mappable()
        => MODES_OF_OPERATION_DISPLAY;
    // The commanded position: there is no encoder. The default is printed "invalid".
    ro(0x6064, 0, I32).described("Actual position feedback").unit("pulses").mappable()
        => POSITION_ACTUAL_VALUE;
    ro(0x606C, 0, I32).described("Actual speed feedback").unit("r/min").mappable()
        => VELOCITY_ACTUAL_VALUE;
    rw(0x607A, 0, I32)
        .range(-1_000_000, 1_000_000).default(5000).unit("pulses").mappable() => TARGET_POSITION;
    rw(0x607C, 0, I32).range(-1_000_000, 1_000_000).unit("pulses").mappable()
        => HOME_OFFSET;
    rw(0x6081, 0, U32).described("Maximum speed").range(5, 3000).default(120).unit("r/min").mappable();
    rw(0x6082, 0, U32).described("Start / stop speed in position mode")
        .range(5, 3000).default(10).unit("r/min").mappable();
    rw(0x6083, 0, U32).described("S-shaped acceleration time")
        .range(0, 2000).default(100).unit("ms").mappable();
    rw(0x6084, 0, U32).described("S-shaped deceleration time")
        .range(0, 2000).default(100).unit("ms").mappable();
    rw(0x6085, 0, U32).described("Emergency stop deceleration time")
        .range(0, 2000).default(10).unit("ms").mappable();
    rw(0x6098, 0, U8).values(HOMING_METHODS).mappable() => HOMING_METHOD;
    ro(0x6099, 0, U8).default(2);
    rw(0x6099, 1, U32).described("Homing speed").range(5, 3000).default(120).unit("r/min").mappable()
        => HOMING_SPEED;
    rw(0x6099, 2, U32).described("Homing search speed").range(5, 3000).default(60).unit("r/min").mappable()
        => HOMING_SEARCH_SPEED;
    rw(0x609A, 0, U32).described("Homing acceleration and deceleration time")
        .range(30, 2000).default(100).unit("ms").mappable() => HOMING_ACCELERATION;
    rw(0x60FF, 0, I32).described("Target speed").range(-3000, 3000).unit("r/min").mappable()
        => TARGET_VELOCITY;
}
