//! Digital inputs and outputs: 2003h, 2004h and 2030h ("ZLIM42-C user manual V1.03", 3.2 and 5.4).

use canopen::od::Object;

use super::Values;
use super::objects::{
    INPUT_POLARITY, INPUT_X0_FUNCTION, INPUT_X1_FUNCTION, INPUT_X2_FUNCTION, INPUT_X3_FUNCTION, OUTPUT_POLARITY,
    OUTPUT_Y0_FUNCTION, OUTPUT_Y1_FUNCTION, X0_X1_FILTER_TIME, X2_X3_FILTER_TIME,
};
use super::readings::SUPERVISION_PERIOD_S;
use crate::engine::modes::Switches;

/// What the inputs say, by their functions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Signals {
    pub(super) switches: Switches,
    pub(super) emergency_stop: bool,
}

/// What the outputs may tell of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Conditions {
    pub(super) alarm: bool,
    pub(super) enabled: bool,
    pub(super) homing_attained: bool,
    pub(super) in_position: bool,
}

/// The functions of the inputs at these `levels` (bit 0 is X0). Polarity: 1 reverses (2030h:01). Several inputs may have
/// one function: any of them acts.
pub(super) fn signals(values: &Values, levels: u16) -> Signals {
    let active = levels ^ values.get(INPUT_POLARITY);
    let mut signals = Signals::default();
    let functions = [INPUT_X0_FUNCTION, INPUT_X1_FUNCTION, INPUT_X2_FUNCTION, INPUT_X3_FUNCTION];
    for (n, function) in functions.into_iter().enumerate() {
        let function = if active >> n & 1 == 1 { values.get(function) } else { 0 };
        match function {
            1 => signals.switches.home = true,
            2 => signals.switches.positive_limit = true,
            3 => signals.switches.negative_limit = true,
            9 => signals.emergency_stop = true,
            _ => {}
        }
    }
    signals
}

/// How many supervision periods each input must hold a level (204Bh, 204Ch, in ms).
pub(super) fn filter_periods(values: &Values) -> [u16; 4] {
    const PERIODS_PER_MS: u16 = (1e-3 / SUPERVISION_PERIOD_S) as u16;
    let periods = |object: Object<u16>| values.get(object).saturating_mul(PERIODS_PER_MS).max(1);
    let (first, second) = (periods(X0_X1_FILTER_TIME), periods(X2_X3_FILTER_TIME));
    [first, first, second, second]
}

/// Levels of Y0 and Y1.
pub(super) fn outputs(values: &Values, now: Conditions) -> [bool; 2] {
    let polarity = values.get(OUTPUT_POLARITY);
    let level = |n: u16, function: u16| {
        let active = match function {
            1 => now.alarm,
            2 => now.enabled,
            3 => now.homing_attained,
            4 => now.in_position,
            _ => false,
        };
        active != (polarity >> n & 1 == 1)
    };
    [level(0, values.get(OUTPUT_Y0_FUNCTION)), level(1, values.get(OUTPUT_Y1_FUNCTION))]
}
