//! Positions that go round (607Bh), and moves that pass their target (6082h).

use crate::virtual_cia402::bench::{Bench, TURN, changed};

/// A turntable of 3600 units a turn, of which 131072 increments are not a whole multiple, that shows 0 to 3599.
fn turntable() -> Bench {
    let mut bench = Bench::new();
    bench.set(&[(0x6092, 1, 3600), (0x607B, 1, 0), (0x607B, 2, 3599), (0x6067, 0, 1), (0x6065, 0, 0xFFFF_FFFF)]);
    bench.set(&[(0x607F, 0, 360_000), (0x6081, 0, 36_000), (0x6083, 0, 720_000), (0x6084, 0, 720_000)]);
    bench
}

fn move_to(bench: &mut Bench, target: i64, controlword: i64) {
    bench.set(&[(0x607A, 0, target)]);
    bench.control(0x0F);
    bench.control(controlword);
    assert!(bench.has(0x1000), "acknowledged");
    bench.run_until(20_000, |bench| bench.has(0x0400)).expect("it arrives");
    bench.run_ms(100);
}

fn turns(bench: &mut Bench) -> f64 {
    bench.read(0x6063, 0) as f64 / TURN as f64
}

#[test]
fn after_the_greatest_position_comes_the_least_whatever_the_way_round() {
    let mut bench = turntable();
    bench.enable(1);
    // Three turns and a quarter on, and what is shown is the quarter.
    move_to(&mut bench, 3 * 3600 + 900, 0x1F);
    assert!((bench.position() - 900).abs() <= 1 && (turns(&mut bench) - 3.25).abs() < 1e-3);
    // Absolute: from the 900 that it shows to 100, backwards, as of a linear axis.
    move_to(&mut bench, 100, 0x1F);
    assert!((bench.position() - 100).abs() <= 1 && (turns(&mut bench) - 3.0 - 100.0 / 3600.0).abs() < 1e-3);
    // Relative: 200 back over the end.
    move_to(&mut bench, -200, 0x5F);
    assert!((bench.position() - 3500).abs() <= 1, "{}", bench.position());
    assert!((bench.read(0x6062, 0) - 3500).abs() <= 1, "so does the demand");
}

#[test]
fn no_round_is_longer_than_another() {
    let mut bench = turntable();
    bench.enable(1);
    // 100 turns of 131072 / 3600 = 36.4.. increments a unit each time, a thousand in all.
    for _ in 0..10 {
        move_to(&mut bench, 360_000, 0x5F);
    }
    let shown = bench.position();
    assert!(shown <= 1 || shown == 3599, "{shown}");
    assert!((turns(&mut bench) - 1000.0).abs() < 1e-3);
}

#[test]
fn a_stream_of_positions_goes_on_over_the_end() {
    let mut bench = turntable();
    bench.enable(8);
    for ms in 1..=1000 {
        // Two and a half turns a second, forwards.
        bench.set(&[(0x607A, 0, (9 * ms) % 3600)]);
        bench.run_ms(1);
        // What the loops overshoot at the sudden start; the other way round it would be thousands.
        assert!((-10.0..200.0).contains(&bench.rpm()), "{ms}: {}", bench.rpm());
    }
    bench.run_ms(200);
    assert!((turns(&mut bench) - 2.5).abs() < 2e-3, "{}", turns(&mut bench));
    assert!((bench.position() - 1800).abs() <= 2, "{}", bench.position());
}

#[test]
fn software_limits_keep_an_axis_from_going_round() {
    let mut bench = turntable();
    bench.set(&[(0x607D, 1, -1000), (0x607D, 2, 5000)]);
    bench.enable(1);
    move_to(&mut bench, 4500, 0x1F);
    assert!((bench.position() - 4500).abs() <= 1, "{}", bench.position());
}

#[test]
fn a_range_of_all_that_32_bits_hold_or_the_wrong_way_round_is_none() {
    for [low, high] in [[-0x8000_0000, 0x7FFF_FFFF], [100, 100], [100, 0]] {
        let mut bench = turntable();
        bench.set(&[(0x607B, 1, low), (0x607B, 2, high)]);
        bench.enable(1);
        move_to(&mut bench, 4500, 0x1F);
        assert!((bench.position() - 4500).abs() <= 1, "{low} to {high}: {}", bench.position());
    }
}

