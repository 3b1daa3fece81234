//! Profile velocity (manual 4.1, 5.3): ramps, limits, units, direction, and what the supply allows.

use std::time::Duration;

use crate::virtual_zlac8030l::bench::{Bench, assert_within};
use crate::virtual_zlac8030l::wheel;

const LOOK: Duration = Duration::from_millis(1);

/// Enabled in profile velocity with ramp times in ms.
fn ready(acceleration_ms: i64, deceleration_ms: i64) -> Bench {
    let mut bench = Bench::new();
    bench.set(0x6083, acceleration_ms).set(0x6084, deceleration_ms).enable_in(3);
    bench
}

fn rpm(bench: &mut Bench) -> f64 {
    bench.report().velocity_rpm
}

#[test]
fn the_example_of_4_1_runs_at_the_speeds_that_it_sets() {
    let mut bench = ready(500, 500);
    for target in [100, -100, 50, -50] {
        bench.set(0x60FF, target);
        // Down to zero and up again: two ramps of 500 ms.
        bench.run_ms(1300);
        assert_within("speed in r/min", rpm(&mut bench), target as f64 - 1.0, target as f64 + 1.0);
        let heard = bench.get(0x606C) as f64 * 0.1;
        assert_within("606Ch", heard, target as f64 - 1.0, target as f64 + 1.0);
    }
}

/// The S of two parabolas: 1/8 of the change after a quarter of the time, half after half, 7/8 after three quarters.
#[test]
fn speeding_up_is_an_s_that_takes_the_time_of_6083h_and_slowing_down_one_of_6084h() {
    // Velocity control lags behind the plan: 10 ms of the steepest slope, 400 and 500 r/min/s; the rest is its swing.
    for (up_ms, down_ms, from, to, below, above) in
        [(1000, 500, 0.0, 200.0, 4.0, 2.5), (100, 800, 200.0, 0.0, 2.5, 5.0_f64)]
    {
        let mut bench = ready(up_ms, down_ms);
        bench.set(0x60FF, from as i64).run_ms(1000).set(0x60FF, to as i64);
        let time_ms = if to > from { 1000 } else { 800 };
        for share in [1.0 / 8.0, 0.5, 7.0 / 8.0] {
            let planned: f64 = from + (to - from) * share;
            bench.run_ms(time_ms / 4).turns_at(planned - below, planned + above);
        }
        let left = (rpm(bench.run_ms(time_ms / 5)) - to).abs();
        assert_within("r/min left shortly before the end", left, 0.1, 4.0);
        bench.run_ms(140).turns_about(to, if to == 0.0 { 0.5 } else { 2.0 });
    }
}

#[test]
fn a_resolution_of_10_or_5_makes_the_target_finer_after_it_was_saved_and_the_drive_restarted() {
    for (resolution, expected_rpm) in [(1, 100.0), (5, 20.0), (10, 10.0)] {
        let mut bench = ready(200, 200);
        bench.set((0x202F, 5), resolution).set(0x2009, 2).set(0x60FF, 100).run_ms(600);
        assert_within("speed before the restart", rpm(&mut bench), 99.0, 101.0);
        bench.power_cycle();
        bench.enable_in(3).set(0x60FF, 100).run_ms(1500);
        assert_within("speed after the restart", rpm(&mut bench), expected_rpm - 0.5, expected_rpm + 0.5);
        // 606Ch stays in 0.1 r/min.
        assert_within("606Ch", bench.get(0x606C) as f64, expected_rpm * 10.0 - 5.0, expected_rpm * 10.0 + 5.0);
    }
}

/// 5.3: a resolution is in effect after a restart, and so is the range that it gives.
#[test]
fn the_range_of_60ffh_grows_with_the_resolution_in_effect_so_that_1000_rpm_stay_in_reach() {
    let mut bench = Bench::new();
    bench.refuses(0x60FF, 1001, 0x0609_0031).set((0x202F, 5), 10).refuses(0x60FF, 1001, 0x0609_0031);
    bench.let_store().power_cycle();
    bench.set(0x60FF, 10_000).refuses(0x60FF, 10_001, 0x0609_0031).refuses(0x60FF, -10_001, 0x0609_0032);
    bench.set((0x202F, 5), 1).set(0x60FF, 5000).send("000#8104").run_ms(10).refuses(0x60FF, 1001, 0x0609_0031);
}

