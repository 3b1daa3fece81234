//! Ramps of limited jerk: 6086h = 3 with 60A3h and 60A4h.

use canopen::AbortCode;
use canopen::od::Entry;

use crate::virtual_cia402::bench::{Bench, TURN, changed};

/// A jerk of 1000 turns/s3 on a rate of 100 turns/s2.
fn limited() -> Bench {
    let mut bench = Bench::new();
    bench.set(&[(0x6086, 0, 3), (0x60A4, 1, 1000 * TURN), (0x6083, 0, 100 * TURN), (0x6084, 0, 100 * TURN)]);
    bench
}

#[test]
fn a_jerk_limited_move_takes_d_over_v_and_v_over_a_and_a_over_j() {
    let mut bench = limited();
    bench.enable(1);
    bench.set(&[(0x6081, 0, 20 * TURN), (0x607A, 0, 10 * TURN)]);
    bench.control(0x1F);
    // The demand: d / v + v / a + a / j = 0.5 + 0.2 + 0.1 s.
    let took = bench.run_until(3000, |bench| bench.read(0x6062, 0) == 10 * TURN).unwrap();
    assert!((took - 800.0).abs() <= 1.5, "{took}");
    let reached = bench.run_until(100, |bench| bench.has(0x0400)).unwrap();
    assert!(reached < 40.0, "{reached}");
}

/// Milliseconds until the demand of velocity is the target, from rest and back to rest.
fn up_and_down(bench: &mut Bench) -> [f64; 2] {
    bench.enable(3);
    [20 * TURN, 0].map(|target| {
        bench.set(&[(0x60FF, 0, target)]);
        let took = bench.run_until(3000, |bench| bench.read(0x606B, 0) == target).unwrap();
        bench.run_ms(100);
        took
    })
}

#[test]
fn the_jerks_are_those_that_60a3h_names() {
    // dv / a + a / 2 j1 + a / 2 j2, in ms: 200, and 50 for a jerk of 1000, 100 for 500, 25 for 2000, 12.5 for 4000.
    for (use_of_jerks, up, down) in [(1, 300.0, 300.0), (2, 300.0, 400.0), (4, 350.0, 237.5)] {
        let mut bench = limited();
        let jerks = [1000, 500, 2000, 4000];
        for (sub, jerk) in (1..).zip(jerks) {
            bench.set(&[(0x60A4, sub, jerk * TURN)]);
        }
        bench.set(&[(0x60A3, 0, use_of_jerks)]);
        let took = up_and_down(&mut bench);
        assert!((took[0] - up).abs() <= 1.5 && (took[1] - down).abs() <= 1.5, "60A3h = {use_of_jerks}: {took:?}");
    }
}

#[test]
fn without_a_jerk_ramps_are_straight() {
    let mut bench = limited();
    bench.set(&[(0x60A4, 1, 0)]);
    let took = up_and_down(&mut bench);
    assert!(took.iter().all(|took| (took - 200.0).abs() <= 1.5), "{took:?}");
    let mut linear = limited();
    linear.set(&[(0x6086, 0, 0)]);
    assert_eq!(up_and_down(&mut linear), took);
}

#[test]
fn a_software_limit_goes_before_the_jerk() {
    let mut bench = limited();
    // A stop of this jerk alone would take 0.2 s.
    bench.set(&[(0x60A4, 1, 500 * TURN), (0x607D, 1, -TURN), (0x607D, 2, 10 * TURN)]);
    bench.enable(3);
    bench.set(&[(0x60FF, 0, 30 * TURN)]);
    let mut farthest = 0;
    bench.run_until(3000, |bench| {
        farthest = farthest.max(bench.position());
        false
    });
    assert!((10 * TURN - farthest).abs() < TURN / 50 && bench.rpm().abs() < 1.0, "{farthest}");
}

#[test]
fn profile_types_that_do_not_run_are_refused() {
    let mut bench = limited();
    for profile_type in [1, 2, -1, 4] {
        assert_eq!(bench.write(0x6086, 0, profile_type), Err(AbortCode::INVALID_VALUE), "{profile_type}");
    }
    // The same of a file that lists no values; and without 60A4h there is no jerk.
    let open = |row: Entry| if row.index == 0x6086 { Entry { limits: None, ..row } } else { row };
    assert_eq!(Bench::of(changed(open)).write(0x6086, 0, 2), Err(AbortCode::INVALID_VALUE));
    let without = changed(|row| if row.index == 0x60A4 { Entry { index: 0x60A5, ..row } } else { row });
    assert_eq!([3, 0].map(|kind| Bench::of(without).write(0x6086, 0, kind)), [Err(AbortCode::INVALID_VALUE), Ok(())]);
}
