//! Emergency stops: the input of 5.4 with 202Fh:03, and 605Ah = 7 and 605Dh = 3, in each of their readings.

use crate::virtual_zlac8030l::bench::{Bench, assert_within};
use crate::virtual_zlac8030l::stopping::{LOOK, Ramp, assert_coasts, assert_stops, brought_to_speed, turning};

const FREE: i64 = 1;
/// Switch on disabled with the external stop, bit 15.
const DISABLED_FROM_OUTSIDE: u16 = 0x8070;

/// What an input has to hold for more than 10 ms counts from now on.
fn press(bench: &mut Bench, on: bool) {
    bench.set_input(0, on).run_ms(10);
}

/// Whether a push of 0.5 N m for 0.3 s turns the shaft: 0.4 N m above its friction go 840 counts.
fn gives_way(bench: &mut Bench) -> bool {
    let stands = bench.report().position;
    bench.set_load_torque(0.5).run_ms(300);
    bench.set_load_torque(0.0);
    let way = (bench.report().position - stands).abs();
    assert!(!(30..=700).contains(&way), "{way} counts");
    bench.run_ms(2000);
    way > 700
}

/// An external stop in each reading: what is chosen, 202F:03, 605Ah, how it stops, the statusword then, and whether the
/// shaft gives way. The maker's guide of 2024 has 202F:03 = 1: 5 and 6 ramp, 7 does not, then the PWM goes off and the
/// motor is disabled; 5.4.2 has 0: enabled at speed 0.
#[test]
fn an_external_stop_ramps_as_605ah_says_and_ends_as_202f_03_and_the_reading_say() {
    let held = [("L123", "limit"), ("L123", "coast")].map(|reading| (reading, 0, 0x8037, false));
    let disabled = ["limit", "ramp", "coast"].map(|reading| (("L123", reading), FREE, DISABLED_FROM_OUTSIDE, true));
    let enabled = [(("L039", "enabled"), FREE, 0x8037, true)];
    for ((key, reading), released, statusword, way) in held.into_iter().chain(disabled).chain(enabled) {
        for (option, ramp) in [(5, Some(Ramp::Time(0.4))), (6, Some(Ramp::Time(0.1))), (7, None)] {
            let mut bench = brought_to_speed(Bench::choosing(key, reading));
            bench.set(0x605A, option).set((0x202F, 3), released);
            press(&mut bench, true);
            match ramp {
                Some(ramp) => assert_stops(&mut bench, ramp),
                None if released == FREE => {
                    bench.run_ms(2);
                    assert_eq!(bench.statusword() & 0x80FF, statusword, "at once");
                    assert_coasts(&mut bench);
                }
                // 8 ms at 30 A, and the swing of a step.
                None => _ = bench.run_ms(50).turns_at(-10.0, 10.0).run_ms(500),
            }
            let at = format!("{key}={reading}, 202F:03 = {released}, 605Ah = {option}");
            assert_eq!(bench.statusword() & 0x80FF, statusword, "{at}");
            assert_eq!(gives_way(&mut bench), way, "{at}");
            bench.reads(0x603F, 0).reads(0x60FF, 0);
        }
    }
}

#[test]
fn after_a_stop_that_ends_disabled_the_host_enables_anew_once_the_input_is_off() {
    let mut bench = turning();
    bench.set((0x202F, 3), FREE);
    press(&mut bench, true);
    bench.run_ms(800);
    bench.enable().run_ms(2);
    assert_eq!(bench.statusword() & 0x80FF, DISABLED_FROM_OUTSIDE, "while the input acts it does not stay enabled");
    press(&mut bench, false);
    bench.run_ms(100);
    assert_eq!(bench.statusword() & 0x80FF, 0x0070, "nothing starts by itself");
    bench.enable().set(0x60FF, 60).run_ms(700).turns_at(59.0, 61.0);
}

#[test]
fn a_stop_that_releases_the_shaft_releases_one_that_a_quick_stop_or_200fh_holds() {
    let mut bench = turning();
    bench.set(0x200F, 1).set((0x202F, 3), FREE).set(0x6040, 0x02).run_ms(800);
    assert!(!gives_way(&mut bench), "held in quick stop active");
    press(&mut bench, true);
    bench.run_ms(2).shows(0x80FF, DISABLED_FROM_OUTSIDE);
    assert!(gives_way(&mut bench));
    press(&mut bench, false);
    assert!(!gives_way(&mut bench), "200Fh = 1 locks again");
}

/// Quick stop (4.6) by 605Ah and halt by 605Dh; 605Ah = 7 and 605Dh = 3 in each reading.
#[test]
fn a_commanded_stop_ramps_as_its_option_says_holds_the_shaft_unless_it_coasts_and_the_velocity_goes_on() {
    let (slow, quick) = (Some(Ramp::Time(0.4)), Some(Ramp::Time(0.1)));
    for (object, first, controlword, low_byte) in [(0x605A, 5, 0x02, 0x17), (0x605D, 1, 0x10F, 0x37)] {
        for (reading, option, ramp) in [
            ("limit", first, slow),
            ("limit", first + 1, quick),
            ("limit", first + 2, Some(Ramp::CurrentLimit)),
            ("ramp", first + 2, quick),
            ("coast", first + 2, None),
        ] {
            let mut bench = brought_to_speed(Bench::choosing("L123", reading));
            bench.set(object, option).set(0x6040, controlword);
            match ramp {
                Some(ramp) => assert_stops(&mut bench, ramp),
                None => assert_coasts(&mut bench),
            }
            // Standing is reached.
            assert_eq!(bench.statusword() & 0x04FF, 0x0400 | low_byte, "{object:X}h = {option}, {reading}");
            assert_eq!(gives_way(&mut bench), ramp.is_none(), "{object:X}h = {option}, {reading}");
            bench.set(0x6040, 0x0F).run_ms(800).turns_at(119.0, 121.0);
        }
    }
}

#[test]
fn with_l039_enabled_a_wheel_released_by_an_external_stop_is_caught_where_it_is_and_not_pulled_back() {
    // Held again by 202F:03, or by a quick stop, after it has rolled away.
    for (object, sub, value) in [(0x202F, 3, 0), (0x6040, 0, 0x02)] {
        let mut bench = brought_to_speed(Bench::choosing("L039", "enabled"));
        bench.set((0x202F, 3), 1);
        press(&mut bench, true);
        bench.run_ms(600);
        bench.set_load_torque(0.5).run_ms(500);
        bench.set_load_torque(0.0);
        let released = bench.report();
        assert!(released.velocity_rpm < -50.0, "it rolls: {released:?}");
        bench.set((object, sub), value);
        let mut speeds = Vec::new();
        for _ in 0..800 {
            bench.run(LOOK);
            speeds.push(bench.report().velocity_rpm);
        }
        let fastest_back = speeds.iter().copied().fold(0.0, f64::max);
        assert_within("greatest speed back", fastest_back, 0.0, 5.0);
        assert_within("speed in the end", speeds[speeds.len() - 1], -0.5, 0.5);
        assert_eq!(bench.get(0x603F), 0, "{object:04X}h");
    }
}
