//! Profile position and profile velocity: the S-shaped ramps by their closed forms, the speed limit of 200 kHz, halt and
//! quick stop.
//!
//! With 4000 pulses a turn 60 r/min are 4000 pulses/s. A ramp covers the mean of its two speeds times its time.

use std::time::Duration;

use crate::virtual_zlim42c::bench::{Bench, assert_within};

const LOOK: Duration = Duration::from_micros(500);
const REACHED: u16 = 1 << 10;
const ACKNOWLEDGED: u16 = 1 << 12;
const RUNNING: u16 = 1 << 14;
const IN_POSITION: u16 = 1 << 15;

/// Pulses/s in one r/min.
const PULSES_S: f64 = 4000.0 / 60.0;

/// Seconds from the set-point until the commanded velocity is 0 again.
fn duration_of(bench: &mut Bench, pulses: i64) -> f64 {
    bench.move_by(pulses);
    bench.seconds_until(10.0, LOOK, |report| report.velocity_demand_rpm != Some(0.0));
    bench.seconds_until(10.0, LOOK, |report| report.velocity_demand_rpm == Some(0.0))
}

#[test]
fn a_move_takes_its_two_ramps_and_the_plateau() {
    let mut bench = Bench::new();
    bench.enable_in(1).set(0x6081, 60);
    let (start, top, end) = (5.0 * PULSES_S, 60.0 * PULSES_S, 10.0 * PULSES_S);
    for (speeding_ms, slowing_ms) in [(100, 100), (200, 50), (0, 400)] {
        bench.set(0x6083, speeding_ms).set(0x6084, slowing_ms);
        let (speeding, slowing) = (speeding_ms as f64 * 1e-3, slowing_ms as f64 * 1e-3);
        let ramps = 0.5 * (start + top) * speeding + 0.5 * (top + end) * slowing;
        let expected = speeding + slowing + (3200.0 - ramps) / top;
        let taken = duration_of(&mut bench, 3200);
        assert_within("seconds", taken, expected - 0.003, expected + 0.003);
    }
    bench.reads(0x6064, 9600);
}

#[test]
fn a_move_too_short_for_its_speed_turns_back_at_a_lower_peak() {
    // Each ramp keeps its pace p = T / change of speed: d = (v² - v0²) pa / 2 + (v² - ve²) pd / 2 gives the peak.
    let mut bench = Bench::new();
    bench.enable_in(1).set(0x6081, 60);
    let (start, top, end, ramp) = (5.0 * PULSES_S, 60.0 * PULSES_S, 10.0 * PULSES_S, 0.1);
    let (up, down) = (ramp / (top - start), ramp / (top - end));
    for pulses in [40, 100, 200, 400] {
        let squares = 2.0 * f64::from(pulses) + start * start * up + end * end * down;
        let peak = (squares / (up + down)).sqrt();
        let expected = (peak - start) * up + (peak - end) * down;
        let taken = duration_of(&mut bench, i64::from(pulses));
        assert_within("seconds", taken, expected - 0.003, expected + 0.003);
    }
    bench.reads(0x6064, 740);
}

#[test]
fn half_way_in_time_an_s_shaped_ramp_is_half_way_in_speed() {
    let mut bench = Bench::new();
    bench.set(0x6083, 400).enable_in(3).set(0x60FF, 300).run_ms(200);
    let half = bench.get(0x606C);
    assert!((150..=158).contains(&half), "{half} r/min, expected (5 + 300) / 2 and 1.5 r/min a ms");
    bench.run_ms(210).reads(0x606C, 300).reads(0x2002, 300).shows(REACHED | ACKNOWLEDGED | RUNNING, REACHED | RUNNING);
    // The way of the ramp: the mean of both speeds. 10 ms and the talk at 300 r/min come on top.
    let way = bench.get(0x6064) as f64;
    let ramp = 0.5 * 305.0 * PULSES_S * 0.4;
    assert_within("pulses", way, ramp, ramp + 300.0 * PULSES_S * 0.02);
    bench.set(0x60FF, 0).run_ms(120);
    assert_eq!(bench.get(0x606C), 0, "6084h: 100 ms");
    assert_eq!(bench.statusword() & (REACHED | ACKNOWLEDGED | RUNNING), REACHED | ACKNOWLEDGED, "bit 12: speed is 0");
}