/// 7.1: bit 12 says that the speed is 0, bit 14 that the motor runs.
#[test]
fn bits_12_and_14_are_never_both_set_however_slowly_the_motor_turns() {
    let mut bench = Bench::new();
    bench.set((0x202F, 5), 10).let_store().power_cycle();
    bench.enable_in(3);
    // 0.5 r/min, then faster, to rest, and back through rest.
    for target in [5, 300, 0, -5, 5, 0] {
        bench.set(0x60FF, target);
        for _ in 0..700 {
            bench.run_ms(2);
            let statusword = bench.statusword();
            assert!(matches!(statusword & 0x5000, 0x1000 | 0x4000), "{statusword:04X}h at {target}");
        }
        assert_eq!(bench.statusword() & 0x5000, if target == 0 { 0x1000 } else { 0x4000 }, "target {target}");
        assert_eq!(bench.get(0x2027), i64::from(target != 0), "2027h");
    }
}

#[test]
fn direction_2001h_turns_the_shaft_the_other_way_round_for_the_same_target() {
    let turned = |direction| {
        let mut bench = Bench::new();
        bench.set(0x2001, direction).enable_in(3).set(0x60FF, 60).run_ms(1500);
        let (position, velocity) = (bench.get(0x6064), bench.get(0x606C));
        assert!(position > 1000 && velocity > 500, "the drive's own numbers keep their sign: {position}, {velocity}");
        bench.report().shaft_angle_rad
    };
    let (clockwise, counter_clockwise) = (turned(0), turned(1));
    assert!(clockwise * counter_clockwise < 0.0);
    // 0.5 s of S and 1 s at 60 r/min, or a little less: 1.25 turns.
    assert_within("way in rad", clockwise.abs(), 7.5, 8.1);
    assert_within("both ways alike", (clockwise + counter_clockwise).abs(), 0.0, 0.02);
}

/// Whatever is asked for, the induced voltage cannot exceed what the bus can give.
#[test]
fn the_supply_limits_the_speed_by_the_back_emf_which_is_no_fault_and_the_way_back_is_quick() {
    for supply_v in [24.0, 36.0] {
        let mut bench = ready(1000, 500);
        bench.set_supply(supply_v).set(0x60FF, 1000).run_ms(8000);
        let speed = rpm(&mut bench);
        assert_eq!(bench.get(0x603F), 0, "{supply_v} V");
        // The power stage gives all of the voltage but its dead time, a few per cent.
        let (low, high) = (wheel::no_load_rpm(supply_v, 0.96), wheel::no_load_rpm(supply_v, 1.0));
        assert_within(&format!("no-load speed at {supply_v} V"), speed, low, high);
        // The demand comes down from 1000 in 500 ms; the wheel joins it on the way.
        bench.set(0x60FF, 100).run_ms(900).turns_at(95.0, 105.0).reads(0x603F, 0);
    }
}

#[test]
fn a_load_within_the_current_limit_does_not_change_the_speed_and_takes_its_current() {
    let mut bench = ready(200, 200);
    bench.set(0x60FF, 60).run_ms(500);
    bench.set_load_torque(4.0).run_ms(1500);
    let speed = rpm(&mut bench);
    assert_within("speed", speed, 59.5, 60.5);
    let torque_nm = 4.0 + wheel::friction_nm(speed * wheel::RAD_S_PER_RPM);
    let current_a = torque_nm / wheel::torque_per_a();
    assert_within("6077h in 0.1 A", bench.get(0x6077) as f64, current_a * 10.0 - 1.5, current_a * 10.0 + 1.5);
}

#[test]
fn a_target_written_before_enabling_is_followed_when_operation_is_enabled() {
    let mut bench = Bench::new();
    bench.set(0x60FF, 60).run_ms(500);
    assert_eq!(bench.report().velocity_rpm, 0.0);
    bench.enable_in(3);
    let seconds = bench.seconds_until(1.0, LOOK, |report| report.velocity_rpm > 59.0);
    assert_within("seconds of the ramp of 500 ms", seconds, 0.4, 0.56);
}

/// 202Ah to 202Dh: coefficients of a speed observer, without units in the manual.
#[test]
fn no_coefficients_of_the_speed_observer_make_the_motor_turn_at_another_speed() {
    for coefficients in [
        [0, 0, 0, 1000],
        [1000, 0, 0, 1000],
        [0, 750, 0, 1000],
        [1000, 750, 0, 1000],
        [1000, 750, 350, 1000],
        [30000, 30000, 30000, 30000],
    ] {
        let mut bench = Bench::new();
        for (object, value) in (0x202A..).zip(coefficients) {
            bench.set(object, value);
        }
        bench.enable_in(3).set(0x60FF, 100).run_ms(2000);
        for _ in 0..20 {
            let speed = bench.run_ms(50).report().velocity_rpm;
            assert!((speed - 100.0).abs() < 5.0, "{coefficients:?}: {speed} r/min");
        }
    }
}
