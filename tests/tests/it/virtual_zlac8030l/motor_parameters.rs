//! The motor parameters of the drive: encoder lines (200Bh), pole pairs (200Ch), Hall offset (2011h).

use crate::virtual_zlac8030l::bench::{Bench, assert_within};

const ENCODER_FAULT: i64 = 0x1000;

/// Runs at 60 r/min for 2 s; the speed and the fault code afterwards.
fn run(bench: &mut Bench) -> (f64, i64) {
    bench.enable_in(3).set(0x60FF, 60).run_ms(2000);
    (bench.report().velocity_rpm, bench.get(0x603F))
}

#[test]
fn another_encoder_counts_four_times_its_lines_a_turn() {
    for lines in [500, 1024, 2500] {
        let mut bench = Bench::open();
        bench.motor().model.encoder.lines = lines;
        bench.set(0x200B, i64::from(lines)).run_ms(10);
        let (rpm, fault) = run(&mut bench);
        assert_eq!(fault, 0, "{lines} lines");
        assert_within("speed", rpm, 59.0, 61.0);
        let turns = bench.report().shaft_angle_rad / core::f64::consts::TAU;
        let counts = bench.get(0x6064) as f64;
        assert_within("counts a turn", counts / turns, f64::from(4 * lines) * 0.99, f64::from(4 * lines) * 1.01);
    }
}

#[test]
fn another_motor_runs_with_its_own_pole_pairs_and_is_found_out_with_others() {
    for (motor, reported, runs) in [(10, 10, true), (15, 15, true), (15, 10, false), (10, 15, false)] {
        let mut bench = Bench::open();
        bench.motor().model.pmsm.pole_pairs = motor;
        bench.set(0x200C, i64::from(reported)).run_ms(10);
        let (rpm, fault) = run(&mut bench);
        if runs {
            assert_eq!(fault, 0, "{motor} pole pairs");
            assert_within("speed", rpm, 59.0, 61.0);
        } else {
            assert_eq!(fault & ENCODER_FAULT, ENCODER_FAULT, "{reported} for {motor} pole pairs: {fault:04X}h");
        }
    }
}

#[test]
fn hall_sensors_that_sit_askew_are_put_right_by_2011h() {
    let runs = |offset_deg: i64| {
        let mut bench = Bench::open();
        bench.motor().model.hall.offset_turns = 0.25;
        bench.set(0x2011, offset_deg).let_store();
        // The angle is taken from the Hall sensors when the drive starts.
        bench.power_cycle();
        let (rpm, fault) = run(&mut bench);
        fault == 0 && (rpm - 60.0).abs() < 1.0
    };
    assert!(!runs(0), "a quarter of a turn off there is no torque");
    assert!(runs(90) != runs(-90), "one of the two directions is right");
}
