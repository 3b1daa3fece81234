//! Conditions on writes that need more than the row.

use canopen::AbortCode;
use canopen::od::{Condition, Conditions, Slot, View, condition_numbers};

use super::{MODE_SELECTION, ROW_COUNT};
use crate::mjoint::power_on::Function;

static LIST: [(Slot, Condition); 1] = [(MODE_SELECTION.slot(), Condition::Check(mode_selection))];
static NUMBERS: [u16; ROW_COUNT] = condition_numbers(&LIST);

/// The conditions of this firmware.
pub static CONDITIONS: Conditions = Conditions::new(&LIST, &NUMBERS);

/// 2619h: the functions that the manual lists.
fn mode_selection(_: &View<'_>, raw: u32) -> Result<(), AbortCode> {
    Function::from_raw(raw as u16).map(|_| ()).ok_or(AbortCode::INVALID_VALUE)
}
