//! Extremes: whatever a host writes and whatever happens around the machine, the drive answers, stays finite and obeys.

use std::time::Duration;

use ferrodrive_tests::bench::zlac8030l::Zlac8030l;
use ferrodrive_tests::random_host::{self, Play};
use ferrodrive_tests::zlac8030l::objects;
use sim::TemperatureSensor;

use crate::virtual_zlac8030l::bench::{Bench, assert_within};
use crate::virtual_zlac8030l::wheel;

/// Writes that a random host may not do: node-ID and bit rate take the drive off this bus at its next restart, and 1005h
/// would make other frames SYNC.
const SPARED: [u16; 3] = [0x200D, 0x200E, 0x1005];

#[test]
fn a_host_that_writes_anything_anywhere_is_answered_and_breaks_nothing() {
    random_host::is_answered_and_breaks_nothing(&Play::<Zlac8030l> {
        seeds: 60,
        spared: &SPARED,
        hands: &[
            ("load torque 2", "load torque 0"),
            ("load torque 1", "load torque 0"),
            ("load torque -1", "load torque 0"),
            ("load torque -2", "load torque 0"),
            ("load inertia 0.2", "load inertia 0"),
            ("rotor lock", "rotor free"),
            ("fault hall on", "fault hall off"),
            ("fault encoder on", "fault encoder off"),
            ("fault phase on", "fault phase off"),
            ("input X0 1", "input X0 0"),
        ],
        states: (0x03FF, &[0x0270, 0x0231, 0x0233, 0x0237, 0x0217, 0x0298]),
        recovers,
    });
}

/// Given its factory settings and restarted, the mended drive is as delivered.
fn recovers(bench: &mut Bench, seed: u64) {
    bench.set(0x6040, 0).set(0x200F, 0);
    // A wheel that the load drove fast has charged the bus, and only the electronics discharge it.
    let calm = |report: &sim::Report| report.velocity_rpm.abs() < 1.0 && report.supply_v < 60.0;
    bench.seconds_until(60.0, Duration::from_millis(100), calm);
    bench.set(0x2009, 1).let_store().power_cycle().run_ms(500);
    for row in objects().iter().filter(|row| row.stored && !row.live) {
        assert_eq!(Some(bench.get((row.index, row.sub))), row.default, "seed {seed}: {}", row.name);
    }
    bench.enable_in(3).set(0x60FF, 60).run_ms(1500);
    assert_within(&format!("speed after seed {seed}"), bench.report().velocity_rpm, 59.0, 61.0);
}

#[test]
fn times_of_zero_are_steps_at_the_current_limit_without_a_fault() {
    let mut bench = Bench::new();
    for index in [0x6083, 0x6084, 0x6085] {
        bench.set(index, 0);
    }
    bench.enable_in(3);
    for target in [100, -100, 0] {
        bench.set(0x60FF, target).run_ms(400).turns_at(target as f64 - 2.0, target as f64 + 2.0);
    }
    bench.reads(0x603F, 0);
}

#[test]
fn a_heavy_load_is_accelerated_at_the_current_limit_and_no_more() {
    let mut bench = Bench::new();
    bench.set_load_inertia(1.0).set(0x2015, 100).set(0x6083, 0).enable_in(3).set(0x60FF, 60).run_ms(200);
    let first = bench.report();
    assert_within("current", first.current_a, 9.8, 10.2);
    bench.run_ms(400);
    let gained = (bench.report().velocity_rpm - first.velocity_rpm) * wheel::RAD_S_PER_RPM;
    let expected = 0.4 * (10.0 * wheel::torque_per_a() - wheel::friction_nm(2.0)) / (1.0 + wheel::inertia_kg_m2());
    assert_within("rad/s gained in 0.4 s", gained, expected * 0.97, expected * 1.03);
}

