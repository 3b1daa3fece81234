//! The two lights ("ZLIM42-C user manual V1.03", 3.4): green while supplied, red flashes that count a fault.

use can::Instant;

/// Which lights are on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Led {
    /// Supply.
    pub green: bool,
    /// Fault.
    pub red: bool,
}

/// How long a flash lasts, and the dark after it: easy to count by eye. No times are printed.
pub const FLASH_NS: u64 = 200_000_000;

/// Dark between two counts: five times a flash, so that two counts are not taken for one.
pub const PAUSE_NS: u64 = 1_000_000_000;

/// The lights of a drive that is supplied; `flashes` is the fault's count, 0 without a fault.
pub(super) fn shown(flashes: u8, now: Instant) -> Led {
    let count_ns = 2 * FLASH_NS * u64::from(flashes);
    let within_ns = now.nanos_since(Instant::ZERO) % (count_ns + PAUSE_NS);
    Led { green: true, red: within_ns < count_ns && within_ns % (2 * FLASH_NS) < FLASH_NS }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn red_flashes_as_often_as_the_fault_counts() {
        for flashes in 0..=5 {
            let red = |ms: u64| shown(flashes, Instant::from_millis(ms)).red;
            let cycle_ms = (2 * FLASH_NS * u64::from(flashes) + PAUSE_NS) / 1_000_000;
            let rises = (1..=cycle_ms).filter(|ms| red(*ms) && !red(ms - 1)).count();
            assert_eq!(rises, usize::from(flashes));
        }
    }
}
