//! Overload: the rotor slips by whole electrical turns, and the drive does not know.

use ferrodrive_tests::zlim42c::figure;
use plant::stepper_motor::StepperMotorModel;

use crate::virtual_zlim42c::bench::{Bench, assert_within};

/// Pulses of four full steps with 4000 pulses a turn.
const FOUR_STEPS: i64 = 80;

/// Enabled with the highest current, also at standstill.
fn strong() -> Bench {
    at_the_highest_current(Bench::new())
}

fn at_the_highest_current(mut bench: Bench) -> Bench {
    bench.set(0x2005, 7).set(0x2007, 1).enable_in(1).run_ms(50);
    bench
}

/// Moves two turns while `disturb` does something to the shaft; pulses that the rotor lost.
fn lost_in_a_move(disturb: impl FnOnce(&mut Bench)) -> i64 {
    let mut bench = strong();
    bench.move_by(8000).run_ms(400);
    disturb(&mut bench);
    bench.run_ms(3000);
    let report = bench.report();
    assert_eq!((report.position, report.error_code), (8000, 0), "{report:?}");
    assert_eq!((bench.get(0x6064), bench.get(0x603F)), (8000, 0), "the drive knows nothing");
    assert_ne!(bench.statusword() & 1 << 10, 0, "target reached, as far as the drive knows");
    report.position - report.rotor_position.expect("the rotor's place is known here")
}

#[test]
fn a_blocked_rotor_loses_a_multiple_of_four_full_steps_and_the_drive_does_not_notice() {
    for blocked_ms in [30, 100, 333] {
        let lost = lost_in_a_move(|bench| {
            bench.set_rotor_locked(true).run_ms(blocked_ms);
            bench.set_rotor_locked(false);
        });
        // 120 r/min are 8 pulses a ms; the rotor falls in at one of the turns around where it is.
        let missed = 8 * blocked_ms as i64;
        assert_eq!(lost % FOUR_STEPS, 0, "{blocked_ms} ms: {lost} pulses");
        assert!((missed - lost).abs() <= 4 * FOUR_STEPS && lost > 0, "{blocked_ms} ms: {lost} of {missed} pulses");
    }
}

#[test]
fn an_overloaded_rotor_loses_a_multiple_of_four_full_steps_and_a_pushed_one_gains_it() {
    // A push of some ms: a longer one would speed the rotor up until its voltage trips the drive.
    for torque_nm in [0.6, -0.6] {
        let losses = [8, 10, 12].map(|ms| {
            lost_in_a_move(|bench| {
                bench.set_load_inertia(5e-5).set_load_torque(torque_nm).run_ms(ms).set_load_torque(0.0);
            })
        });
        assert!(losses.iter().all(|lost| lost % FOUR_STEPS == 0), "{torque_nm} N m: {losses:?}");
        let its_way = |lost: &i64| *lost != 0 && (*lost > 0) == (torque_nm > 0.0);
        assert!(losses.iter().any(its_way), "{torque_nm} N m: {losses:?}");
    }
}

/// 2.1, at the highest current, with a load that grows slowly: below it the rotor stays within its step, above it slips.
#[test]
fn each_length_holds_95_per_cent_of_the_holding_torque_of_the_manual_and_slips_at_110() {
    for (new, model) in [(Bench::new as fn() -> Bench, "zlim42c"), (Bench::long, "zlim42c-82")] {
        let holding_nm = figure("model", model, "holding_torque");
        for (share, holds) in [(0.95, true), (1.1, false)] {
            let mut bench = at_the_highest_current(new());
            bench.load_up_to(share * holding_nm, 40, 50);
            let away = bench.report().rotor_position.expect("known here").abs();
            assert_eq!(away < FOUR_STEPS / 2, holds, "{model}, {share}: {away} pulses");
        }
    }
}

#[test]
fn a_load_below_it_turns_the_rotor_by_the_angle_of_its_sine() {
    // T = K I sin(x) + detent sin(4x), x the electrical angle that the rotor lags by; dry friction may hold the rest.
    let model = StepperMotorModel::ZLIM42_C_70;
    for torque_nm in [0.1, 0.25, -0.35] {
        let mut bench = strong();
        bench.set_load_torque(torque_nm).run_ms(3000);
        let report = bench.report();
        let lag = -report.shaft_angle_rad * f64::from(model.stepper.teeth);
        let held_nm = model.stepper.torque_constant_nm_a() * report.current_a * lag.sin()
            + model.stepper.detent_nm * (4.0 * lag).sin();
        assert_within("N m", held_nm - torque_nm, -model.rotor.coulomb_nm, model.rotor.coulomb_nm);
    }
}

