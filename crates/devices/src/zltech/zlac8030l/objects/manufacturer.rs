//! Factory custom parameters, 2000h to 2030h ("ZLAC8030L quick start guide V1.00", chapter 9).
//!
//! The name column of 202Fh is shifted up by one row in the manual; the names here follow its chapter 5 and its
//! description column. What is printed as a sentence has a short name here (2002h, 2006h, 2010h). The manual has sub-index 00 of these records as U16. Tables are laid out by hand: a row of
//! the manual is a row here.

use canopen::od::Entry;

use super::values::{BAUD_RATES, BRAKE, DIRECTIONS, IO_STOP, OFF_ON, OUTPUT_FUNCTIONS, RS485_BAUD_RATES};
use crate::name;
use crate::row::{I16, U16, join, ro, rw, rws};
use crate::zltech::values::{CLEAR, LIMIT_STOP, REGISTER_COMMANDS, SAVE_ON_WRITE, SHAFT_LOCK};
use crate::zltech::zlac8030l::assumptions::{SOFTWARE_VERSION, SOFTWARE_VERSION_2_01};

pub(super) const ROWS: [Entry; 71] = join(&[&GENERAL, &LIMITS, &LOOPS, &DEVICE, &POWER, &TERMINALS]);

crate::row::rows! { const GENERAL: [Entry; 18], general_objects:
    rws(0x2000, 0, U16, "Communication offline time")
        .range(0, 32767).default(1000).unit("ms").mappable() => COMMUNICATION_OFFLINE_TIME;
    rws(0x2001, 0, U16, "Motor default rotation direction").values(DIRECTIONS).mappable()
        => MOTOR_DIRECTION;
    rw(0x2002, 0, U16, "In position threshold")
        .range(1, 65535).default(30).unit("counts").mappable() => IN_POSITION_THRESHOLD;
    ro(0x2003, 0, U16, "Input signal status").mappable() => INPUT_STATUS;
    ro(0x2004, 0, U16, "Output signal status").mappable() => OUTPUT_STATUS;
    rw(0x2005, 0, U16, "Clear feedback position").values(CLEAR).command().mappable()
        => CLEAR_FEEDBACK_POSITION;
    rw(0x2006, 0, U16, "Clear current position")
        .values(CLEAR).command().mappable() => CLEAR_CURRENT_POSITION;
    rws(0x2007, 0, U16, "Limit stop mode").values(LIMIT_STOP).mappable();
    rws(0x2008, 0, U16, "Initial speed").range(1, 300).default(1).unit("r/min").mappable()
        => INITIAL_SPEED;
    rw(0x2009, 0, U16, "Register parameter setting")
        .values(REGISTER_COMMANDS).command().mappable() => REGISTER_PARAMETER_SETTING;
    rws(0x200A, 0, U16, "Maximum speed of motor")
        .range(1, 1000).default(1000).unit("r/min").mappable() => MAX_MOTOR_SPEED;
    // Printed "Encoder wire setting", 0 to 4096; no encoder has 0 lines.
    rws(0x200B, 0, U16, "Encoder lines").range(1, 4096).default(1024).mappable()
        => ENCODER_LINES;
    rws(0x200C, 0, U16, "Motor pole pairs").range(4, 64).default(15).mappable() => MOTOR_POLE_PAIRS;
    rws(0x200D, 0, U16, "CAN custom driver node number").range(4, 127).default(4).mappable()
        => CAN_NODE_ID;
    rws(0x200E, 0, U16, "CAN custom communication baud rate")
        .values(BAUD_RATES).default(1).mappable() => CAN_BAUD_RATE;
    rws(0x200F, 0, U16, "Shaft lock method when power-on").values(SHAFT_LOCK).mappable()
        => SHAFT_LOCK_WHEN_DISABLED;
    rw(0x2010, 0, U16, "Save on write")
        .values(SAVE_ON_WRITE).mappable() => SAVE_ON_WRITE;
    rws(0x2011, 0, I16, "Offset angle of motor and Hall")
        .range(-360, 360).unit("deg").mappable() => HALL_OFFSET_ANGLE;
}

