//! The object table of the ZLIM42-C: the rows that its manual prints ("ZLIM42-C user manual V1.03", 5.4), those that it
//! lost at page breaks, and 1018h:03 of the maker's EDS.
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
pub const ROW_COUNT: usize = 158;

static ROWS: [Entry; ROW_COUNT] =
    join(&[&communication::rows(HARDWARE_VERSION, SOFTWARE_VERSION), &manufacturer::ROWS, &profile::ROWS]);
static INDEX: Index<ROW_COUNT> = Index::of(&ROWS);

/// All objects of the drive.
pub static TABLE: Table = Table::new(&ROWS, &INDEX);

crate::row::objects! { TABLE:
    NODE_ID: u16 = 0x2000 0x00;
    MOTOR_STATUS: u16 = 0x2001 0x00;
    MOTOR_SPEED: i16 = 0x2002 0x00;
    INPUT_STATUS: u16 = 0x2003 0x00;
    OUTPUT_STATUS: u16 = 0x2004 0x00;
    CURRENT_SETTING: u16 = 0x2005 0x00;
    MICROSTEP_SETTING: u16 = 0x2006 0x00;
    LOCK_CURRENT: u16 = 0x2007 0x00;
    CUSTOM_NODE_ID: u16 = 0x2008 0x00;
    CAN_BAUD_RATE: u16 = 0x2009 0x00;
    LIMIT_STOP_MODE: u16 = 0x200A 0x00;
    SHAFT_LOCK_WHEN_DISABLED: u16 = 0x200B 0x00;
    SAVE_ON_WRITE: u16 = 0x200C 0x00;
    START_SPEED: u16 = 0x200E 0x00;
    REGISTER_PARAMETER_SETTING: u16 = 0x2010 0x00;
    FAULT_RESET: u16 = 0x2011 0x00;
    CLEAR_CURRENT_POSITION: u16 = 0x2012 0x00;
    INPUT_POLARITY: u16 = 0x2030 0x01;
    INPUT_X0_FUNCTION: u16 = 0x2030 0x02;
    INPUT_X1_FUNCTION: u16 = 0x2030 0x03;
    INPUT_X2_FUNCTION: u16 = 0x2030 0x04;
    INPUT_X3_FUNCTION: u16 = 0x2030 0x05;
    OUTPUT_POLARITY: u16 = 0x2030 0x0C;
    OUTPUT_Y0_FUNCTION: u16 = 0x2030 0x0D;
    OUTPUT_Y1_FUNCTION: u16 = 0x2030 0x0E;
    CURRENT_LOOP_KP: u16 = 0x2040 0x00;
    CURRENT_LOOP_KI: u16 = 0x2041 0x00;
    X0_X1_FILTER_TIME: u16 = 0x204B 0x00;
    X2_X3_FILTER_TIME: u16 = 0x204C 0x00;
    BUS_VOLTAGE: u16 = 0x2069 0x00;
    ERROR_CODE: u16 = 0x603F 0x00;
    CONTROLWORD: u16 = 0x6040 0x00;
    STATUSWORD: u16 = 0x6041 0x00;
    MODES_OF_OPERATION: i8 = 0x6060 0x00;
    MODES_OF_OPERATION_DISPLAY: i8 = 0x6061 0x00;
    POSITION_ACTUAL_VALUE: i32 = 0x6064 0x00;
    VELOCITY_ACTUAL_VALUE: i32 = 0x606C 0x00;
    TARGET_POSITION: i32 = 0x607A 0x00;
    HOME_OFFSET: i32 = 0x607C 0x00;
    HOMING_METHOD: u8 = 0x6098 0x00;
    HOMING_SPEED: u32 = 0x6099 0x01;
    HOMING_SEARCH_SPEED: u32 = 0x6099 0x02;
    HOMING_ACCELERATION: u32 = 0x609A 0x00;
    TARGET_VELOCITY: i32 = 0x60FF 0x00;
}
