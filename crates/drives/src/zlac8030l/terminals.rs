//! Digital inputs and outputs: 2004h and 2030h (5.4, 5.5).
//!
//! Of the inputs' functions only 9, emergency stop, does something. Function 3 of an output is not connected.

use super::Values;
use super::objects::{
    BRAKE_B0, INPUT_POLARITY, INPUT_X0_FUNCTION, INPUT_X1_FUNCTION, OUTPUT_POLARITY, OUTPUT_Y0_FUNCTION,
    OUTPUT_Y1_FUNCTION,
};
use crate::zltech::terminals::Terminals;

pub(super) const TERMINALS: Terminals<2> = Terminals {
    input_polarity: INPUT_POLARITY,
    input_functions: [INPUT_X0_FUNCTION, INPUT_X1_FUNCTION],
    output_polarity: OUTPUT_POLARITY,
    output_functions: [OUTPUT_Y0_FUNCTION, OUTPUT_Y1_FUNCTION],
};

/// The holding brake: 1 closes it, and the drive never moves it by itself.
pub(super) fn brake_engaged(values: &Values) -> bool {
    values.get(BRAKE_B0) == 1
}

/// 2004h: Y0, Y1 and B0; there is no B1.
pub(super) fn output_status([y0, y1]: [bool; 2], brake: bool) -> u16 {
    u16::from(y0) | u16::from(y1) << 1 | u16::from(brake) << 2
}
