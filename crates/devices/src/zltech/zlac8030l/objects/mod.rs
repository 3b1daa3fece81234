//! The object table of the ZLAC8030L: 194 rows as its manual prints them ("ZLAC8030L quick start guide V1.00",
//! chapter 9) and 1018h:03 of the maker's EDS.
//!
//! [`TABLE`] is the one description that the drive, the command line and the documents read.
//! The constants below it are the objects that a firmware itself reads and writes. 1000h to 1FFFh are those of both drives of
//! the maker, beside this folder.

mod manufacturer;
mod profile;
mod values;

use canopen::od::{Entry, Index, Table};

use super::assumptions::{HARDWARE_VERSION, SOFTWARE_VERSION};
use crate::row::join;
use crate::zltech::communication;

/// Number of rows.
pub const ROW_COUNT: usize = 195;

static ROWS: [Entry; ROW_COUNT] =
    join(&[&communication::rows(HARDWARE_VERSION, SOFTWARE_VERSION), &manufacturer::ROWS, &profile::ROWS]);
static INDEX: Index<ROW_COUNT> = Index::of(&ROWS);

/// All objects of the drive.
pub static TABLE: Table = Table::new(&ROWS, &INDEX);

crate::row::objects! { TABLE:
    COMMUNICATION_OFFLINE_TIME: u16 = 0x2000 0x00;
    MOTOR_DIRECTION: u16 = 0x2001 0x00;
    IN_POSITION_THRESHOLD: u16 = 0x2002 0x00;
    INPUT_STATUS: u16 = 0x2003 0x00;
    OUTPUT_STATUS: u16 = 0x2004 0x00;
    CLEAR_FEEDBACK_POSITION: u16 = 0x2005 0x00;
    CLEAR_CURRENT_POSITION: u16 = 0x2006 0x00;
    INITIAL_SPEED: u16 = 0x2008 0x00;
    REGISTER_PARAMETER_SETTING: u16 = 0x2009 0x00;
    MAX_MOTOR_SPEED: u16 = 0x200A 0x00;
    ENCODER_LINES: u16 = 0x200B 0x00;
    MOTOR_POLE_PAIRS: u16 = 0x200C 0x00;
    CAN_NODE_ID: u16 = 0x200D 0x00;
    CAN_BAUD_RATE: u16 = 0x200E 0x00;
    SHAFT_LOCK_WHEN_DISABLED: u16 = 0x200F 0x00;
    SAVE_ON_WRITE: u16 = 0x2010 0x00;
    HALL_OFFSET_ANGLE: i16 = 0x2011 0x00;
    OVERLOAD_FACTOR: u16 = 0x2012 0x00;
    MOTOR_TEMPERATURE_THRESHOLD: u16 = 0x2013 0x01;
    DRIVER_TEMPERATURE_THRESHOLD: u16 = 0x2013 0x02;
    RATED_CURRENT: u16 = 0x2014 0x00;
    MAX_CURRENT: u16 = 0x2015 0x00;
    OVERLOAD_TIME: u16 = 0x2016 0x00;
    OUT_OF_TOLERANCE_THRESHOLD: u16 = 0x2017 0x00;
    VELOCITY_SMOOTHING: u16 = 0x2018 0x00;
    CURRENT_KP: u16 = 0x2019 0x00;
    CURRENT_KI: u16 = 0x201A 0x00;
    FEEDFORWARD_SMOOTHING: u16 = 0x201B 0x00;
    TORQUE_SMOOTHING: u16 = 0x201C 0x00;
    VELOCITY_KP: u16 = 0x201D 0x00;
    VELOCITY_KI: u16 = 0x201E 0x00;
    VELOCITY_KF: u16 = 0x201F 0x00;
    POSITION_KP: u16 = 0x2020 0x00;
    POSITION_KF: u16 = 0x2021 0x00;
    MOTOR_TEMPERATURE: i16 = 0x2026 0x01;
    DRIVER_TEMPERATURE: i16 = 0x2026 0x02;
    MOTOR_STATUS: u16 = 0x2027 0x00;
    HALL_STATUS: u16 = 0x2028 0x00;
    BUS_VOLTAGE: u16 = 0x2029 0x00;
    VELOCITY_OBSERVER_1: u16 = 0x202A 0x00;
    VELOCITY_OBSERVER_2: u16 = 0x202B 0x00;
    VELOCITY_OBSERVER_3: u16 = 0x202C 0x00;
    VELOCITY_OBSERVER_4: u16 = 0x202D 0x00;
    BLEEDER_RESISTANCE: u16 = 0x202E 0x01;
    BLEEDER_POWER: u16 = 0x202E 0x02;
    BLEEDER_ON_VOLTAGE: u16 = 0x202E 0x03;
    BLEEDER_OFF_VOLTAGE: u16 = 0x202E 0x04;
    BLEEDER_ENABLE: u16 = 0x202E 0x05;
    ALARM_PWM: u16 = 0x202F 0x01;
    OVERLOAD_PROCESSING: u16 = 0x202F 0x02;
    IO_STOP_PROCESSING: u16 = 0x202F 0x03;
    PARKING_MODE: u16 = 0x202F 0x04;
    VELOCITY_RESOLUTION: u16 = 0x202F 0x05;
    INPUT_POLARITY: u16 = 0x2030 0x01;
    INPUT_X0_FUNCTION: u16 = 0x2030 0x02;
    INPUT_X1_FUNCTION: u16 = 0x2030 0x03;
    OUTPUT_POLARITY: u16 = 0x2030 0x0C;
    OUTPUT_Y0_FUNCTION: u16 = 0x2030 0x0D;
    BRAKE_B0: u16 = 0x2030 0x0E;
    OUTPUT_Y1_FUNCTION: u16 = 0x2030 0x0F;
    ERROR_CODE: u16 = 0x603F 0x00;
    CONTROLWORD: u16 = 0x6040 0x00;
    STATUSWORD: u16 = 0x6041 0x00;
    MODES_OF_OPERATION: i8 = 0x6060 0x00;
    MODES_OF_OPERATION_DISPLAY: i8 = 0x6061 0x00;
    POSITION_ACTUAL_VALUE: i32 = 0x6064 0x00;
    VELOCITY_ACTUAL_VALUE: i32 = 0x606C 0x00;
    TARGET_TORQUE: i16 = 0x6071 0x00;
    TORQUE_DEMAND: i16 = 0x6074 0x00;
    TORQUE_ACTUAL_VALUE: i16 = 0x6077 0x00;
    TARGET_POSITION: i32 = 0x607A 0x00;
    TORQUE_SLOPE: u32 = 0x6087 0x00;
    TARGET_VELOCITY: i32 = 0x60FF 0x00;
}
