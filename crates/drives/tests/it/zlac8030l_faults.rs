//! Faults of the ZLAC8030L that a sound motor cannot cause, fed to the firmware's pins.
//!
//! Codes are those of 603Fh (ZLAC8030L quick start guide, fault table).

use can::{Instant, Station};
use drives::Firmware;
use drives::zlac8030l::{Hardware, Sensors, Zlac8030l, objects};

const NONE: u16 = 0;
const OVER_CURRENT: u16 = 0x0004;
const HALL: u16 = 0x0200;

/// 603Fh after 100 ms with these signals.
fn fault_code(sensors: &Sensors) -> u16 {
    let mut drive = Zlac8030l::new();
    drive.power_on(&Hardware::default(), Instant::ZERO);
    let mut now = Instant::ZERO;
    let end = Instant::from_millis(100);
    while now < end {
        now = now.plus_nanos(Zlac8030l::CONTROL_PERIOD_NS);
        let _ = drive.tick(sensors, now);
        drive.handle_timeout(now);
        while let Some(frame) = drive.poll_transmit() {
            drive.handle_transmitted(&frame, now);
        }
    }
    drive.values().get(objects::ERROR_CODE)
}

#[test]
fn the_third_phase_carries_what_the_other_two_do_not_bring_back() {
    for (phase_current_a, expected) in [
        ([0.0, 0.0], NONE),
        ([90.0, -10.0], OVER_CURRENT),
        ([10.0, -90.0], OVER_CURRENT),
        // W has 100 A; then none.
        ([50.0, 50.0], OVER_CURRENT),
        ([-50.0, -50.0], OVER_CURRENT),
        ([60.0, -60.0], NONE),
        ([f32::NAN, 0.0], OVER_CURRENT),
    ] {
        assert_eq!(fault_code(&Sensors { phase_current_a, ..Sensors::default() }), expected, "{phase_current_a:?} A");
    }
}

#[test]
fn hall_sensors_that_are_all_low_or_all_high_are_a_fault_and_no_other_state_is() {
    for hall in 0..8 {
        let expected = if matches!(hall, 0 | 7) { HALL } else { NONE };
        assert_eq!(fault_code(&Sensors { hall, ..Sensors::default() }), expected, "state {hall}");
    }
}
