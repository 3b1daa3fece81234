//! Maker's parameters, 2000h to 2088h ("ZLIM42-C user manual V1.03", 5.4).
//!
//! The numbers are not those of the sibling ZLAC8030L, whose identity this drive shares: 2009h is the bit rate here and
//! the save command there. Sub-index 00 of 2030h is U16 as printed. Tables are laid out by hand: a row of the manual is
//! a row here.

use canopen::od::Entry;

use super::values::{BAUD_RATES, CURRENTS, LOCK_CURRENTS, MICROSTEPS, OUTPUT_FUNCTIONS, RESET};
use crate::row::{I16, U16, join, ro, rw, rws};
use crate::zltech::values::{CLEAR, LIMIT_STOP, REGISTER_COMMANDS, SAVE_ON_WRITE, SHAFT_LOCK};
use crate::zltech::zlim42c::assumptions::{CURRENT_KI, CURRENT_KP, INPUT_FILTER_MS, SOFTWARE_VERSION};

pub(super) const ROWS: [Entry; 32] = join(&[&GENERAL, &TERMINALS, &DEVICE]);

crate::row::rows! { const GENERAL: [Entry; 17], general_objects:
    ro(0x2000, 0, U16, "Drive node number").default(1).mappable() => NODE_ID;
    ro(0x2001, 0, U16, "Motor status register").range(0, 1).mappable() => MOTOR_STATUS;
    ro(0x2002, 0, I16, "Motor running speed").unit("r/min").mappable() => MOTOR_SPEED;
    ro(0x2003, 0, U16, "Input signal status").mappable() => INPUT_STATUS;
    ro(0x2004, 0, U16, "Output signal status").mappable() => OUTPUT_STATUS;
    rws(0x2005, 0, U16, "Current setting").values(CURRENTS).default(3).mappable() => CURRENT_SETTING;
    rws(0x2006, 0, U16, "Microstep setting").values(MICROSTEPS).default(10).mappable()
        => MICROSTEP_SETTING;
    rws(0x2007, 0, U16, "Lock current").values(LOCK_CURRENTS).mappable() => LOCK_CURRENT;
    rws(0x2008, 0, U16, "Custom drive node number").range(0, 127).mappable() => CUSTOM_NODE_ID;
    rws(0x2009, 0, U16, "CAN custom communication baud rate").values(BAUD_RATES).default(1).mappable()
        => CAN_BAUD_RATE;
    rws(0x200A, 0, U16, "Limit stop mode").values(LIMIT_STOP).mappable() => LIMIT_STOP_MODE;
    rws(0x200B, 0, U16, "Shaft lock method when power-on").values(SHAFT_LOCK).mappable()
        => SHAFT_LOCK_WHEN_DISABLED;
    rw(0x200C, 0, U16, "Save on write")
        .values(SAVE_ON_WRITE).mappable() => SAVE_ON_WRITE;
    // U32 in 5.3.4; U16 in 5.3.5, here, and in its address 200E0010h. Not stored, as printed.
    rw(0x200E, 0, U16, "Start speed").range(2, 300).default(5).unit("r/min").mappable() => START_SPEED;
    rw(0x2010, 0, U16, "Register parameter setting")
        .values(REGISTER_COMMANDS).command().mappable() => REGISTER_PARAMETER_SETTING;
    rw(0x2011, 0, U16, "Fault reset command").values(RESET).command().mappable() => FAULT_RESET;
    rw(0x2012, 0, U16, "Clear current position").values(CLEAR).command().mappable()
        => CLEAR_CURRENT_POSITION;
}

crate::row::rows! { const TERMINALS: [Entry; 9], terminals_objects:
    // 16 as printed: sub-indexes 06 to 0B, 0F and 10 do not exist.
    ro(0x2030, 0, U16, "Number of sub-indexes", "Terminals").default(16);
    rws(0x2030, 1, U16, "Input terminal effective level").mappable() => INPUT_POLARITY;
    // 0 undefined, 1 home, 2 positive limit, 3 negative limit, 9 emergency stop, others not connected.
    rws(0x2030, 2, U16, "Input terminal X0 function selection").range(0, 15).mappable()
        => INPUT_X0_FUNCTION;
    rws(0x2030, 3, U16, "Input terminal X1 function selection").range(0, 15).mappable()
        => INPUT_X1_FUNCTION;
    rws(0x2030, 4, U16, "Input terminal X2 function selection").range(0, 15).mappable()
        => INPUT_X2_FUNCTION;
    rws(0x2030, 5, U16, "Input terminal X3 function selection").range(0, 15).mappable()
        => INPUT_X3_FUNCTION;
    rws(0x2030, 0x0C, U16, "Output terminal effective level").mappable() => OUTPUT_POLARITY;
    rws(0x2030, 0x0D, U16, "Output terminal Y0 function selection")
        .values(OUTPUT_FUNCTIONS).mappable() => OUTPUT_Y0_FUNCTION;
    rws(0x2030, 0x0E, U16, "Output terminal Y1 function selection")
        .values(OUTPUT_FUNCTIONS).mappable() => OUTPUT_Y1_FUNCTION;
}

crate::row::rows! { const DEVICE: [Entry; 6], device_objects:
    rw(0x2040, 0, U16, "Current loop proportional coefficient").default(CURRENT_KP).mappable()
        => CURRENT_LOOP_KP;
    rw(0x2041, 0, U16, "Current loop integral gain").default(CURRENT_KI).mappable() => CURRENT_LOOP_KI;
    rws(0x204B, 0, U16, "X0/X1 input filter time")
        .default(INPUT_FILTER_MS).unit("ms").mappable() => X0_X1_FILTER_TIME;
    rws(0x204C, 0, U16, "X2/X3 input filter time")
        .default(INPUT_FILTER_MS).unit("ms").mappable() => X2_X3_FILTER_TIME;
    ro(0x2069, 0, U16, "Bus voltage").unit("V").mappable() => BUS_VOLTAGE;
    // Printed "Software version", as 100Ah is.
    ro(0x2088, 0, U16, "Firmware version").default(SOFTWARE_VERSION);
}
