//! Another mode while the shaft turns: it acts at once, and takes the shaft over as it turns (docs/eds.md).

use canopen::Mux;
use devices::servo::{CIA402, MODES};

use crate::virtual_cia402::bench::{Bench, TURN};

/// Turning in profile velocity at 10 turns/s, with ramps of 50 turns/s2 for each mode.
fn turning() -> Bench {
    let mut bench = Bench::new();
    bench.set(&[(0x6083, 0, 500 * TURN), (0x6084, 0, 50 * TURN), (0x609A, 0, 50 * TURN), (0x6065, 0, 0xFFFF_FFFF)]);
    bench.set(&[(0x6048, 1, 3000), (0x6049, 1, 3000), (0x6071, 0, 0), (0x60FF, 0, 10 * TURN)]);
    bench.enable(3);
    bench.run_ms(300);
    assert!((bench.rpm() - 600.0).abs() < 6.0, "{}", bench.rpm());
    bench
}

#[test]
fn every_mode_acts_at_once_and_without_a_jolt() {
    for mode in MODES.iter().map(|mode| i64::from(mode.0)).filter(|mode| *mode != 3) {
        let mut bench = turning();
        bench.set(&[(0x6060, 0, mode)]);
        bench.run_ms(2);
        assert_eq!(bench.read(0x6061, 0), mode, "at once");
        assert_eq!(bench.status() & 0x6F, 0x27, "mode {mode}");
        // A step of the demand to standstill would take 20 ms; at 50 turns/s2 it is 60 r/min slower by then.
        bench.run_ms(18);
        // Without a torque the shaft of profile torque coasts.
        assert!(mode == 4 || bench.rpm() > 500.0, "mode {mode}: {}", bench.rpm());
        assert!(bench.emcy().is_empty(), "mode {mode}");
    }
}

#[test]
fn a_mode_without_a_set_point_brings_the_shaft_to_rest_along_its_ramp_and_holds_it() {
    // 10 turns/s at 50 turns/s2.
    for mode in [1, 2, 6, 7, 8, 9] {
        let mut bench = turning();
        bench.set(&[(0x6060, 0, mode)]);
        let took = bench.run_until(2000, |bench| bench.rpm() < 6.0).unwrap();
        assert!((took - 200.0).abs() < 15.0, "mode {mode}: {took}");
        bench.run_ms(200);
        let at = bench.position();
        bench.run_ms(200);
        assert!((bench.position() - at).abs() < 50, "mode {mode}");
    }
}

#[test]
fn a_mode_with_a_set_point_goes_on_from_the_present_velocity() {
    // pv to vl at 900 r/min: up by 300 r/min at 3000 r/min/s, of 600 as it turns.
    let mut bench = turning();
    bench.set(&[(0x6042, 0, 900)]);
    bench.control(0x7F);
    bench.set(&[(0x6060, 0, 2)]);
    let took = bench.run_until(1000, |bench| bench.read(0x6043, 0) == 900).unwrap();
    assert!((took - 100.0).abs() < 4.0, "{took}");
    // And back to pv at 10 turns/s.
    bench.set(&[(0x6060, 0, 3)]);
    bench.run_ms(500);
    assert!((bench.rpm() - 600.0).abs() < 6.0 && bench.read(0x6061, 0) == 3, "{}", bench.rpm());
    // To pp with a set-point right behind.
    bench.set(&[(0x6060, 0, 1), (0x6081, 0, 10 * TURN)]);
    bench.run_ms(2);
    let target = bench.position() + 20 * TURN;
    bench.set(&[(0x607A, 0, target)]);
    bench.control(0x0F);
    bench.control(0x1F);
    let mut slowest = f64::MAX;
    bench.run_until(1000, |bench| {
        slowest = slowest.min(bench.rpm());
        false
    });
    assert!(slowest > 570.0, "{slowest}");
    bench.run_until(5000, |bench| bench.has(0x0400)).unwrap();
    bench.run_ms(100);
    assert!((bench.position() - target).abs() < TURN / 500);
}

#[test]
fn torque_begins_at_none_and_a_stop_under_way_goes_on() {
    let mut bench = turning();
    bench.set(&[(0x6060, 0, 4)]);
    bench.run_ms(5);
    assert!(bench.read(0x6074, 0).abs() <= 1, "6071h is 0");
    // A quick stop of pv goes on through the change.
    let mut bench = turning();
    bench.set(&[(0x6085, 0, 50 * TURN), (0x605A, 0, 6)]);
    bench.control(0x02);
    bench.run_ms(50);
    bench.set(&[(0x6060, 0, 1)]);
    let took = 50.0 + bench.run_until(2000, |bench| bench.rpm() < 6.0).unwrap();
    assert!((took - 200.0).abs() < 15.0, "{took}");
    assert_eq!((bench.status() & 0x6F, bench.read(0x6061, 0)), (0x07, 1));
}

#[test]
fn with_a_commutation_angle_the_rotor_follows_it() {
    let mut bench = Bench::new();
    bench.enable(11);
    let pole_pairs = i64::from(bench.machine.assembly().motor(0).unwrap().model.pmsm.pole_pairs);
    bench.set(&[(0x60EA, 0, 0), (0x6071, 0, 500)]);
    bench.run_ms(1000);
    // It comes to rest where its torque is zero, however much it is asked for.
    assert!(bench.rpm().abs() < 3.0, "{}", bench.rpm());
    let start = bench.read(0x6063, 0);
    // Two electrical turns, in steps of a hundredth.
    for step in 1..=200 {
        bench.set(&[(0x60EA, 0, step * 65_536 / 100 % 65_536)]);
        bench.run_ms(5);
    }
    bench.run_ms(500);
    let moved = bench.read(0x6063, 0) - start;
    let expected = 2 * TURN / pole_pairs;
    assert!((moved - expected).abs() < TURN / 200, "{moved}, expected {expected}");
    let row = CIA402.row(Mux::new(0x60EA, 0)).unwrap();
    assert!(row.pdo.is_allowed() && bench.has(0x1000));
    // A halt is one by the encoder, and holds the shaft.
    bench.control(0x10F);
    bench.run_ms(100);
    assert!(bench.has(0x0400) && bench.rpm().abs() < 1.0);
}