#[test]
fn no_speed_is_above_200_000_steps_a_second() {
    // 2.1: 468 r/min at 25600 pulses a turn, and 1875 r/min at 6400.
    for (setting, pulses_per_turn) in [(7, 25_600.0_f64), (5, 6_400.0)] {
        let mut bench = Bench::new();
        bench.set(0x2006, setting).set(0x6083, 1000).enable_in(3).set(0x60FF, 3000).run_ms(1100);
        bench.reads(0x606C, (200_000.0 * 60.0 / pulses_per_turn).round() as i64);
        let before = bench.report().position;
        bench.run_ms(1000);
        assert_eq!(bench.report().position - before, 200_000);
        assert_ne!(bench.statusword() & REACHED, 0, "the speed that can be is reached");
    }
}

#[test]
fn a_motor_without_load_follows_to_3000_rpm_and_back_without_losing_a_step() {
    // 6081h and 60FFh allow 3000 r/min; there the pull-out torque with 24 V is still twice the friction.
    for supply_v in [24.0, 30.0] {
        let mut bench = Bench::new();
        bench.set_supply(supply_v).set(0x6083, 1000).set(0x6084, 2000).enable_in(3).set(0x60FF, 3000).run_ms(2000);
        assert_within("r/min", bench.report().velocity_rpm, 2800.0, 3200.0);
        bench.set(0x60FF, 0).run_ms(2500);
        let report = bench.report();
        let away = report.position - report.rotor_position.expect("known here");
        // Dry friction may hold it some pulses off; four full steps are 80.
        assert!(away.abs() <= 4 && report.error_code == 0, "{supply_v} V: {away} pulses, {report:?}");
    }
}

#[test]
fn every_microstep_setting_makes_one_turn_of_its_pulses() {
    use ferrodrive_tests::zlim42c::figure;
    for setting in 0..16 {
        let mut bench = Bench::new();
        bench.set(0x2006, setting).enable_in(1);
        let pulses = figure("microstep", &setting.to_string(), "pulses_per_turn") as i64;
        bench.move_by(pulses).run_ms(1200);
        let report = bench.report();
        assert_eq!(report.position, pulses, "setting {setting}");
        assert_within("turns", report.shaft_angle_rad / std::f64::consts::TAU, 0.999, 1.001);
    }
}

#[test]
fn a_microstep_setting_written_while_energised_waits_and_other_settings_do_not() {
    let mut bench = Bench::new();
    bench.enable_in(1).set(0x2006, 0).set(0x6081, 30).move_by(4000).run_ms(500).reads(0x606C, 30);
    bench.run_ms(2500);
    assert_within("turns", bench.report().shaft_angle_rad / std::f64::consts::TAU, 0.999, 1.001);
    bench.set(0x6040, 0).run_ms(5);
    bench.enable().move_by(200).run_ms(3000);
    assert_within("turns", bench.report().shaft_angle_rad / std::f64::consts::TAU, 1.999, 2.001);
}

#[test]
fn bits_10_12_and_15_follow_a_set_point() {
    let mut bench = Bench::new();
    bench.enable_in(1).run_ms(10);
    assert_eq!(bench.statusword() & (REACHED | ACKNOWLEDGED | IN_POSITION), REACHED | IN_POSITION, "nothing to do");
    bench.move_by(4000).shows(REACHED | ACKNOWLEDGED | IN_POSITION, ACKNOWLEDGED);
    bench.set(0x6040, 0x0F).run_ms(100).shows(REACHED | ACKNOWLEDGED | IN_POSITION | RUNNING, RUNNING);
    bench.run_ms(1000).shows(REACHED | ACKNOWLEDGED | IN_POSITION | RUNNING, REACHED | IN_POSITION);
}

