//! Position and speed mode, and the loops behind them.

use drives::mjoint::Model;

use crate::virtual_mjoint::bench::{Bench, MODELS, TURN};

#[test]
fn with_2f_each_write_of_the_target_starts_and_with_0f_it_only_waits() {
    let mut bench = Bench::new();
    bench.set(0x6040, 0x0F).set(0x607A, 2 * TURN).run_ms(300);
    assert!(bench.position().abs() < 5, "only cached");
    bench.set(0x6040, 0x2F).run_ms(300);
    assert!(bench.position().abs() < 5, "bit 5 by itself starts nothing");
    bench.set(0x607A, 2 * TURN).shows(0xFFFF, 0x0037);
    bench.reaches(2000);
    bench.set(0x607A, TURN).reaches(2000).is_at(TURN, 30);
}

#[test]
fn bit_4_acts_on_each_write_and_clears_itself_and_bit_6_counts_from_the_target() {
    let mut bench = Bench::new();
    bench.set(0x607A, 10_000).set(0x6040, 0x4F);
    for turn in 1..=3 {
        bench.set(0x6040, 0x5F).reads(0x6040, 0x4F).shows(0xFFFF, 0x0037);
        bench.reaches(2000).is_at(10_000 * turn, 30);
    }
    bench.set(0x6040, 0x5F).set(0x6040, 0x5F).reaches(2000).is_at(50_000, 30);
}

#[test]
fn rpdo_1_may_change_the_mode_and_start_a_move_in_one_frame() {
    let mut bench = Bench::new();
    bench.send("401#0F000300000000").send("201#1F000110270000").reaches(1000).is_at(10_000, 30).reads(0x6040, 0x0F);
}

#[test]
fn a_target_that_is_sent_again_and_again_is_reached_in_the_same_time() {
    let time = |again: bool| {
        let mut bench = Bench::new();
        bench.set(0x6040, 0x2F).set(0x607A, 10 * TURN);
        let from = bench.world.now();
        while bench.report().statusword.is_some_and(|word| word & 0x0400 == 0) {
            if again {
                bench.send("201#2F000100000500");
            }
            bench.run_ms(1);
        }
        bench.is_at(10 * TURN, 30);
        bench.world.now().as_secs_f64() - from.as_secs_f64()
    };
    assert!((time(true) - time(false)).abs() < 0.02);
}

#[test]
fn the_incremental_position_moves_at_once() {
    let mut bench = Bench::new();
    bench.set(0x6040, 0x0F).set(0x260C, -5000).run_ms(100);
    bench.set(0x260C, -5000).reaches(2000).is_at(-10_000, 30);
}

#[test]
fn a_move_takes_the_time_of_its_trapezoid_and_no_ramp_at_60000() {
    // 10 turns at 600 r/min are a second; the ramps add speed over acceleration.
    for (acceleration, expected_ms) in [(2_000, 1300), (20_000, 1030), (60_000, 1000)] {
        let mut bench = Bench::new();
        bench.set(0x6081, 600).set(0x6083, acceleration).set(0x6040, 0x2F).set(0x607A, 10 * TURN);
        let from = bench.world.now();
        bench.reaches(4000);
        let ms = (bench.world.now().as_secs_f64() - from.as_secs_f64()) * 1e3;
        assert!((ms - f64::from(expected_ms)).abs() < 60.0, "{acceleration}: {ms} ms");
    }
}

#[test]
fn halt_stops_within_milliseconds_and_holds_and_the_move_goes_on_afterwards() {
    let mut bench = Bench::new();
    bench.set(0x6081, 1000).set(0x6040, 0x2F).set(0x607A, 30 * TURN).run_ms(500);
    bench.set(0x6040, 0x012F);
    // 1000 r/min at the limit of 10 A: 0.69e-4 kg m² * 105 rad/s / (10 A / 3.5 A * 1 N m) is 3 ms.
    bench.run_ms(40);
    assert!(bench.report().velocity_rpm.abs() < 10.0, "{}", bench.report().velocity_rpm);
    bench.run_ms(200);
    let held = bench.position();
    bench.world("1 load torque 10").run_ms(500);
    assert!((bench.position() - held).abs() < 200, "self-locked: {}", bench.position() - held);
    bench.shows(0xFFFF, 0x0437);
    bench.world("1 load torque 0").set(0x6040, 0x2F).shows(0xFFFF, 0x0037);
    bench.reaches(4000).is_at(30 * TURN, 30);
}

#[test]
fn quick_stop_ends_a_move_and_no_voltage_frees_the_shaft() {
    let mut bench = Bench::new();
    bench.set(0x6040, 0x2F).set(0x607A, 30 * TURN).run_ms(300);
    bench.set(0x6040, 0x0B).run_ms(200).shows(0xFFFF, 0x0417);
    let held = bench.position();
    bench.set(0x6040, 0x0F).run_ms(300);
    assert!((bench.position() - held).abs() <= 5, "the move is over");
    bench.set(0x6040, 0).shows(0xFFFF, 0x0404);
    bench.world("1 load torque -10").run_ms(100);
    assert!(bench.position() > held + 1000, "free: the load turns it");
    bench.set(0x2601, 0).set(0x6040, 0x0F).shows(0xFFFF, 0x0423);
    bench.world("1 load torque 0").set(0x2601, 1);
    assert_eq!(bench.statusword() & !0x0400, 0x0037);
}

