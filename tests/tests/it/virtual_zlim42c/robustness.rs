//! Extremes: whatever a host writes and whatever happens to the supply, the drive answers, stays finite and obeys.

use std::time::Duration;

use ferrodrive_tests::bench::zlim42c::Zlim42c;
use ferrodrive_tests::random_host::{self, Play};
use ferrodrive_tests::seeded::Seeded;

use crate::virtual_zlim42c::bench::Bench;

/// Writes that a random host may not do: node-ID and bit rate take the drive off this bus at its next restart, and 1005h
/// would make other frames SYNC.
const SPARED: [u16; 3] = [0x2008, 0x2009, 0x1005];

#[test]
fn a_host_that_writes_anything_anywhere_is_answered_and_breaks_nothing() {
    random_host::is_answered_and_breaks_nothing(&Play::<Zlim42c> {
        seeds: 100,
        spared: &SPARED,
        hands: &[
            ("load torque 0.4", "load torque 0"),
            ("load torque 0.2", "load torque 0"),
            ("load torque -0.2", "load torque 0"),
            ("load torque -0.4", "load torque 0"),
            ("load inertia 1e-4", "load inertia 0"),
            // A rotor that coasts feeds the bus: in the end it is held.
            ("rotor free", "rotor lock"),
            ("supply 42", "supply 24"),
            ("fault reference on", "fault reference off"),
            ("fault eeprom on", "fault eeprom off"),
            ("fault phase on", "fault phase off"),
            ("input X0 1", "input X0 0"),
            ("input X1 1", "input X1 0"),
            ("input X2 1", "input X2 0"),
            ("input X3 1", "input X3 0"),
        ],
        // docs/drives/zlim42c.md, 5.3.1, without bit 8.
        states: (0x02FF, &[0x0270, 0x0231, 0x0233, 0x0237, 0x0217, 0x0298]),
        recovers,
    });
}

/// Given its factory settings and restarted, the mended drive is as delivered.
fn recovers(bench: &mut Bench, seed: u64) {
    // What it has fed, up to a hundred volts, goes away with the drive's own 1 W.
    bench.run_ms(2000);
    bench.set_rotor_locked(false).set(0x2010, 1).let_store().power_cycle().run_ms(100);
    assert_eq!((bench.statusword(), bench.get(0x603F), bench.get(0x2006)), (0x0270, 0, 10), "seed {seed}");
    bench.enable_in(1).move_by(400).run_ms(1000);
    assert_eq!(bench.get(0x6064), 400, "seed {seed}");
}

#[test]
fn a_brown_out_in_motion_restarts_the_drive_at_position_0_with_its_stored_values() {
    let mut bench = Bench::new();
    bench.set(0x2005, 5).set(0x200E, 50).enable_in(3).set(0x60FF, 120).run_ms(1000);
    let turned = bench.get(0x6064);
    assert!(turned > 4000, "{turned} pulses");
    bench.forget();
    // Down to 5 V, where no converter of the drive runs, and back.
    for supply_v in [5.0, 24.0] {
        bench.set_supply(supply_v).run_ms(1000);
    }
    assert_eq!(bench.heard().iter().filter(|frame| *frame == "701#00").count(), 1);
    bench.shows(0xFFFF, 0x0270).reads(0x6064, 0).reads(0x603F, 0).reads(0x6060, 0).reads(0x60FF, 0).reads(0x606C, 0);
    assert_eq!((bench.get(0x2005), bench.get(0x200E)), (5, 5), "2005h is stored, 200Eh is not");
    // The free rotor rests in its detent, at most half an electrical turn from where the vector will stand up.
    let rotor = bench.report().rotor_position.expect("known here");
    assert!(rotor.abs() <= 40, "both begin anew: {rotor}");
}

#[test]
fn speeds_and_times_at_the_ends_of_their_ranges_still_end_on_the_target() {
    for (top, start, end) in [(5, 300, 3000), (5, 2, 5), (3000, 2, 5), (120, 300, 3000)] {
        for (up_ms, down_ms) in [(0, 0), (2000, 0), (0, 2000), (2000, 2000)] {
            let mut bench = Bench::new();
            for (index, value) in [(0x6081, top), (0x200E, start), (0x6082, end), (0x6083, up_ms), (0x6084, down_ms)] {
                bench.set(index, value);
            }
            bench.enable_in(1);
            let mut expected = 0;
            for pulses in [1, -1, 80, 0, -800] {
                bench.move_by(pulses);
                expected += pulses;
                bench.seconds_until(30.0, Duration::from_millis(5), |report| report.velocity_demand_rpm == Some(0.0));
                bench.run_ms(2);
                assert_eq!(bench.get(0x6064), expected, "{pulses} at {top}, {start}, {end}, {up_ms}, {down_ms}");
                assert_ne!(bench.statusword() & 1 << 10, 0);
            }
        }
    }
}