#[test]
fn a_move_at_the_step_rate_limit_takes_its_closed_form() {
    // 6081h = 3000 r/min at 25600 pulses a turn: 200 kHz, 468.75 r/min, is what there is.
    let mut bench = Bench::new();
    bench.set(0x2006, 7).set(0x6081, 3000).enable_in(1);
    let pulses_s = 25_600.0 / 60.0;
    let (start, top, end) = (5.0 * pulses_s, 200_000.0, 10.0 * pulses_s);
    let ramps = 0.5 * (start + top) * 0.1 + 0.5 * (top + end) * 0.1;
    let expected = 0.2 + (256_000.0 - ramps) / top;
    let taken = duration_of(&mut bench, 256_000);
    assert_within("seconds", taken, expected - 0.003, expected + 0.003);
    bench.run_ms(2000);
    let rotor = bench.report().rotor_position.expect("known here");
    assert!((rotor - 256_000).abs() <= 16, "{rotor}: dry friction may hold it some pulses off");
}

#[test]
fn clearing_the_position_in_motion_changes_the_numbers_and_not_the_way() {
    let mut bench = Bench::new();
    bench.enable_in(1).move_by(8000).run_ms(400);
    bench.set(0x2012, 1).run_ms(2000);
    let turns = bench.report().shaft_angle_rad / std::f64::consts::TAU;
    assert_within("turns", turns, 1.999, 2.001);
    bench.is_at(5950, 1950);
    // A relative move goes on from there, an absolute one counts from the new zero.
    let here = bench.get(0x6064);
    bench.set(0x6040, 0x0F).move_by(400).run_ms(500).reads(0x6064, here + 400);
}

/// Speeds of the rotor at a constant commanded one, r/min about it.
fn swings(mut bench: Bench, setting: i64, rpm: i64) -> Vec<f64> {
    bench.set(0x2006, setting).enable_in(3).set(0x60FF, rpm).run_ms(1000);
    let mut look = |_| {
        bench.run(Duration::from_micros(250));
        bench.report().velocity_rpm - rpm as f64
    };
    (0..4000).map(&mut look).collect()
}

#[test]
fn at_the_speeds_of_the_manuals_examples_the_motor_turns_smoothly_with_the_factory_settings() {
    // 1.2: ultra-low vibration. 5.3.4, 5.3.5 and 5.3.6 have 60 and 120 r/min; the detent meets the rotor's resonance at 65
    // (70 mm) and 90 (82 mm).
    for new in [Bench::new, Bench::long] {
        for rpm in [20, 40, 60, 65, 70, 80, 90, 120, 300] {
            let ripple = swings(new(), 10, rpm).into_iter().fold(0.0, |most: f64, swing| most.max(swing.abs()));
            assert!(ripple < 0.2 * rpm as f64, "{rpm} r/min: {ripple} r/min");
        }
    }
}

#[test]
fn full_steps_shake_the_rotor_at_its_resonance_far_more_than_fine_ones() {
    use plant::stepper_motor::StepperMotorModel;
    // The rotor rings at the root of stiffness over inertia: where full steps come as often, at (f / 200) turns a second.
    let model = StepperMotorModel::ZLIM42_C_70;
    let ringing_hz = (model.stepper.stiffness_nm_rad(1.2) / model.rotor.inertia_kg_m2).sqrt() / std::f64::consts::TAU;
    let rpm = (ringing_hz / 200.0 * 60.0).round() as i64;
    let shaking = |setting| {
        let speeds = swings(Bench::new(), setting, rpm);
        (speeds.iter().map(|speed| speed * speed).sum::<f64>() / speeds.len() as f64).sqrt()
    };
    let (full, fine) = (shaking(0), shaking(7));
    assert!(full > 10.0 * fine && full > rpm as f64, "{full} and {fine} r/min about {rpm}");
}
