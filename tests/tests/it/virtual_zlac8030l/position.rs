//! Profile position (manual 4.2, 4.3): the worked examples, times, the set-point handshake, and the lag fault.

use std::time::Duration;

use crate::virtual_zlac8030l::bench::{Bench, assert_within};
use crate::virtual_zlac8030l::wheel::COUNTS_PER_TURN;

const LOOK: Duration = Duration::from_millis(1);
const RELATIVE: i64 = 0x40;
const IMMEDIATELY: i64 = 0x20;
const REACHED: u16 = 1 << 10;
const IN_PLACE: u16 = 1 << 13;

/// 2002h as delivered: how far a drive that is in place may be off.
const IN_PLACE_COUNTS: i64 = 30;

fn ready() -> Bench {
    let mut bench = Bench::new();
    bench.enable_in(1).set(0x6081, 60);
    bench
}

/// Target, then the edge of bit 4 as 4.2 and 4.3 write it: with the bit down and with the bit up.
fn start(bench: &mut Bench, target: i64, bits: i64) {
    bench.set(0x607A, target).set(0x6040, 0x0F | bits).set(0x6040, 0x1F | bits);
}

#[track_caller]
fn assert_at(bench: &mut Bench, expected: i64) {
    let position = bench.get(0x6064);
    assert!((position - expected).abs() <= IN_PLACE_COUNTS, "at {position}, expected {expected}");
    let statusword = bench.statusword();
    assert_eq!(statusword & (REACHED | IN_PLACE), REACHED | IN_PLACE, "{statusword:04X}h");
    let turned = bench.report().shaft_angle_rad / core::f64::consts::TAU * COUNTS_PER_TURN;
    assert_within("counts that the shaft truly turned", turned, expected as f64 - 31.0, expected as f64 + 31.0);
}

/// At 60 r/min, 4096 counts/s, from and to 1 r/min in 500 ms each.
fn duration_s(distance: f64) -> f64 {
    let (speed, edge) = (COUNTS_PER_TURN, COUNTS_PER_TURN / 60.0);
    let ramps = 2.0 * 0.5 * (speed + edge) / 2.0;
    1.0 + (distance - ramps) / speed
}

/// A set-point, its bits, the time until the next one, and where it has led by then; `None` where it is on the way.
type Step = (i64, i64, u64, Option<i64>);

#[test]
fn set_points_lead_where_they_say_at_the_speed_of_6081h_and_without_overshoot() {
    let stories: &[(&str, &[Step])] = &[
        ("4.2", &[(32_000, RELATIVE, 10_000, Some(32_000)), (-32_000, RELATIVE, 10_000, Some(0))]),
        ("4.3", &[(32_000, 0, 10_000, Some(32_000)), (-32_000, 0, 18_000, Some(-32_000))]),
        ("bit 5 replaces the one under way", &[(40_000, 0, 1000, None), (8192, IMMEDIATELY, 4000, Some(8192))]),
        ("in one breath", &[(4096, RELATIVE, 0, None), (4096, RELATIVE, 5000, Some(8192))]),
        // 60F2h is absent, so its default holds: relative to the preceding target (CiA 402-2).
        (
            "a relative one that replaces a move counts from that move's target",
            &[(8192, RELATIVE, 1000, None), (4096, RELATIVE | IMMEDIATELY, 4000, Some(12_288))],
        ),
    ];
    for (story, steps) in stories {
        let mut bench = ready();
        for (target, bits, ms, expected) in *steps {
            let from = bench.report().position;
            start(&mut bench, *target, *bits);
            let to = expected.unwrap_or(from + 40_000);
            let mut fastest = 0.0_f64;
            for _ in 0..*ms {
                let report = bench.run(LOOK).report();
                fastest = fastest.max(report.velocity_rpm.abs());
                let off_the_way = report.position < from.min(to) - 10 || report.position > from.max(to) + 10;
                assert!(!off_the_way, "{story}: {} on the way from {from} to {to}", report.position);
            }
            assert!(*ms == 0 || (59.0..61.5).contains(&fastest), "{story}: {fastest} r/min");
            if let Some(expected) = expected {
                assert_at(&mut bench, *expected);
            }
        }
    }
}

#[test]
fn a_move_takes_the_time_of_its_closed_form() {
    let mut bench = ready();
    start(&mut bench, 32_000, RELATIVE);
    let end = bench.seconds_until(12.0, LOOK, |report| report.position >= 32_000 - 2);
    assert_within("seconds of the move", end, duration_s(32_000.0) - 0.05, duration_s(32_000.0) + 0.05);
}

#[test]
fn nothing_moves_without_a_rising_bit_4() {
    let mut bench = ready();
    bench.set(0x607A, 4096).set(0x6040, 0x0F).run_ms(500).reads(0x6064, 0);
    start(&mut bench, 4096, 0);
    bench.run_ms(2500);
    assert_at(&mut bench, 4096);
    // Bit 4 is still up: a new target waits for its next edge.
    bench.set(0x607A, 0).set(0x6040, 0x1F).run_ms(500);
    assert_at(&mut bench, 4096);
}

#[test]
fn an_absolute_target_beyond_3fffffffh_is_refused_when_it_is_to_start_and_a_relative_one_is_not() {
    let mut bench = ready();
    for target in [0x4000_0000, -0x4000_0000] {
        bench.set(0x607A, target).set(0x6040, 0x0F);
        assert_eq!(bench.write(0x6040, 0x1F), Err(0x0609_0030), "{target:X}h");
    }
    bench.set(0x6040, 0x4F).set(0x6040, 0x5F).run_ms(300);
    assert!(bench.report().velocity_rpm < -20.0, "the relative move has begun");
}

/// The lag passes 4090 counts (2017h = 409) at the time that the profile takes to go so far.
#[test]
fn a_blocked_shaft_faults_with_0020h_when_the_lag_passes_2017h() {
    for (threshold, lag) in [(409, 4090.0), (200, 2000.0)] {
        let mut bench = ready();
        bench.set(0x2017, threshold).set_rotor_locked(true);
        start(&mut bench, 40_000, 0);
        let (speed, edge) = (COUNTS_PER_TURN, COUNTS_PER_TURN / 60.0);
        let expected = 0.5 + (lag - 0.5 * (speed + edge) / 2.0) / speed;
        let seconds = bench.seconds_until(3.0, LOOK, |report| report.error_code != 0);
        assert_within("seconds to the fault", seconds, expected - 0.01, expected + 0.01);
        assert_eq!((bench.get(0x603F), bench.get(0x1001)), (0x0020, 0x21), "drive profile and generic");
    }
}

#[test]
fn clearing_with_2006h_moves_the_origin_of_absolute_moves() {
    let mut bench = ready();
    start(&mut bench, 4096, 0);
    bench.run_ms(2500);
    bench.set(0x2006, 1).is_at(0, 2);
    start(&mut bench, 2048, 0);
    bench.run_ms(2500);
    let turned = bench.report().shaft_angle_rad / core::f64::consts::TAU * COUNTS_PER_TURN;
    assert_within("counts from where it began", turned, 6144.0 - 60.0, 6144.0 + 60.0);
    bench.is_at(2048, 30);
}