#[test]
fn set_points_that_replace_each_other_at_any_moment_end_on_the_last_one() {
    for seed in 0..40 {
        let mut seeded = Seeded::new(seed);
        let mut bench = Bench::new();
        bench.set(0x2006, seeded.below(16) as i64).enable_in(1);
        let mut expected = 0;
        for _ in 0..12 {
            let mut up_to = |most: usize| seeded.below(most) as i64;
            let settings =
                [(0x6081, 60 + up_to(900)), (0x6082, 5 + up_to(100)), (0x200E, 2 + up_to(100)), (0x6083, up_to(300))];
            for (index, value) in settings.into_iter().chain([(0x6084, up_to(300))]) {
                bench.set(index, value);
            }
            let (target, relative) = (up_to(4000) - 2000, up_to(2) == 0);
            let controlword = if relative { 0x6F } else { 0x2F };
            for (index, value) in [(0x607A, target), (0x6040, controlword), (0x6040, controlword | 0x10)] {
                bench.set(index, value);
            }
            expected = if relative { expected + target } else { target };
            let mut last = bench.report().position;
            for _ in 0..up_to(400) {
                bench.run_ms(1);
                let position = bench.report().position;
                assert!((position - last).abs() <= 201, "seed {seed}: {} steps in 1 ms", position - last);
                last = position;
            }
        }
        bench.seconds_until(100.0, Duration::from_millis(20), |report| report.velocity_demand_rpm == Some(0.0));
        bench.run_ms(2);
        assert_eq!(bench.get(0x6064), expected, "seed {seed}");
    }
}

#[test]
fn a_run_is_the_same_whatever_the_strides_of_time() {
    let run = |strides_us: &[u64]| {
        let mut bench = Bench::new();
        bench.enable_in(1).move_by(12_345);
        let end = bench.world.now() + Duration::from_millis(700);
        for stride_us in strides_us.iter().cycle() {
            let left = Duration::from_nanos(end.nanos_since(bench.world.now()));
            if left.is_zero() {
                break;
            }
            bench.run(Duration::from_micros(*stride_us).min(left));
        }
        (bench.report(), bench.heard())
    };
    let once = run(&[1_000_000]);
    assert!(once.0.position > 1000, "{:?}", once.0);
    for strides_us in [&[50][..], &[1000], &[7, 13, 1111]] {
        assert_eq!(run(strides_us), once, "{strides_us:?}");
    }
}

#[test]
fn a_sound_motor_has_no_fault_but_over_voltage_whatever_it_is_asked_and_whatever_pulls_at_it() {
    for seed in 0..60 {
        let mut seeded = Seeded::new(seed);
        let mut bench = if seed % 2 == 0 { Bench::new() } else { Bench::long() };
        let supply_v = 20.0 + seeded.below(11) as f64;
        bench.set_supply(supply_v);
        for (index, most) in [(0x2005, 8), (0x2006, 16), (0x2007, 2)] {
            bench.set(index, seeded.below(most) as i64);
        }
        bench.enable_in(3);
        for step in 0..30 {
            // Now and then nearly no ramp: the vector jumps.
            let ramp_ms = if seeded.below(3) == 0 { 5 } else { 1000 };
            bench.set(0x6083, seeded.below(ramp_ms) as i64).set(0x6084, seeded.below(ramp_ms) as i64);
            bench.set(0x60FF, seeded.below(6001) as i64 - 3000);
            let (torque_nm, choice) = (seeded.below(13) as f64 * 0.1 - 0.6, seeded.below(6));
            bench.operate(|drive, now| {
                match choice {
                    0 => drive.set_load_torque(torque_nm, now),
                    1 => drive.set_rotor_locked(torque_nm > 0.0, now),
                    2 => drive.set_load_inertia(torque_nm.abs() * 1e-4, now),
                    _ => drive.set_load_torque(0.0, now),
                }
                .expect("a load");
            });
            bench.run_ms(50 + seeded.below(400) as u64);
            let report = bench.report();
            assert!(matches!(report.error_code, 0 | 0xFF01), "seed {seed}, step {step}: {report:?}");
            if report.error_code != 0 {
                break;
            }
        }
    }
}