#[test]
fn a_load_that_drives_the_motor_is_held_at_its_speed_and_feeds_the_bus_until_it_is_too_much() {
    let mut bench = Bench::new();
    bench.enable_in(3).set(0x60FF, 200).run_ms(1000);
    bench.set_load_torque(-3.0).run_ms(300).turns_at(195.0, 206.0);
    assert!(bench.report().supply_v > 49.0, "{} V", bench.report().supply_v);
    bench.run_ms(5000).reads(0x603F, 0x0001);

    let mut bench = Bench::new();
    bench.set((0x202E, 5), 1).enable_in(3).set(0x60FF, 200).run_ms(1000);
    bench.set_load_torque(-3.0).run_ms(5000);
    assert_eq!(bench.get(0x603F), 0, "the bleeder takes it");
    bench.turns_at(199.0, 201.0);
}

#[test]
fn without_a_mode_an_enabled_drive_stands_whatever_its_targets_are() {
    let mut bench = Bench::new();
    bench.enable_in(0).set(0x60FF, 100).set(0x6071, 1000).set(0x607A, 4096).set(0x6040, 0x1F).run_ms(1000);
    assert_within("counts", bench.report().position as f64, -2.0, 2.0);
}

#[test]
fn an_external_stop_that_is_active_is_reported_by_bit_15_and_lets_nothing_start_in_any_mode() {
    for mode in [1, 3, 4] {
        let mut bench = Bench::new();
        bench.shows(0x8000, 0).set_input(0, true).run_ms(20);
        bench.enable_in(mode).set(0x60FF, 100).set(0x6071, 2000).set(0x607A, 8192).set(0x6040, 0x1F).run_ms(2000);
        assert_within(&format!("counts in mode {mode}"), bench.report().position as f64, -5.0, 5.0);
        bench.shows(0x8000, 0x8000).reads(0x2003, 1);
        // Nothing starts by itself when it ends.
        bench.set_input(0, false).run_ms(20).shows(0x8000, 0).run_ms(2000);
        assert_within(&format!("counts in mode {mode}"), bench.report().position as f64, -10.0, 10.0);
    }
}

#[test]
fn no_target_is_followed_beyond_the_maximum_speed_of_200ah_and_a_lower_one_is_followed_in_motion() {
    let mut bench = Bench::new();
    bench.enable_in(3).set(0x60FF, 200).run_ms(1000);
    bench.set(0x200A, 80).run_ms(1000).turns_at(79.0, 81.0).set(0x60FF, -300).run_ms(1500).turns_at(-81.0, -79.0);
    let mut bench = Bench::new();
    bench.set(0x200A, 30).enable_in(1).set(0x607A, 8192).set(0x6040, 0x1F).run_ms(1500);
    assert_within("speed of a move with 6081h = 120", bench.report().velocity_rpm, 29.0, 31.0);
}

#[test]
fn a_current_limit_of_zero_moves_nothing_and_an_overload_watch_of_zero_is_off() {
    let mut bench = Bench::new();
    bench.set(0x2015, 0).enable_in(3).set(0x60FF, 100).run_ms(1000).turns_at(-0.1, 0.1).reads(0x603F, 0);

    for (object, value) in [(0x2014, 0), (0x2012, 0), (0x2016, 0)] {
        let mut bench = Bench::new();
        bench.set_rotor_locked(true);
        bench
            .operate(|drive, now| drive.hold_temperature(TemperatureSensor::Motor, Some(40.0), now))
            .expect("a sensor");
        bench.set(object, value).set(0x6087, 0).enable_in(4).set(0x6071, 30_000).run_ms(10_000);
        assert_eq!(bench.get(0x603F), 0, "{object:04X}h = {value}");
    }
}

#[test]
fn turning_by_hand_counts_in_every_state_and_raises_nothing() {
    let mut bench = Bench::new();
    bench.set_load_torque(-0.3).run_ms(500);
    bench.set_load_torque(0.0).run_ms(200);
    let turned = bench.report().shaft_angle_rad / core::f64::consts::TAU * wheel::COUNTS_PER_TURN;
    bench.set_rotor_locked(true);
    let position = bench.get(0x6064) as f64;
    assert_within("6064h", position, turned - 2.0, turned + 2.0);
    assert!(turned > 500.0);
    bench.reads(0x603F, 0);
}
