//! Digital inputs and outputs: 2030h, 204Bh and 204Ch ("ZLIM42-C user manual V1.03", 3.2 and 5.4).

use canopen::od::Object;

use super::Values;
use super::assumptions::SUPERVISION_PERIOD_S;
use super::objects::{
    INPUT_POLARITY, INPUT_X0_FUNCTION, INPUT_X1_FUNCTION, INPUT_X2_FUNCTION, INPUT_X3_FUNCTION, OUTPUT_POLARITY,
    OUTPUT_Y0_FUNCTION, OUTPUT_Y1_FUNCTION, X0_X1_FILTER_TIME, X2_X3_FILTER_TIME,
};
use crate::zltech::terminals::Terminals;

pub(super) const TERMINALS: Terminals<4> = Terminals {
    input_polarity: INPUT_POLARITY,
    input_functions: [INPUT_X0_FUNCTION, INPUT_X1_FUNCTION, INPUT_X2_FUNCTION, INPUT_X3_FUNCTION],
    output_polarity: OUTPUT_POLARITY,
    output_functions: [OUTPUT_Y0_FUNCTION, OUTPUT_Y1_FUNCTION],
};

/// How many supervision periods each input must hold a level (204Bh, 204Ch, in ms).
pub(super) fn filter_periods(values: &Values) -> [u16; 4] {
    const PERIODS_PER_MS: u16 = (1e-3 / SUPERVISION_PERIOD_S) as u16;
    let periods = |object: Object<u16>| values.get(object).saturating_mul(PERIODS_PER_MS).max(1);
    let (first, second) = (periods(X0_X1_FILTER_TIME), periods(X2_X3_FILTER_TIME));
    [first, first, second, second]
}