#[test]
fn the_load_is_felt_through_the_gear() {
    // 20 N m at the output of a ratio of 50, and the gear's losses: 0.4 N m at the motor and some more.
    let mut bench = Bench::new();
    bench.turn(500).run_ms(500);
    let free = bench.report().current_a;
    bench.world("1 load torque 20").run_ms(500);
    let more = bench.report().current_a - free;
    // The motor gives 1 N m at 3.5 A.
    let least = 20.0 / 50.0 * 3.5;
    assert!((least..1.6 * least).contains(&more), "{more} A more, at least {least} A");
    bench.turns_about(500.0, 5.0);
}

#[test]
fn a_speed_step_is_well_damped_on_every_model_bare_and_loaded() {
    for model in MODELS {
        for inertia_kg_m2 in [0.0, 0.2] {
            let mut bench = Bench::of(1, model);
            bench
                .world(&format!("1 load inertia {inertia_kg_m2}"))
                .set(0x6083, 60_000)
                .set(0x6060, 3)
                .set(0x6040, 0x0F);
            bench.set(0x60FF, 300);
            let mut most: f64 = 0.0;
            for _ in 0..600 {
                bench.run_ms(1);
                most = most.max(bench.report().velocity_rpm);
            }
            let speed = bench.report().velocity_rpm;
            assert!((speed - 300.0).abs() < 5.0, "{} with {inertia_kg_m2}: {speed}", model.name);
            assert!(most < 300.0 * 1.35, "{} with {inertia_kg_m2}: overshoot to {most}", model.name);
        }
    }
}

#[test]
fn the_gains_of_60f9h_and_60fbh_are_the_loops_own() {
    // Yielding under a sudden load: with an integral the position comes back; a stiffer loop yields less.
    let yields = |velocity_kp: i64, position_kp: i64| {
        let mut bench = Bench::new();
        bench.set((0x60F9, 1), velocity_kp).set((0x60FB, 1), position_kp).set(0x6040, 0x0F).run_ms(50);
        bench.world("1 load torque 15");
        let mut most = 0;
        for _ in 0..300 {
            bench.run_ms(1);
            most = most.max(bench.report().position.abs());
        }
        most
    };
    let delivered = yields(3000, 3000);
    assert!(yields(1000, 3000) > delivered * 3 / 2, "a softer velocity loop");
    assert!(yields(3000, 1000) > delivered, "a softer position loop");
    let integral = |time_ms: i64| {
        let mut bench = Bench::new();
        bench.set((0x60F9, 2), time_ms).set(0x6040, 0x0F).run_ms(50);
        bench.world("1 load torque 15").run_ms(2000);
        bench.position().abs()
    };
    assert!(integral(30) <= 10 && integral(2000) > 50, "2000 cancels integration");
}

#[test]
fn targets_faster_than_the_motor_are_held_to_its_highest_speed() {
    let mut bench = Bench::of(1, &Model::M8025E25B50);
    bench
        .world("1 supply 48")
        .set(0x6060, 3)
        .set(0x6040, 0x0F)
        .set(0x60FF, 3000)
        .run_ms(1000)
        .turns_about(1500.0, 15.0);
    bench.shows(0xFFFF, 0x0437);
}

#[test]
fn actual_values_are_in_the_manuals_units() {
    let mut bench = Bench::new();
    bench.turn(-600).world("1 load torque -10").run_ms(500);
    let report = bench.report();
    assert!((bench.get(0x606C) + 6000).abs() < 60);
    assert!((bench.get(0x6079) as f64 / 327.0 - report.supply_v).abs() < 0.1);
    let current = bench.get(0x6078) as f64 / 2000.0;
    assert!((current - report.current_a.abs()).abs() < 0.2, "{current}, {}", report.current_a);
    let pwm = bench.get(0x2613);
    assert!(pwm < -3000, "{pwm}");
    bench.send("401#0F0003A8FDFFFF");
    let heard = bench.heard();
    let tpdo = heard.iter().find(|frame| frame.starts_with("381#")).expect("TPDO3");
    let speed = u32::from_str_radix(&tpdo[4..12], 16).expect("a number").swap_bytes() as i32;
    assert!((speed + 600).abs() <= 5, "{speed}");
}

#[test]
fn the_feed_forward_of_60fbh_gives_the_current_that_a_rising_back_emf_would_take() {
    // At 5 A r.m.s. the speed rises by 1.43 N m / 0.69e-4 kg m², and the back-emf by 0.135 V·s times that, 2800 V/s. A current
    // loop of 3000 rad/s on 0.44 ohm is behind such a ramp by 2800 / (0.44 * 3000), 2.1 A of an amplitude of 7.1.
    let time_to_1000_rpm = |feed_forward: i64| {
        let mut bench = Bench::new();
        bench.set((0x60FB, 2), feed_forward).set(0x261D, 5005).set(0x6083, 60_000).set(0x6060, 3).set(0x6040, 0x0F);
        bench.set(0x60FF, 1500);
        bench.seconds_until(0.1, std::time::Duration::from_micros(50), |report| report.velocity_rpm > 1000.0)
    };
    // 12 V of the motor's own 14.1 V at 1000 r/min.
    let gained = time_to_1000_rpm(0) / time_to_1000_rpm(3924);
    assert!((1.1..1.42).contains(&gained), "{gained}");
}
