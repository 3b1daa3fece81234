//! Conditions on writes, and values with two forms.

use canopen::AbortCode;
use canopen::od::{DataType, TpdoForm, View};

/// 2619h: the functions that the manual lists.
pub(super) fn mode_selection(_: &View<'_>, raw: u32) -> Result<(), AbortCode> {
    let listed = matches!(raw, 0..=3 | 6..=9 | 30..=32768);
    if listed { Ok(()) } else { Err(AbortCode::INVALID_VALUE) }
}

/// 606Ch in TPDO3: 32 bits of r/min (5.10.2), of the 16 bits of 0.1 r/min that SDO shows (5.04).
pub(super) const fn revolutions_in_tpdo() -> TpdoForm {
    TpdoForm { data_type: DataType::Integer32, unit: "r/min", convert: tenths_to_whole }
}

fn tenths_to_whole(raw: u32) -> u32 {
    let tenths = i32::from(raw as i16);
    ((tenths + 5 * tenths.signum()) / 10) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tenths_are_rounded_to_whole_revolutions_on_both_sides_of_zero() {
        for (tenths, whole) in [(0_i16, 0), (4, 0), (5, 1), (-4, 0), (-5, -1), (6004, 600), (-5996, -600)] {
            assert_eq!(tenths_to_whole(u32::from(tenths as u16)) as i32, whole, "{tenths}");
        }
    }
}
