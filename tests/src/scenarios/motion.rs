//! Profile position and profile velocity on the running drive: what CiA 402-2 has of them, and both makers' manuals.

use std::time::Duration;

use crate::bench::{Bench, assert_within};
use crate::power_states::{PowerSubject, ZltechSubject};

const LOOK: Duration = Duration::from_micros(500);

/// An object that clears the position reads 0 again, and the shaft stays where it is. 0 is invalid.
pub fn clearing_the_position_reads_zero_again_and_zeroes_the_position<S: ZltechSubject>() {
    for index in S::CLEARS_POSITION {
        let mut bench = Bench::<S>::new();
        bench.turn(60).set(0x60FF, 0).run_ms(1000).set(*index, 0);
        let (before, turned) = (bench.get(0x6064), bench.report().shaft_angle_rad);
        assert!(before > 1000, "{index:04X}h = 0 is invalid: {before}");
        bench.set(*index, 1).reads(0x6064, 0).reads(*index, 0).run_ms(100).reads(0x6064, 0);
        assert!((bench.report().shaft_angle_rad - turned).abs() < 0.01, "the numbers move, not the shaft");
    }
}

/// 6060h is taken at standstill; until then 6061h shows the old one, and the motor goes on.
pub fn another_mode_waits_until_the_motor_stands<S: PowerSubject>() {
    let mut bench = Bench::<S>::new();
    bench.turn(120).set(0x6060, 1).run_ms(100).reads(0x6060, 1).reads(0x6061, 3).goes_at(120);
    bench.set(0x60FF, 0).run_ms(1000).reads(0x6061, 1);
    let stands = bench.get(0x6064);
    bench.run_ms(1000).is_at(stands, 5);
    bench.set(0x6060, 0).run_ms(5).set(0x60FF, 120).set(0x6040, 0x1F).run_ms(100).reads(0x6061, 0).is_at(stands, 5);
}

/// CiA 402-2, clause 10.3: one set-point waits while another is under way; with the queue full a third is not taken.
pub fn a_second_set_point_waits_for_the_first_and_a_third_is_not_taken<S: PowerSubject>() {
    const ACKNOWLEDGED: u16 = 1 << 12;
    let mut bench = Bench::<S>::new();
    bench.enable_in(1);
    for target in [4000, 1000] {
        bench.set(0x607A, target * S::COUNTS).set(0x6040, 0x0F).set(0x6040, 0x1F);
    }
    bench.set(0x6040, 0x0F);
    assert_ne!(bench.statusword() & ACKNOWLEDGED, 0, "the queue is full");
    bench.set(0x607A, 9000 * S::COUNTS).set(0x6040, 0x1F).set(0x6040, 0x0F);
    let mut highest = 0;
    for _ in 0..4000 {
        highest = highest.max(bench.run_ms(1).report().position);
    }
    // A look each millisecond may miss the last count.
    assert!((highest - 4000 * S::COUNTS).abs() <= S::IN_POSITION.max(2), "{highest}");
    bench.is_at(1000 * S::COUNTS, S::IN_POSITION).shows(ACKNOWLEDGED, 0);
}

/// The speed that a motion from rest begins with has an object of its own; 6082h is the one that a move ends from. An S of
/// 80 r/min in 0.5 s moves by 0.1 r/min in its first 10 ms.
pub fn a_motion_begins_at_its_start_speed_and_a_move_ends_from_6082h<S: ZltechSubject>() {
    let mut bench = Bench::<S>::new();
    bench.set(S::START_SPEED, 40).set(0x6082, 30).set(0x6081, 120).set(0x6083, 500).set(0x6084, 500);
    bench.enable_in(1).move_by(12_000);
    let mut speeds = Vec::new();
    while bench.report().velocity_demand_rpm != Some(0.0) || speeds.is_empty() {
        bench.run(LOOK);
        speeds.extend(bench.report().velocity_demand_rpm.filter(|rpm| *rpm != 0.0));
    }
    assert_within("r/min at the beginning", speeds[0], 40.0, 40.2);
    assert_within("r/min at the end", speeds[speeds.len() - 1], 30.0, 30.2);
    assert_within("r/min in between", speeds.iter().copied().fold(0.0, f64::max), 119.9, 120.0);
    bench.run_ms(500).set(0x6060, 3).run_ms(5).set(0x60FF, -120);
    bench.seconds_until(0.01, LOOK, |report| report.velocity_demand_rpm.is_some_and(|rpm| rpm != 0.0));
    assert_within("r/min", bench.report().velocity_demand_rpm.expect("enabled"), -40.2, -40.0);
}

/// The way through 0 is two ramps. The answer to the write takes 0.5 ms of the first.
pub fn a_reversal_ramps_down_by_6084h_and_up_by_6083h<S: PowerSubject>() {
    let mut bench = Bench::<S>::new();
    S::set_ramp(&mut bench, 0x6083, 240);
    S::set_ramp(&mut bench, 0x6084, 480);
    bench.turn(120).set(0x60FF, -120);
    let down = bench.seconds_until(1.0, LOOK, |report| report.velocity_demand_rpm.is_some_and(|rpm| rpm <= 0.0));
    let up = bench.seconds_until(1.0, LOOK, |report| report.velocity_demand_rpm.is_some_and(|rpm| rpm < -120.0 + 1e-6));
    assert_within("seconds down", down, 0.477, 0.482);
    assert_within("seconds up", up, 0.237, 0.242);
    bench.run_ms(100).goes_at(-120);
}
