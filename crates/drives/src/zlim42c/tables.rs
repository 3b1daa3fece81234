//! Looks entries up in the tables that objects point into.

pub use devices::zltech::zlim42c::tables::*;

/// The entry that an object's value points to; the table's limits on the object make it exist.
pub(super) fn entry<T: Copy, const N: usize>(table: &[T; N], value: u16) -> T {
    table[usize::from(value).min(N - 1)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_of_pulses_divides_into_electrical_turns() {
        for pulses in PULSES_PER_TURN {
            assert_eq!(u32::from(pulses) % super::super::assumptions::TEETH, 0, "{pulses}");
        }
    }
}