// 2014h and 2015h are printed 0 to 150 and 0 to 300, as on a 15 A sibling; the maker's EDS of this 30 A drive and
// 6071h allow twice that, so the wider range is accepted and the printed defaults are kept.
crate::row::rows! { const LIMITS: [Entry; 8], limits_objects:
    rws(0x2012, 0, U16, "Overload factor").range(0, 300).default(200).unit("%").mappable()
        => OVERLOAD_FACTOR;
    ro(0x2013, 0, U16, "Number of sub-indexes", "Temperature thresholds").default(2);
    rws(0x2013, 1, U16, "Motor temperature protection threshold")
        .range(0, 1200).default(800).unit("0.1 degC").mappable() => MOTOR_TEMPERATURE_THRESHOLD;
    rws(0x2013, 2, U16, "Driver temperature protection threshold")
        .range(0, 1200).default(800).unit("0.1 degC").mappable() => DRIVER_TEMPERATURE_THRESHOLD;
    rws(0x2014, 0, U16, "Rated current").range(0, 300).default(150).unit("0.1 A").mappable()
        => RATED_CURRENT;
    rws(0x2015, 0, U16, "Maximum current").range(0, 600).default(300).unit("0.1 A").mappable()
        => MAX_CURRENT;
    rws(0x2016, 0, U16, "Overload protection time")
        .range(0, 6553).default(300).unit("10 ms").mappable() => OVERLOAD_TIME;
    rws(0x2017, 0, U16, "Out-of-tolerance alarm threshold")
        .range(1, 6553).default(409).unit("10 counts").mappable() => OUT_OF_TOLERANCE_THRESHOLD;
}

crate::row::rows! { const LOOPS: [Entry; 10], loops_objects:
    rws(0x2018, 0, U16, "Velocity smoothing factor")
        .range(0, 30000).default(1000).mappable() => VELOCITY_SMOOTHING;
    rws(0x2019, 0, U16, "Current loop proportional coefficient")
        .range(0, 30000).default(600).mappable() => CURRENT_KP;
    rws(0x201A, 0, U16, "Current loop integral gain")
        .range(0, 30000).default(300).mappable() => CURRENT_KI;
    rws(0x201B, 0, U16, "Feedforward output smoothing coefficient")
        .range(0, 30000).default(100).mappable() => FEEDFORWARD_SMOOTHING;
    rws(0x201C, 0, U16, "Torque output smoothing factor")
        .range(0, 30000).default(100).mappable() => TORQUE_SMOOTHING;
    rws(0x201D, 0, U16, "Speed proportional gain Kp")
        .range(0, 30000).default(500).mappable() => VELOCITY_KP;
    rws(0x201E, 0, U16, "Speed integral gain Ki")
        .range(0, 30000).default(100).mappable() => VELOCITY_KI;
    rws(0x201F, 0, U16, "Speed feedforward gain Kf")
        .range(0, 30000).default(1000).mappable() => VELOCITY_KF;
    rws(0x2020, 0, U16, "Position proportional gain Kp")
        .range(0, 30000).default(50).mappable() => POSITION_KP;
    rws(0x2021, 0, U16, "Position feedforward gain Kf")
        .range(0, 30000).default(200).mappable() => POSITION_KF;
}

crate::row::rows! { const DEVICE: [Entry; 13], device_objects:
    rws(0x2022, 0, U16, "RS485 custom driver node number").range(4, 127).default(4).mappable();
    rws(0x2023, 0, U16, "RS485 custom communication baud rate")
        .values(RS485_BAUD_RATES).default(2).mappable();
    // Printed "Software version", as 100Ah is.
    ro(0x2025, 0, U16, "Firmware version").default(SOFTWARE_VERSION);
    // Printed 4 with two sub-indexes.
    ro(0x2026, 0, U16, "Number of sub-indexes", "Temperatures").default(2);
    // Printed U16 with a range that begins at -55 degC.
    ro(0x2026, 1, I16, "Motor temperature").range(-550, 1200).unit("0.1 degC").mappable()
        => MOTOR_TEMPERATURE;
    ro(0x2026, 2, I16, "Driver temperature").range(-550, 1200).unit("0.1 degC").mappable()
        => DRIVER_TEMPERATURE;
    ro(0x2027, 0, U16, "Motor status register").mappable() => MOTOR_STATUS;
    ro(0x2028, 0, U16, "Hall input status").range(0, 7).mappable() => HALL_STATUS;
    ro(0x2029, 0, U16, "Bus voltage").unit("0.01 V").mappable() => BUS_VOLTAGE;
    rws(0x202A, 0, U16, "Speed observer coefficient 1")
        .range(0, 30000).mappable() => VELOCITY_OBSERVER_1;
    rws(0x202B, 0, U16, "Speed observer coefficient 2")
        .range(0, 30000).mappable() => VELOCITY_OBSERVER_2;
    rws(0x202C, 0, U16, "Speed observer coefficient 3")
        .range(0, 30000).mappable() => VELOCITY_OBSERVER_3;
    // Printed "coefficient 3" a second time.
    rws(0x202D, 0, U16, "Speed observer coefficient 4")
        .range(0, 30000).mappable() => VELOCITY_OBSERVER_4;
}

