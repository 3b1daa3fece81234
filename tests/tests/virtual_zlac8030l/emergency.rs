//! Emergency stops: the input of 5.4 with 202Fh:03, and 605Ah = 7 and 605Dh = 3, in each of their readings.

use crate::bench::{Bench, assert_within};
use crate::stopping::{LOOK, Ramp, assert_coasts, assert_stops, brought_to_speed, turning};

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

/// 5.4.2: enabled at speed 0.
#[test]
fn an_external_stop_with_202f_03_0_ramps_as_605ah_says_and_locks_the_shaft() {
    for reading in ["limit", "coast"] {
        for (option, ramp) in [(5, Some(Ramp::Time(0.4))), (6, Some(Ramp::Time(0.1))), (7, None)] {
            let mut bench = brought_to_speed(Bench::choosing("L123", reading));
            bench.set(0x605A, option);
            press(&mut bench, true);
            match ramp {
                Some(ramp) => assert_stops(&mut bench, ramp),
                // 8 ms at 30 A, and the swing of a step.
                None => {
                    bench.run_ms(50).turns_at(-10.0, 10.0);
                    bench.run_ms(500);
                }
            }
            assert_eq!(bench.statusword() & 0x80FF, 0x8037, "enabled, stopped from outside");
            assert!(!gives_way(&mut bench), "605Ah = {option}");
        }
    }
}

/// The maker's guide of 2024: 5 and 6 ramp, then the PWM goes off, and the motor is disabled.
#[test]
fn an_external_stop_with_202f_03_1_ramps_as_605ah_says_and_ends_disabled() {
    for (option, ramp) in [(5, Ramp::Time(0.4)), (6, Ramp::Time(0.1))] {
        let mut bench = turning();
        bench.set(0x605A, option).set((0x202F, 3), FREE);
        press(&mut bench, true);
        assert_stops(&mut bench, ramp);
        bench.shows(0x80FF, DISABLED_FROM_OUTSIDE);
        assert!(gives_way(&mut bench), "605Ah = {option}");
        bench.reads(0x603F, 0).reads(0x60FF, 0);
    }
}

/// The same guide: 7 switches the PWM off at once.
#[test]
fn an_external_stop_with_202f_03_1_and_605ah_7_lets_the_motor_coast_disabled_in_each_reading_of_605ah() {
    for reading in ["limit", "ramp", "coast"] {
        let mut bench = brought_to_speed(Bench::choosing("L123", reading));
        bench.set(0x605A, 7).set((0x202F, 3), FREE);
        press(&mut bench, true);
        bench.run_ms(2);
        assert_eq!(bench.statusword() & 0x80FF, DISABLED_FROM_OUTSIDE, "at once");
        assert_coasts(&mut bench);
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

#[test]
fn with_l039_enabled_a_stop_that_releases_the_shaft_stays_enabled() {
    for (option, ramp) in [(5, Some(Ramp::Time(0.4))), (7, None)] {
        let mut bench = brought_to_speed(Bench::choosing("L039", "enabled"));
        bench.set(0x605A, option).set((0x202F, 3), FREE);
        press(&mut bench, true);
        match ramp {
            Some(ramp) => assert_stops(&mut bench, ramp),
            None => {
                bench.run_ms(2);
                assert_coasts(&mut bench);
            }
        }
        assert_eq!(bench.statusword() & 0x80FF, 0x8037, "605Ah = {option}");
        assert!(gives_way(&mut bench));
    }
}

/// 605Ah = 7 and 605Dh = 3 by the controlword (4.6, and bit 8).
#[test]
fn a_commanded_emergency_stop_brakes_at_the_current_limit_or_in_6085h_or_coasts_as_l123_says() {
    for (object, option, controlword, low_byte) in [(0x605A, 7, 0x02, 0x17), (0x605D, 3, 0x10F, 0x37)] {
        for (reading, ramp) in [("limit", Some(Ramp::CurrentLimit)), ("ramp", Some(Ramp::Time(0.1))), ("coast", None)] {
            let mut bench = brought_to_speed(Bench::choosing("L123", reading));
            bench.set(object, option).set(0x6040, controlword);
            match ramp {
                Some(ramp) => assert_stops(&mut bench, ramp),
                None => assert_coasts(&mut bench),
            }
            assert_eq!(bench.statusword() & 0xFF, low_byte, "{reading}");
            assert_eq!(gives_way(&mut bench), ramp.is_none(), "{reading} holds, unless it coasts");
            bench.set(0x6040, 0x0F).run_ms(800);
            assert_within("speed afterwards", bench.report().velocity_rpm, 119.0, 121.0);
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