#[test]
fn a_rotor_pulled_while_it_is_held_falls_in_again_whole_turns_of_the_field_away() {
    for torque_nm in [0.8, -0.8] {
        let mut bench = strong();
        bench.set_load_inertia(5e-5).set_load_torque(torque_nm).run_ms(7).set_load_torque(0.0).run_ms(3000);
        let report = bench.report();
        let pulled = report.rotor_position.expect("known here");
        assert_eq!((pulled % FOUR_STEPS, pulled.signum() as f64), (0, -torque_nm.signum()), "{pulled} pulses");
        assert_eq!((bench.get(0x6064), bench.get(0x606C), bench.get(0x603F)), (0, 0, 0), "the drive knows nothing");
        // The next move starts from where the drive believes to be: the loss stays.
        bench.move_by(4000).run_ms(1500);
        let report = bench.report();
        assert_eq!((report.position, report.rotor_position), (4000, Some(4000 + pulled)));
    }
}

#[test]
fn a_load_that_is_carried_slowly_is_lost_at_speed() {
    // With 24 V the pull-out torque is 0.48 N m at 60 r/min, and by its closed form a fifth of it at 2400 r/min.
    let model = StepperMotorModel::ZLIM42_C_70.stepper;
    let fast_rad_s = 2400.0 * std::f64::consts::PI / 30.0;
    assert_within("N m at 2400 r/min", model.pull_out_nm(24.0, model.resistance_ohm, fast_rad_s), 0.05, 0.15);
    // The fast rotor is let go after some ms: a load that drives it would feed the bus until the drive trips.
    for (rpm, load_ms, keeps) in [(60, 500, true), (2400, 5, false)] {
        let mut bench = strong();
        bench.set(0x6060, 3).set(0x6083, 2000).set(0x60FF, rpm).run_ms(2500);
        assert_within("r/min", bench.report().velocity_rpm, 0.5 * rpm as f64, 1.5 * rpm as f64);
        bench.set_load_torque(0.25).run_ms(load_ms).set_load_torque(0.0).run_ms(500);
        let report = bench.report();
        let lost = report.position - report.rotor_position.expect("known here");
        assert_eq!(lost.abs() < FOUR_STEPS, keeps, "{rpm} r/min: {lost} pulses, {report:?}");
        assert_eq!((bench.get(0x606C), bench.get(0x603F)), (rpm, 0), "the drive knows nothing");
    }
}

#[test]
fn a_higher_setting_of_2005h_carries_a_load_that_a_lower_one_loses() {
    // K = 0.48 N m / 2.2 A: 0.8 A give 0.17 N m, 2.2 A give 0.48 N m.
    for (setting, keeps) in [(2, false), (7, true)] {
        let mut bench = Bench::new();
        bench.set(0x2005, setting).set(0x2007, 1).enable_in(1).run_ms(50);
        bench.move_by(4000).run_ms(300).load_up_to(0.3, 10, 10).run_ms(1500);
        bench.set_load_torque(0.0).run_ms(1500);
        let report = bench.report();
        let lost = report.position - report.rotor_position.expect("known here");
        assert_eq!(lost < FOUR_STEPS / 2, keeps, "2005h = {setting}: {lost} pulses");
    }
}

#[test]
fn half_the_current_at_rest_holds_half_the_load() {
    let mut bench = strong();
    bench.set(0x2007, 0).run_ms(50);
    bench.set_load_torque(0.35).run_ms(500);
    let report = bench.report();
    assert!(report.rotor_position.expect("known here").abs() >= FOUR_STEPS, "{report:?}");
}

#[test]
fn a_free_rotor_turns_under_its_load_and_the_position_stays() {
    let mut bench = Bench::new();
    bench.set_load_torque(-0.1).run_ms(200).reads(0x6064, 0);
    assert!(bench.report().shaft_angle_rad > 1.0, "6040h = 0: free but for the detent");
}
