//! Pulses, encoder following and duty-cycle speed.

use crate::virtual_mjoint::bench::{Bench, TURN};

#[test]
fn as_delivered_8192_pulses_turn_the_motor_once_and_the_host_takes_it_away() {
    let mut bench = Bench::new();
    bench.set(0x6083, 60_000).world("1 pulses 8192 10000").run_ms(1500).is_at(TURN, 12);
    bench.world("1 pulses -4096 5000").run_ms(1500).is_at(TURN / 2, 12);
    bench.set(0x6040, 0x0F).world("1 pulses 8192 10000").run_ms(1500);
    assert!((bench.position() - TURN / 2).abs() <= 12, "bit 0: pulses have no effect");
}

#[test]
fn pulses_are_geared_exactly() {
    let mut bench = Bench::new();
    bench.set(0x6083, 60_000);
    // 3200 pulses a turn (256 : 25).
    bench.set(0x260A, 256).set(0x260B, 25).world("1 pulses 16000 8000").run_ms(3000).is_at(5 * TURN, 12);
}

#[test]
fn the_pulse_frequency_is_the_speed_and_an_internal_ramp_lags_behind_it() {
    // 1000 r/min are 1000/60 * 8192 Hz.
    let lag = |acceleration: i64| {
        let mut bench = Bench::new();
        bench.set(0x6083, acceleration).world("1 pulses 100000 136533").run_ms(500).turns_about(1000.0, 15.0);
        let sent = 4 * (136_533 / 2);
        let lag = sent - bench.report().position;
        bench.run_ms(2000).is_at(400_000, 30);
        lag
    };
    let (with_ramp, without) = (lag(5000), lag(60_000));
    assert!(with_ramp > without + 10_000, "{with_ramp} {without}");
    // "Zero hysteresis": no more than the two supervision periods, 546 counts, in which pulses are counted and followed.
    assert!((0..=546).contains(&without), "{without}");
}

#[test]
fn dir_polarity_turns_the_direction_around() {
    let mut bench = Bench::new();
    bench.set(0x2609, 1).world("1 pulses 4096 10000").run_ms(1000).is_at(-TURN / 2, 30);
}

#[test]
fn an_encoder_on_pu_and_dir_is_followed_after_function_2_is_powered_up() {
    let mut bench = Bench::new();
    bench.set(0x2619, 2).save();
    bench.world("1 quadrature 4096 4000").run_ms(1500);
    assert!(bench.position().abs() < 2, "not before the next power-on");
    bench.power_cycle();
    bench.world("1 quadrature 4096 4000").run_ms(2000).is_at(TURN / 2, 30);
    bench.world("1 quadrature -4096 4000").run_ms(2000).is_at(0, 30);
}

#[test]
fn the_duty_cycle_is_a_speed_after_function_1_or_3() {
    for function in [1, 3] {
        let mut bench = Bench::new();
        bench.set(0x2619, function).save().power_cycle();
        for (percent, rpm) in [(5, 0.0), (50, 500.0), (90, 1000.0), (30, 250.0), (10, 0.0)] {
            bench.world(&format!("1 duty {percent}")).run_ms(800);
            let speed = bench.report().velocity_rpm;
            assert!((speed - rpm).abs() < 8.0, "{percent} %: {speed}");
        }
        bench.world("1 input DIR 1").world("1 duty 50").run_ms(800).turns_about(-500.0, 8.0);
    }
}

#[test]
fn zo_conducts_below_zero_and_60fdh_shows_the_pins() {
    let mut bench = Bench::new();
    let zo = |bench: &mut Bench| bench.report().outputs.iter().find(|(name, _)| *name == "ZO").expect("ZO").1;
    bench.set(0x6040, 0x2F).set(0x607A, 2000).reaches(1000);
    assert!(!zo(&mut bench));
    bench.set(0x607A, -2000).reaches(1000);
    assert!(zo(&mut bench));
    bench.world("1 input PU 1").run_ms(3).reads(0x60FD, 1);
    bench.world("1 input DIR 1").run_ms(3).reads(0x60FD, 3);
}

#[test]
fn no_pulse_is_lost_at_the_highest_frequency() {
    // "Maximum input pulse frequency 500 KHz": 1 : 1, that is 916 r/min.
    let mut bench = Bench::new();
    bench.set(0x6083, 60_000).set(0x260A, 1).set(0x260B, 1).world("1 pulses 400000 500000").run_ms(600);
    bench.turns_about(915.5, 15.0);
    bench.run_ms(1000).is_at(400_000, 12);
}

#[test]
fn an_internal_ramp_makes_a_sudden_pulse_frequency_gentle() {
    // 1000 r/min at once; with 2000 (r/min)/s the motor takes half a second to it.
    let speed_after_100_ms = |acceleration: i64| {
        let mut bench = Bench::new();
        bench.set(0x6083, acceleration).world("1 pulses 1000000 136533").run_ms(100);
        bench.report().velocity_rpm
    };
    let (gentle, at_once) = (speed_after_100_ms(2000), speed_after_100_ms(60_000));
    assert!((gentle - 200.0).abs() < 25.0, "{gentle}");
    assert!((at_once - 1000.0).abs() < 30.0, "{at_once}");
}
