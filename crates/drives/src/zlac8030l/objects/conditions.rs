//! Conditions on writes that need more than the row: they see the other values and refuse with an abort code.

use canopen::AbortCode;
use canopen::od::{Condition, Conditions, Slot, View, condition_numbers};

use super::{
    BLEEDER_OFF_VOLTAGE, BLEEDER_ON_VOLTAGE, CONTROLWORD, MODES_OF_OPERATION_DISPLAY, ROW_COUNT, TARGET_POSITION,
};

static LIST: [(Slot, Condition); 2] = [
    (BLEEDER_OFF_VOLTAGE.slot(), Condition::Check(off_not_above_on)),
    (CONTROLWORD.slot(), Condition::Check(set_point_in_range)),
];
static NUMBERS: [u16; ROW_COUNT] = condition_numbers(&LIST);

/// The conditions of this firmware.
pub static CONDITIONS: Conditions = Conditions::new(&LIST, &NUMBERS);

/// Largest absolute target position (607Ah: ±3FFFFFFFh absolute, ±7FFFFFFFh relative).
pub const ABSOLUTE_TARGET_LIMIT: i32 = 0x3FFF_FFFF;

/// 202Eh:04: a bleeder that goes off above where it goes on would never go on. A host that writes both writes :03 first.
fn off_not_above_on(values: &View<'_>, raw: u32) -> Result<(), AbortCode> {
    if raw > u32::from(values.get(BLEEDER_ON_VOLTAGE)) { Err(AbortCode::VALUE_TOO_HIGH) } else { Ok(()) }
}

/// 6040h: refuses the controlword that would take an absolute set-point out of range.
///
/// The range of 607Ah depends on bit 6 of the controlword, so it can only be judged when bit 4 rises.
fn set_point_in_range(values: &View<'_>, raw: u32) -> Result<(), AbortCode> {
    const ENABLED_NEW_SET_POINT: u32 = 0x1F;
    const NEW_SET_POINT: u32 = 0x10;
    const RELATIVE: u32 = 0x40;
    const PROFILE_POSITION: i8 = 1;
    let rises =
        raw & ENABLED_NEW_SET_POINT == ENABLED_NEW_SET_POINT && u32::from(values.get(CONTROLWORD)) & NEW_SET_POINT == 0;
    let takes_absolute = rises && raw & RELATIVE == 0 && values.get(MODES_OF_OPERATION_DISPLAY) == PROFILE_POSITION;
    if takes_absolute && values.get(TARGET_POSITION).unsigned_abs() > ABSOLUTE_TARGET_LIMIT.unsigned_abs() {
        return Err(AbortCode::INVALID_VALUE);
    }
    Ok(())
}