#[test]
fn a_turned_sign_turns_the_range_too() {
    let mut bench = turntable();
    bench.set(&[(0x607E, 0, 0x80)]);
    bench.enable(1);
    move_to(&mut bench, 3 * 3600 + 900, 0x1F);
    assert!((bench.position() - 900).abs() <= 1 && (turns(&mut bench) + 3.25).abs() < 1e-3);
    move_to(&mut bench, 100, 0x1F);
    assert!((turns(&mut bench) + 3.0 + 100.0 / 3600.0).abs() < 1e-3);
}

/// A move of 5 turns at 10 turns/s that passes its target at 4 turns/s.
fn passing() -> Bench {
    let mut bench = Bench::new();
    bench.set(&[(0x6065, 0, 0xFFFF_FFFF), (0x6081, 0, 10 * TURN), (0x6083, 0, 100 * TURN), (0x6084, 0, 100 * TURN)]);
    bench.set(&[(0x6082, 0, 4 * TURN), (0x607A, 0, 5 * TURN)]);
    bench.enable(1);
    bench.control(0x1F);
    bench
}

#[test]
fn a_target_with_an_end_velocity_is_passed_with_it() {
    let mut bench = passing();
    // Up: 10 / 100 s, 0.5 turns. Down to 4: 6 / 100 s, (100 - 16) / 200 = 0.42 turns. The rest at 10 turns/s.
    let expected_ms = 1e3 * (0.1 + 0.06 + (5.0 - 0.5 - 0.42) / 10.0);
    let took = bench.run_until(3000, |bench| bench.read(0x6062, 0) >= 5 * TURN).unwrap();
    assert!((took - expected_ms).abs() <= 1.5, "{took}, expected {expected_ms}");
    bench.run_ms(100);
    assert!((bench.rpm() - 240.0).abs() < 3.0 && bench.has(0x0400), "{} {:04X}", bench.rpm(), bench.status());
    // The next set-point takes over from there.
    bench.set(&[(0x6082, 0, 0), (0x607A, 0, 10 * TURN)]);
    bench.control(0x0F);
    bench.control(0x1F);
    bench.run_until(3000, |bench| bench.has(0x0400)).unwrap();
    bench.run_ms(50);
    assert!((bench.position() - 10 * TURN).abs() < TURN / 500 && bench.rpm().abs() < 1.0);
}

#[test]
fn a_set_point_that_waits_follows_without_a_stop() {
    let mut bench = passing();
    bench.control(0x0F);
    bench.set(&[(0x607A, 0, 8 * TURN), (0x6082, 0, 4 * TURN)]);
    bench.control(0x1F);
    let mut slowest = f64::MAX;
    bench.run_until(3000, |bench| {
        let at = bench.position();
        if (4 * TURN..6 * TURN).contains(&at) {
            slowest = slowest.min(bench.rpm());
        }
        at > 6 * TURN
    });
    assert!((slowest - 240.0).abs() < 12.0, "{slowest}");
}

#[test]
fn what_has_passed_its_target_stops_before_a_software_limit_and_does_not_go_back_after_a_halt() {
    let mut bench = passing();
    bench.set(&[(0x607D, 1, -TURN), (0x607D, 2, 6 * TURN)]);
    bench.run_ms(3000);
    let at = bench.position() as f64 / TURN as f64;
    assert!(bench.rpm().abs() < 1.0 && (5.9..6.0).contains(&at), "{at}");

    let mut bench = passing();
    bench.run_ms(1000);
    bench.control(0x11F);
    bench.run_ms(500);
    let halted = bench.position();
    bench.control(0x1F);
    bench.run_ms(500);
    assert!((bench.position() - halted).abs() < 100 && bench.rpm().abs() < 1.0);
}

#[test]
fn a_file_without_them_has_neither() {
    let without = changed(|row| match row.index {
        0x607B => canopen::od::Entry { index: 0x607B, sub_index: row.sub_index + 3, ..row },
        _ => row,
    });
    let mut bench = Bench::of(without);
    bench.enable(1);
    bench.set(&[(0x607A, 0, TURN)]);
    bench.control(0x1F);
    assert!(bench.run_until(3000, |bench| bench.has(0x0400)).is_some());
}
