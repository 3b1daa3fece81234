//! Digital inputs and outputs: 2003h, 2004h and 2030h (5.4, 5.5).

use super::Values;
use super::objects::{
    BRAKE_B0, INPUT_POLARITY, INPUT_X0_FUNCTION, INPUT_X1_FUNCTION, OUTPUT_POLARITY, OUTPUT_Y0_FUNCTION,
    OUTPUT_Y1_FUNCTION,
};

/// Function 9 of an input: emergency stop. The others do nothing.
const EMERGENCY_STOP: u16 = 9;

/// What the outputs may tell of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Signals {
    pub(super) alarm: bool,
    pub(super) enabled: bool,
    pub(super) in_position: bool,
}

/// True if an input with the function emergency stop is active. `levels`: bit 0 is X0. Polarity: 1 reverses (2030:01).
pub(super) fn emergency_stop(values: &Values, levels: u16) -> bool {
    let active = levels ^ values.get(INPUT_POLARITY);
    let functions = [INPUT_X0_FUNCTION, INPUT_X1_FUNCTION];
    functions.iter().enumerate().any(|(n, function)| active >> n & 1 == 1 && values.get(*function) == EMERGENCY_STOP)
}

/// Levels of Y0 and Y1.
pub(super) fn outputs(values: &Values, signals: Signals) -> [bool; 2] {
    let polarity = values.get(OUTPUT_POLARITY);
    let level = |n: u16, function: u16| {
        let active = match function {
            1 => signals.alarm,
            2 => signals.enabled,
            4 => signals.in_position,
            _ => false,
        };
        active != (polarity >> n & 1 == 1)
    };
    [level(0, values.get(OUTPUT_Y0_FUNCTION)), level(1, values.get(OUTPUT_Y1_FUNCTION))]
}

/// The holding brake: 1 closes it, and the drive never moves it by itself.
pub(super) fn brake_engaged(values: &Values) -> bool {
    values.get(BRAKE_B0) == 1
}

/// 2004h: Y0, Y1 and B0; there is no B1.
pub(super) fn output_status([y0, y1]: [bool; 2], brake: bool) -> u16 {
    u16::from(y0) | u16::from(y1) << 1 | u16::from(brake) << 2
}
