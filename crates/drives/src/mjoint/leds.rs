//! The two LEDs as a function of time ("M Robot Joint Motor CanOpen Manual", "Status indication and alarm").
//!
//! Both are lit once after power-on. Then red flashes the alarm code: its high digit long, its low digit short. Green
//! shows the state of the battery. The lengths are not printed; they are such that a person can count.

use super::hardware::Battery;

/// Which LED is lit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Leds {
    /// Red.
    pub red: bool,
    /// Green.
    pub green: bool,
}

/// How long both are lit after power-on.
pub(super) const LAMP_TEST_MS: u64 = 500;
const LONG_MS: u64 = 900;
const SHORT_MS: u64 = 200;
/// Dark after each flash.
const GAP_MS: u64 = 300;
/// Dark after a whole code.
const PAUSE_MS: u64 = 1500;
/// Half of a period of green while the battery is charged.
const CHARGING_MS: u64 = 500;
/// Half of a period of green without a battery: "high frequency flicker".
const FLICKER_MS: u64 = 50;

/// The LEDs at `ms` after power-on.
pub fn leds(alarm: u16, battery: Battery, ms: u64) -> Leds {
    if ms < LAMP_TEST_MS {
        return Leds { red: true, green: true };
    }
    let green = match battery {
        Battery::Full => true,
        Battery::Charging => (ms / CHARGING_MS).is_multiple_of(2),
        Battery::Missing => (ms / FLICKER_MS).is_multiple_of(2),
    };
    Leds { red: alarm != 0 && red(alarm, ms - LAMP_TEST_MS), green }
}

fn red(alarm: u16, ms: u64) -> bool {
    let (long, short) = (u64::from(alarm >> 4), u64::from(alarm & 0xF));
    let long_ms = long * (LONG_MS + GAP_MS);
    let short_ms = short * (SHORT_MS + GAP_MS);
    let at = ms % (long_ms + short_ms + PAUSE_MS);
    if at < long_ms {
        at % (LONG_MS + GAP_MS) < LONG_MS
    } else {
        at < long_ms + short_ms && (at - long_ms) % (SHORT_MS + GAP_MS) < SHORT_MS
    }
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use super::*;

    /// Lengths of the red flashes of one round, in ms.
    fn flashes(alarm: u16) -> Vec<u64> {
        let mut lengths = Vec::new();
        let mut lit = 0;
        for ms in LAMP_TEST_MS..LAMP_TEST_MS + 20_000 {
            if leds(alarm, Battery::Full, ms).red {
                lit += 1;
            } else if lit > 0 {
                lengths.push(core::mem::take(&mut lit));
            }
        }
        let round = usize::from((alarm >> 4) + (alarm & 0xF));
        lengths.truncate(round);
        lengths
    }

    #[test]
    fn red_flashes_the_high_digit_long_and_the_low_digit_short() {
        assert_eq!(flashes(0x20), [LONG_MS; 2]);
        assert_eq!(flashes(0x10), [LONG_MS]);
        assert_eq!(flashes(0x12), [LONG_MS, SHORT_MS, SHORT_MS]);
        assert_eq!(flashes(0x14), [LONG_MS, SHORT_MS, SHORT_MS, SHORT_MS, SHORT_MS]);
        assert_eq!(flashes(0x15).len(), 6);
    }

    #[test]
    fn both_are_lit_once_at_power_on_and_green_then_shows_the_battery() {
        assert_eq!(leds(0, Battery::Missing, 100), Leds { red: true, green: true });
        let changes = |battery| {
            let states: Vec<bool> = (1000..2000).map(|ms| leds(0, battery, ms).green).collect();
            states.windows(2).filter(|pair| pair[0] != pair[1]).count()
        };
        assert_eq!((changes(Battery::Full), changes(Battery::Charging), changes(Battery::Missing)), (0, 1, 19));
        assert!(!leds(0, Battery::Full, 1000).red);
    }
}
