//! The standard's own servo, mode by mode.
#![allow(unreachable_pub, dead_code, reason = "modules of one test")]

mod any_data_sheet;
mod axes;
mod bench;
mod connection;
mod homing;
mod jerk;
mod limits;
mod mode_changes;
mod modes;
mod profile_objects;
mod ranges;
mod services;
mod stops;
mod units;
mod velocity_mode;

use bench::{Bench, TURN};

#[test]
fn it_boots_and_is_enabled_step_by_step() {
    let mut bench = Bench::new();
    assert_eq!(bench.sent[0].to_string(), "705#00");
    assert_eq!(bench.status() & 0x4F, 0x40);
    for (word, state) in [(0x06, 0x21), (0x07, 0x23), (0x0F, 0x27), (0x07, 0x23), (0x06, 0x21), (0x00, 0x40)] {
        bench.control(word);
        bench.run_ms(20);
        let mask = if state == 0x40 { 0x4F } else { 0x6F };
        assert_eq!(bench.status() & mask, state, "after {word:02X}h");
    }
}

#[test]
fn profile_position_moves_along_its_trapezoid() {
    let mut bench = Bench::new();
    bench.enable(1);
    bench.set(&[(0x6081, 0, 10 * TURN), (0x6083, 0, 100 * TURN), (0x6084, 0, 100 * TURN), (0x607A, 0, 5 * TURN)]);
    bench.control(0x1F);
    assert!(bench.has(0x1000), "acknowledged");
    bench.control(0x0F);
    let took = bench.run_until(3000, |bench| bench.has(0x0400)).unwrap();
    // 5 turns at 10 turns/s with 0.1 s up and 0.1 s down: 0.5 + 0.1 s, and the window's 10 ms.
    assert!((590.0..640.0).contains(&took), "{took}");
    let position = bench.position();
    assert!((position - 5 * TURN).abs() <= TURN / 1000, "{position}");
}

#[test]
fn profile_velocity_turns() {
    let mut bench = Bench::new();
    bench.enable(3);
    bench.set(&[(0x60FF, 0, 20 * TURN)]);
    let took = bench.run_until(3000, |bench| bench.has(0x0400)).unwrap();
    // 20 turns/s at 200 turns/s2, what the loops overshoot, and the window's 10 ms.
    assert!((100.0..150.0).contains(&took), "{took}");
    bench.run_ms(100);
    assert!((bench.rpm() - 1200.0).abs() < 12.0, "{}", bench.rpm());
}