crate::row::rows! { const POWER: [Entry; 12], power_objects:
    // Printed 4 with five sub-indexes.
    ro(0x202E, 0, U16, "Number of sub-indexes", "Bleed resistor").default(5);
    rws(0x202E, 1, U16, "Bleed resistor value")
        .range(0, 1000).default(50).unit("0.1 ohm").mappable() => BLEEDER_RESISTANCE;
    rws(0x202E, 2, U16, "Bleed resistor power").range(0, 1000).default(100).unit("W").mappable()
        => BLEEDER_POWER;
    rws(0x202E, 3, U16, "Bleed resistor turns on voltage")
        .range(360, 750).default(700).unit("0.1 V").mappable() => BLEEDER_ON_VOLTAGE;
    rws(0x202E, 4, U16, "Bleed resistor turns off voltage")
        .range(310, 700).default(620).unit("0.1 V").mappable() => BLEEDER_OFF_VOLTAGE;
    rws(0x202E, 5, U16, "Bleed resistor function control").values(OFF_ON).mappable()
        => BLEEDER_ENABLE;
    // Printed 2 with five sub-indexes.
    ro(0x202F, 0, U16, "Number of sub-indexes", "Processing methods").default(5);
    rws(0x202F, 1, U16, "Alarm PWM processing method").values(OFF_ON).mappable() => ALARM_PWM;
    rws(0x202F, 2, U16, "Overload processing method").values(OFF_ON).mappable()
        => OVERLOAD_PROCESSING;
    rws(0x202F, 3, U16, "IO emergency stop processing method").values(IO_STOP).mappable()
        => IO_STOP_PROCESSING;
    rws(0x202F, 4, U16, "Parking mode").values(OFF_ON).mappable() => PARKING_MODE;
    rws(0x202F, 5, U16, "Set speed resolution").range(1, 10).default(1).mappable()
        => VELOCITY_RESOLUTION;
}

/// What the maker's CANopen guide V2.01 has otherwise. Type, default and store of 202Fh:06 are guesses: those of its neighbours.
pub(super) const CHANGES_OF_2_01: [Entry; 3] = [
    ro(0x2025, 0, U16, name!("Firmware version")).default(SOFTWARE_VERSION_2_01),
    ro(0x202F, 0, U16, name!("Number of sub-indexes", "Processing methods")).default(6),
    rws(0x202F, 6, U16, name!("Speed offset")).mappable(),
];

crate::row::rows! { const TERMINALS: [Entry; 10], terminals_objects:
    // 16 as printed: sub-indexes 06 to 0B and 10 do not exist.
    ro(0x2030, 0, U16, "Number of sub-indexes", "Terminals").default(16);
    rws(0x2030, 1, U16, "Input terminal effective level").mappable() => INPUT_POLARITY;
    rws(0x2030, 2, U16, "Input terminal X0 function selection")
        .range(0, 9).default(9).mappable() => INPUT_X0_FUNCTION;
    rws(0x2030, 3, U16, "Input terminal X1 function selection").range(0, 9).mappable()
        => INPUT_X1_FUNCTION;
    // Printed "NC", both.
    rws(0x2030, 4, U16, "Input terminal X2, NC").mappable();
    rws(0x2030, 5, U16, "Input terminal X3, NC").mappable();
    rws(0x2030, 0x0C, U16, "Output terminal effective level").mappable() => OUTPUT_POLARITY;
    rws(0x2030, 0x0D, U16, "Output terminal Y0 function selection")
        .values(OUTPUT_FUNCTIONS).default(1).mappable() => OUTPUT_Y0_FUNCTION;
    rw(0x2030, 0x0E, U16, "Output terminal B0 function selection").values(BRAKE).mappable() => BRAKE_B0;
    rw(0x2030, 0x0F, U16, "Output terminal Y1 function selection")
        .values(OUTPUT_FUNCTIONS).mappable() => OUTPUT_Y1_FUNCTION;
}
