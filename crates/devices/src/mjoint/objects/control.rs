//! Control objects, 2600h to 60FFh ("M Robot Joint Motor CanOpen Manual", 5.04, "Control class parameter list").
//!
//! Tables are laid out by hand: a row of the manual is a row here, sorted by index. Defaults that the manual does not
//! print are those of [`assumptions`](crate::mjoint::assumptions). Stored is what configures the joint; what commands it
//! (6040h, 6060h, 607Ah, 60FFh, 260Ch, 2600h, 2601h) is not, or it would move at power-on.

use canopen::od::Entry;

use super::values::{self, MODES, OFF_ON};
use crate::mjoint::assumptions::*;
use crate::name;
use crate::row::cia::{ro as cia_ro, rw as cia_rw, rws as cia_rws};
use crate::row::{I8, I16, I32, U8, U16, U32, join, ro, rw, rws};

pub(super) const ROWS: [Entry; 36] = join(&[&MANUFACTURER, &PROFILE]);

/// What firmware 1.66 has otherwise. That 606Ch counts 0.1 r/min there too is a guess.
pub(super) const CHANGES_OF_1_66: [Entry; 3] = [
    ro(0x260C, 0, I32, name!("Incremental position")).unit("counts"),
    ro(0x260E, 0, U16, name!("Alarm code")),
    cia_ro(0x606C, 0, I32).described("Motor actual speed").range(-30000, 30000).unit("0.1 r/min").mappable(),
];

crate::row::rows! { const MANUFACTURER: [Entry; 17], manufacturer_objects:
    rw(0x2600, 0, U16, "Modbus enable").values(OFF_ON) => MODBUS_ENABLE;
    // 1 from power-on: bit 2 of the statusword 0404h that 5.10.1 prints before anything is enabled.
    rw(0x2601, 0, U16, "Drive output enabled").values(OFF_ON).default(1).command() => OUTPUT_ENABLED;
    // Printed 0 to 306 r/min; the AIM servos' manual has 0 to 200 and tenths of a degree.
    rws(0x2604, 0, U16, "Weak magnetic angle")
        .range(0, 200).default(WEAK_MAGNETIC_ANGLE).unit("0.1 deg") => WEAK_MAGNETIC;
    rws(0x2609, 0, U16, "DIR polarity").values(values::DIR_POLARITY) => DIR_POLARITY;
    // Printed "Electronic gear molecule".
    rws(0x260A, 0, U16, "Electronic gear numerator").default(32768) => GEAR_NUMERATOR;
    rws(0x260B, 0, U16, "Electronic gear denominator")
        .range(1, 65535).default(8192) => GEAR_DENOMINATOR;
    rw(0x260C, 0, I32, "Incremental position").unit("counts").command() => INCREMENTAL_POSITION;
    rw(0x260E, 0, U16, "Alarm code").command() => ALARM_CODE;
    ro(0x2612, 0, U16, "System temperature").range(0, 100).unit("1 degC") => DRIVER_TEMPERATURE;
    ro(0x2613, 0, I16, "PWM of system output").unit("100/32768 %") => OUTPUT_PWM;
    // Reads 2 when all is stored, which is outside the printed range.
    rw(0x2614, 0, U16, "Data save flag").range(0, 1).command() => DATA_SAVE_FLAG;
    // Printed "Device location" with the meaning "Device address", and 0 to 255; node-IDs are 1 to 127.
    rws(0x2615, 0, U16, "Device address").range(1, 127).default(1) => DEVICE_ADDRESS;
    rws(0x2618, 0, U16, "Stationary maximum allowable output")
        .range(0, 609).default(STATIONARY_MAX_OUTPUT) => STATIONARY_OUTPUT;
    // Printed 0 to 100, with angles from 30 to 32768.
    rws(0x2619, 0, U16, "Mode selection").range(0, 32768) => MODE_SELECTION;
    rws(0x261C, 0, U16, "CAN communication synchronous control word")
        => SYNCHRONOUS_CONTROL_WORD;
    rws(0x261D, 0, U16, "Maximum allowable current")
        .range(0, 10009).default(MAX_ALLOWABLE_CURRENT).unit("mA") => ALLOWABLE_CURRENT;
    cia_rw(0x6040, 0, U16).mappable() => CONTROLWORD;
}

crate::row::rows! { const PROFILE: [Entry; 19], profile_objects:
    cia_ro(0x6041, 0, U16).default(0x0404).mappable() => STATUSWORD;
    cia_rw(0x6060, 0, I8).described("Work mode").values(MODES).default(1).mappable() => MODES_OF_OPERATION;
    // Printed on one row with 6064h. Recorded at power-off.
    cia_ro(0x6063, 0, I32).unit("counts").mappable().stored()
        => POSITION_ACTUAL_INTERNAL_VALUE;
    cia_ro(0x6064, 0, I32).described("Actual position").unit("counts").mappable() => POSITION_ACTUAL_VALUE;
    // Printed read and write, with a range in r/min.
    cia_ro(0x606C, 0, I16).described("Motor actual speed")
        .range(-30000, 30000).unit("0.1 r/min").mappable() => VELOCITY_ACTUAL_VALUE;
    cia_ro(0x6078, 0, U16).described("Actual current").range(0, 32767).unit("1/2000 A").mappable()
        => CURRENT_ACTUAL_VALUE;
    cia_ro(0x6079, 0, U16).described("System voltage").range(0, 32767).unit("1/327 V") => DC_LINK_CIRCUIT_VOLTAGE;
    // Printed without M, though RPDO1, 2 and 4 carry it.
    cia_rw(0x607A, 0, I32).described("Target location cache").unit("counts").mappable() => TARGET_POSITION;
    cia_rws(0x6081, 0, U32).described("Trapezoidal velocity(Position Mode Speed)")
        .range(0, 3000).default(PROFILE_VELOCITY_RPM).unit("r/min").mappable() => PROFILE_VELOCITY;
    cia_rws(0x6083, 0, U32).described("Motor acceleration")
        .range(0, 65535).default(ACCELERATION_RPM_S).unit("(r/min)/s") => PROFILE_ACCELERATION;
    // Printed 17 to 21 here, 17 to 22 in 5.09.
    cia_rws(0x6098, 0, I8).described("Return to origin method").range(17, 22).default(17) => HOMING_METHOD;
    cia_ro(0x60F9, 0, U8).default(2);
    rws(0x60F9, 1, U16, "Velocity ring proportionality coefficient")
        .range(0, 10000).default(VELOCITY_KP).unit("0.001") => VELOCITY_PROPORTIONAL;
    rws(0x60F9, 2, U16, "Velocity loop integration time")
        .range(2, 2000).default(VELOCITY_INTEGRAL_TIME_MS).unit("ms") => VELOCITY_INTEGRAL_TIME;
    cia_ro(0x60FB, 0, U8).default(2);
    rws(0x60FB, 1, U16, "Proportional coefficient of position ring")
        .range(60, 30000).default(POSITION_KP) => POSITION_PROPORTIONAL;
    rws(0x60FB, 2, U16, "Rate feed-forward")
        .range(0, 3924).unit("1/327 V/(1000 r/min)") => VELOCITY_FEED_FORWARD;
    cia_ro(0x60FD, 0, U16).described("Input port state").mappable() => DIGITAL_INPUTS;
    cia_rw(0x60FF, 0, I32).described("Speed mode speed").range(-3000, 3000).unit("r/min").mappable()
        => TARGET_VELOCITY;
}
