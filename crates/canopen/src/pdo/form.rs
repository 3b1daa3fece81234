use crate::Mux;
use crate::od::DataType;

/// How TPDOs show an object that a device's SDO shows in another type and scale. CiA 301 knows no such thing; some
/// devices have it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TpdoForm {
    /// The object: an integer of up to 32 bits.
    pub object: Mux,
    /// Its type there: an integer of up to 32 bits.
    pub data_type: DataType,
    /// Unit of one count of the value there.
    pub unit: &'static str,
    /// How many counts of the object are one count there, 1 or more. Rounded to whole counts, halves away from zero.
    pub divisor: u16,
}

impl TpdoForm {
    /// The value there of the object's value.
    pub const fn value(&self, value: i64) -> i64 {
        let divisor = self.divisor as i64;
        (value + divisor / 2 * value.signum()) / divisor
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tenths_are_rounded_to_whole_counts_on_both_sides_of_zero() {
        let form = TpdoForm { object: Mux::new(0x606C, 0), data_type: DataType::Integer32, unit: "", divisor: 10 };
        for (tenths, whole) in [(0, 0), (4, 0), (5, 1), (-4, 0), (-5, -1), (6004, 600), (-5996, -600)] {
            assert_eq!(form.value(tenths), whole, "{tenths}");
        }
    }
}
