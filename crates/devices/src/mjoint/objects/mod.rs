//! The object table of the M joint motors ("M Robot Joint Motor CanOpen Manual", 5.04 and 5.08).
//!
//! [`TABLE`] is the one description that the drive, the command line and the documents read; the four
//! models share it. The constants below it are the objects that a firmware itself reads and writes. Where the
//! RS485 side finds an object stands in [`modbus`].

mod communication;
mod control;
pub mod modbus;
mod values;

use canopen::od::{Entry, Index, Table};

use crate::row::join;

/// Number of rows.
pub const ROW_COUNT: usize = 104;

static ROWS: [Entry; ROW_COUNT] = join(&[&communication::ROWS, &control::ROWS]);
static INDEX: Index<ROW_COUNT> = Index::of(&ROWS);

/// All objects of the drive.
pub static TABLE: Table = Table::new(&ROWS, &INDEX);

crate::row::objects! { TABLE:
    ERROR_REGISTER: u8 = 0x1001 0x00;
    CONSUMER_HEARTBEAT_TIME: u32 = 0x1016 0x01;
    MODBUS_ENABLE: u16 = 0x2600 0x00;
    OUTPUT_ENABLED: u16 = 0x2601 0x00;
    WEAK_MAGNETIC: u16 = 0x2604 0x00;
    DIR_POLARITY: u16 = 0x2609 0x00;
    GEAR_NUMERATOR: u16 = 0x260A 0x00;
    GEAR_DENOMINATOR: u16 = 0x260B 0x00;
    INCREMENTAL_POSITION: i32 = 0x260C 0x00;
    ALARM_CODE: u16 = 0x260E 0x00;
    DRIVER_TEMPERATURE: u16 = 0x2612 0x00;
    OUTPUT_PWM: i16 = 0x2613 0x00;
    DATA_SAVE_FLAG: u16 = 0x2614 0x00;
    DEVICE_ADDRESS: u16 = 0x2615 0x00;
    STATIONARY_OUTPUT: u16 = 0x2618 0x00;
    MODE_SELECTION: u16 = 0x2619 0x00;
    SYNCHRONOUS_CONTROL_WORD: u16 = 0x261C 0x00;
    ALLOWABLE_CURRENT: u16 = 0x261D 0x00;
    CONTROLWORD: u16 = 0x6040 0x00;
    STATUSWORD: u16 = 0x6041 0x00;
    MODES_OF_OPERATION: i8 = 0x6060 0x00;
    POSITION_ACTUAL_INTERNAL_VALUE: i32 = 0x6063 0x00;
    POSITION_ACTUAL_VALUE: i32 = 0x6064 0x00;
    VELOCITY_ACTUAL_VALUE: i16 = 0x606C 0x00;
    CURRENT_ACTUAL_VALUE: u16 = 0x6078 0x00;
    DC_LINK_VOLTAGE: u16 = 0x6079 0x00;
    TARGET_POSITION: i32 = 0x607A 0x00;
    PROFILE_VELOCITY: u32 = 0x6081 0x00;
    PROFILE_ACCELERATION: u32 = 0x6083 0x00;
    HOMING_METHOD: i8 = 0x6098 0x00;
    VELOCITY_PROPORTIONAL: u16 = 0x60F9 0x01;
    VELOCITY_INTEGRAL_TIME: u16 = 0x60F9 0x02;
    POSITION_PROPORTIONAL: u16 = 0x60FB 0x01;
    VELOCITY_FEED_FORWARD: u16 = 0x60FB 0x02;
    DIGITAL_INPUTS: u16 = 0x60FD 0x00;
    TARGET_VELOCITY: i32 = 0x60FF 0x00;
}
