//! Velocity mode (vl, 6042h to 604Ch), with the figures of its ramps in closed form.

use canopen::AbortCode;

use crate::virtual_cia402::bench::{Bench, TURN};

/// Enabled with the three bits of the ramp.
const RUN: i64 = 0x7F;

/// Up by 1000 r/min in 1 s, down by 2000 r/min, quick stop by 8000 r/min in 2 s.
fn bench() -> Bench {
    let mut bench = Bench::new();
    bench.set(&[
        (0x6048, 1, 1000),
        (0x6048, 2, 1),
        (0x6049, 1, 2000),
        (0x6049, 2, 1),
        (0x604A, 1, 8000),
        (0x604A, 2, 2),
    ]);
    bench.enable(2);
    bench
}

fn turning(rpm: i64) -> Bench {
    let mut bench = bench();
    bench.set(&[(0x6042, 0, rpm)]);
    bench.control(RUN);
    bench.run_until(10_000, |bench| bench.read(0x6043, 0) == rpm).expect("the ramp leads there");
    bench.run_ms(100);
    bench
}

/// Milliseconds until the demand is at `rpm`.
fn until(bench: &mut Bench, rpm: i64) -> f64 {
    bench.run_until(10_000, |bench| bench.read(0x6043, 0) == rpm).unwrap_or(f64::INFINITY)
}

#[test]
fn the_ramps_take_the_change_over_their_rate() {
    let mut bench = bench();
    bench.set(&[(0x6042, 0, 500)]);
    bench.control(RUN);
    // 500 r/min at 1000 r/min/s; the demand is shown in whole r/min.
    let up = until(&mut bench, 500);
    assert!((up - 500.0).abs() <= 2.0, "{up}");
    let reached = bench.run_until(100, |bench| bench.has(0x0400));
    assert!(reached.is_some() && (bench.rpm() - 500.0).abs() < 5.0, "{}", bench.rpm());
    assert!((bench.read(0x6044, 0) - 500).abs() <= 5);
    bench.set(&[(0x6042, 0, -500)]);
    bench.run_ms(10);
    assert!(!bench.has(0x0400), "on its way");
    // 500 down at 2000 r/min/s, 500 up at 1000.
    let reversed = 10.0 + until(&mut bench, -500);
    assert!((reversed - 750.0).abs() <= 2.0, "{reversed}");
    bench.control(0x02);
    // 500 r/min at 4000 r/min/s.
    let stopped = bench.run_until(1000, |bench| bench.rpm().abs() < 5.0).unwrap();
    assert!((stopped - 125.0).abs() < 15.0, "{stopped}");
}

#[test]
fn halt_and_disable_slow_down_with_the_modes_own_ramp() {
    for controlword in [RUN | 0x100, 0x07] {
        let mut bench = turning(1000);
        bench.control(controlword);
        let stopped = bench.run_until(3000, |bench| bench.rpm().abs() < 5.0).unwrap();
        assert!((stopped - 500.0).abs() < 15.0, "{controlword:X}: {stopped}");
    }
}

#[test]
fn the_three_bits_of_the_ramp_enable_it_lock_it_and_give_it_its_reference() {
    let mut bench = bench();
    bench.set(&[(0x6042, 0, 1000)]);
    bench.run_ms(100);
    assert!(bench.rpm().abs() < 1.0, "none of the bits is set");
    bench.control(RUN);
    bench.run_ms(400);
    // Locked at 400 r/min.
    bench.control(RUN & !0x20);
    bench.run_ms(300);
    assert!((bench.read(0x6043, 0) - 400).abs() <= 2 && (bench.rpm() - 400.0).abs() < 5.0, "{}", bench.rpm());
    bench.control(RUN);
    let on = until(&mut bench, 1000);
    assert!((on - 600.0).abs() <= 3.0, "it goes on from there: {on}");
    for without in [0x40, 0x10] {
        let mut bench = turning(1000);
        bench.control(RUN & !without);
        let down = until(&mut bench, 0);
        assert!((down - 500.0).abs() <= 2.0, "without {without:02X}h: {down}");
        bench.control(RUN);
        assert!((until(&mut bench, 1000) - 1000.0).abs() <= 2.0);
    }
}

#[test]
fn the_amounts_limit_either_direction_and_show_it() {
    let mut bench = bench();
    bench.set(&[(0x6046, 1, 100), (0x6046, 2, 300)]);
    bench.control(RUN);
    for (target, demand, limited) in
        [(200, 200, false), (500, 300, true), (-500, -300, true), (20, 100, true), (-20, -100, true), (0, 0, false)]
    {
        bench.set(&[(0x6042, 0, target)]);
        bench.run_ms(1000);
        assert_eq!((bench.read(0x6043, 0), bench.has(0x0800)), (demand, limited), "{target}");
    }
}

#[test]
fn the_factors_scale_what_they_are_of_and_take_no_0() {
    let mut bench = bench();
    // Units of r/s: 604Ch = 60 / 1; the target in tenths of them, and turned round: 604Bh = -1 / 10.
    bench.set(&[(0x604C, 1, 60), (0x604B, 1, -1), (0x604B, 2, 10), (0x6048, 1, 100), (0x6046, 2, 100)]);
    bench.set(&[(0x6042, 0, 50)]);
    bench.control(RUN);
    bench.run_ms(500);
    assert!((bench.rpm() + 300.0).abs() < 3.0, "{}", bench.rpm());
    assert_eq!((bench.read(0x6043, 0), bench.read(0x6044, 0)), (50, -5));
    for (object, sub) in [(0x604B, 1), (0x604B, 2), (0x604C, 1), (0x604C, 2)] {
        assert_eq!(bench.write(object, sub, 0), Err(AbortCode::VALUE_TOO_LOW), "{object:X}h:{sub}");
    }
    // What 16 bits cannot show is held to their ends.
    bench.set(&[(0x604C, 1, 1), (0x604C, 2, 1000)]);
    bench.run_ms(1);
    assert_eq!(bench.read(0x6044, 0), -32_768);
}

#[test]
fn a_delta_time_of_0_is_as_fast_as_the_greatest_acceleration() {
    let mut bench = bench();
    bench.set(&[(0x6048, 2, 0), (0x60C5, 0, 100 * TURN), (0x6042, 0, 600)]);
    bench.control(RUN);
    // 10 turns/s at 100 turns/s2.
    let up = until(&mut bench, 600);
    assert!((up - 100.0).abs() <= 2.0, "{up}");
}

#[test]
fn a_software_limit_stops_it() {
    let mut bench = bench();
    bench.set(&[(0x607D, 1, -TURN), (0x607D, 2, 10 * TURN), (0x6042, 0, 1000)]);
    bench.control(RUN);
    bench.run_ms(5000);
    assert!(bench.rpm().abs() < 1.0 && (bench.position() - 10 * TURN).abs() < TURN / 50, "{}", bench.position());
    assert!(bench.has(0x0800));
}
