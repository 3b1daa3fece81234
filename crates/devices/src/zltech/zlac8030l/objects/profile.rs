//! Drive profile parameters, 603Fh to 60FFh ("ZLAC8030L quick start guide V1.00", chapter 9, CiA 402 group).
//!
//! 6060h lists 6 for profile torque; the manual's own example, CiA 402 and all public programs have 4. The ranges
//! of 6074h and 6077h are exchanged in the manual. 605Dh prints 0 where its default and the sibling have 1.

use canopen::od::Entry;

use super::values::{DISABLE_OPTIONS, HALT_OPTIONS, MODES, QUICK_STOP_OPTIONS};
use crate::row::cia::{ro, rw};
use crate::row::{I8, I16, I32, U16, U32};
use crate::zltech::values::SHUTDOWN_OPTIONS;

crate::row::rows! { pub(super) const ROWS: [Entry; 22], profile_objects:
    ro(0x603F, 0, U16).described("Driver last fault code").mappable() => ERROR_CODE;
    rw(0x6040, 0, U16).mappable() => CONTROLWORD;
    ro(0x6041, 0, U16).mappable() => STATUSWORD;
    rw(0x605A, 0, I16).described("Quick stop code").values(QUICK_STOP_OPTIONS).default(5);
    rw(0x605B, 0, I16).described("Close operation code").values(SHUTDOWN_OPTIONS).default(1);
    rw(0x605C, 0, I16).described("Disable operation code")
        .values(DISABLE_OPTIONS).default(1);
    rw(0x605D, 0, I16).described("Halt control register").values(HALT_OPTIONS).default(1);
    // Printed RW. A robot's driver has never written it and turns the wheels: a save keeps it.
    rw(0x6060, 0, I8).described("Operating mode").values(MODES).mappable().saved() => MODES_OF_OPERATION;
    ro(0x6061, 0, I8).described("Operating mode status").values(MODES).mappable()
        => MODES_OF_OPERATION_DISPLAY;
    ro(0x6064, 0, I32).described("Actual position feedback").unit("counts").mappable()
        => POSITION_ACTUAL_VALUE;
    ro(0x606C, 0, I32).described("Actual speed feedback").unit("0.1 r/min").mappable()
        => VELOCITY_ACTUAL_VALUE;
    rw(0x6071, 0, I16)
        .range(-30000, 30000).unit("mA").held_to(0x2015, 0, 100).mappable() => TARGET_TORQUE;
    // Both show what flows, up to the 60 A that 2015h goes to; 16 bits of 1 mA end before that.
    ro(0x6074, 0, I16).described("Real-time target torque").unit("mA").mappable() => TORQUE_DEMAND;
    ro(0x6077, 0, I16).described("Real-time torque feedback").range(-600, 600).unit("0.1 A").mappable()
        => TORQUE_ACTUAL_VALUE;
    rw(0x607A, 0, I32)
        .range(-0x7FFF_FFFF, 0x7FFF_FFFF).unit("counts").mappable() => TARGET_POSITION;
    rw(0x6081, 0, U32).described("Max speed")
        .range(1, 1000).default(120).unit("r/min").held_to(0x200A, 0, 1).mappable();
    rw(0x6082, 0, U32).described("Start / stop speed in profile position mode")
        .range(1, 1000).default(1).unit("r/min").mappable();
    rw(0x6083, 0, U32).described("S-shaped acceleration time")
        .range(0, 32767).default(500).unit("ms").mappable();
    rw(0x6084, 0, U32).described("S-shaped deceleration time")
        .range(0, 32767).default(500).unit("ms").mappable();
    rw(0x6085, 0, U32).described("Emergency stop deceleration time")
        .range(0, 32767).default(10).unit("ms").mappable();
    rw(0x6087, 0, U32).default(300).unit("mA/s").mappable() => TORQUE_SLOPE;
    // 202F:05 makes one count finer and the range wider, from the next restart on (5.3).
    rw(0x60FF, 0, I32).described("Target speed")
        .range(-1000, 1000).unit("r/min").resolution(0x202F, 5).held_to(0x200A, 0, 1).mappable() => TARGET_VELOCITY;
}
