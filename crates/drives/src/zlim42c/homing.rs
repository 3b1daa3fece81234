//! The homing methods of 5.3.6 for the engine: the rows of [`devices::zltech::zlim42c::homing`] that the variant has chosen.

use cia402::{HomingMethod, HomingSequence};
use devices::variant::Variant;
use devices::zltech::zlim42c::homing::{BY_LABEL, BY_PROSE};

use super::variations::HOMING_BY_PROSE;

/// What 6098h asks for; `None` for 0, no method.
pub(super) fn sequence(value: u8, variant: &Variant) -> Option<HomingSequence> {
    let table = if variant.is(HOMING_BY_PROSE) { &BY_PROSE } else { &BY_LABEL };
    let method = HomingMethod(i8::try_from(value).ok()?);
    table.iter().find(|row| row.method == method).map(|row| HomingSequence { switch: Some(row), index: None })
}
