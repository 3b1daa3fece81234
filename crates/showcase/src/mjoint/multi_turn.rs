//! "Low-power multi-turn absolute value description": setting the origin, the position after power-on, the automatic
//! return, and the origin's signal.

use std::time::Duration;

use super::steps::{ALARM, COUNTS_PER_TURN, IN_PLACE_COUNTS, TARGET_REACHED, expect_time, idle, power_cycle, save};
use crate::bench::Bench;
use crate::expect::Expect;
use plot::EventKind;

/// 2: the battery is disconnected, the turns are lost, and a new origin is set with 60006 and 60016.
pub(super) fn zero_setting(bench: &mut Bench) {
    bench.section("turns 2", "origin");
    go_to(bench, 2 * COUNTS_PER_TURN as i64 + 5000);
    bench.step("battery disconnected");
    bench.machine("battery off");
    bench.mark("battery off (10h)", EventKind::Fault);
    bench.run_ms(100);
    bench.expect_object(0x260E, 0, Expect::Bits(0x10), "");
    bench.expect_status("bit 3", ALARM, ALARM);
    super::alarms::expect_flashes(bench, 1, 0);
    // "High frequency flicker": more often than a charging battery's flashes, which one could count.
    super::alarms::expect_green(bench, "flickers", Expect::AtLeast(10.0));
    bench.write("the motor does not stop: speed mode", 0x6060, 0, 3);
    bench.write("200 r/min", 0x60FF, 0, 200);
    bench.run_ms(300);
    let speed = bench.report().velocity_rpm;
    bench.moved(format!("{speed:.1} r/min"));
    bench.expect("speed", Expect::Near(200.0, 5.0), "r/min", speed);
    bench.write("0 r/min", 0x60FF, 0, 0);
    bench.run_ms(200);
    idle(bench);
    bench.machine("battery on");
    bench.ask("electronic gear molecule 60006", "2B 0A 26 00 66 EA", "60 0A 26 00");
    bench.ask("electronic gear molecule 60016", "2B 0A 26 00 70 EA", "60 0A 26 00");
    bench.mark("origin set", EventKind::Note);
    bench.run_ms(5);
    bench.ask("the molecule has returned to 32768", "40 0A 26 00", "4B 0A 26 00 00 80");
    bench.step("the position is 0 or +-single digit");
    bench.expect_object(0x6064, 0, Expect::Near(0.0, 9.0), "counts");
    bench.step("the battery alarm is gone");
    bench.expect_object(0x260E, 0, Expect::Bits(0), "");
}

/// 3A: "when the motor is powered on, the current position data is the position of the motor in multiple turns".
pub(super) fn known_after_power_on(bench: &mut Bench) {
    bench.section("turns 3A", "known position");
    let target = 3 * COUNTS_PER_TURN as i64 + 5000;
    go_to(bench, target);
    idle(bench);
    power_cycle(bench);
    bench.step("read the position");
    bench.expect_object(0x6064, 0, Expect::Near(target as f64, IN_PLACE_COUNTS), "counts");
    go_to(bench, -1000);
}

/// 3C: ZO conducts while the position is below 0.
pub(super) fn origin_signal(bench: &mut Bench) {
    bench.section("turns 3C", "origin signal");
    for (target, conducts) in [(2000, false), (-2000, true), (2000, false)] {
        go_to(bench, target);
        let (zo, word) = (bench.output("ZO"), |on: bool| if on { "conducts" } else { "high impedance" });
        bench.compare(format!("ZO {}", word(conducts)), word(zo), zo == conducts);
    }
    bench.write("speed mode", 0x6060, 0, 3);
    bench.write("-20 r/min", 0x60FF, 0, -20);
    bench.write("slowly backwards until ZO", 0x6040, 0, 0x0F);
    let begin = bench.now();
    while !bench.output("ZO") && bench.now() - begin < Duration::from_secs(2) {
        bench.run_ms(1);
    }
    let position = bench.report().position as f64;
    // 20 r/min are 11 counts a millisecond.
    bench.expect("zero point at", Expect::Near(0.0, 15.0), "counts", position);
    bench.write("0 r/min", 0x60FF, 0, 0);
    bench.run_ms(200);
}

/// 3B: special function 6; with an acceleration of 10005 "the speed of finding the origin is 600 RPM".
pub(super) fn return_to_origin(bench: &mut Bench) {
    bench.section("turns 3B", "return to origin");
    go_to(bench, 8 * COUNTS_PER_TURN as i64);
    idle(bench);
    bench.write("special function 6", 0x2619, 0, 6);
    bench.write("acceleration 10005", 0x6083, 0, 10_005);
    save(bench);
    power_cycle(bench);
    bench.mark("returns on its own", EventKind::Note);
    bench.aim_at(0.0);
    let begin = bench.now();
    bench.run_ms(500);
    let speed = bench.report().velocity_rpm;
    bench.moved(format!("{speed:.0} r/min on its own"));
    bench.expect("speed", Expect::Near(-600.0, 10.0), "r/min", speed);
    bench.run_until(Duration::from_secs(4), |word| word & TARGET_REACHED != 0);
    let took_s = (bench.now() - begin).as_secs_f64();
    // 8 turns at 600 r/min, and the ramps of 10005 (r/min)/s.
    let expected_s = 8.0 / 10.0 + 600.0 / 10_005.0;
    expect_time(bench, "at its origin after", expected_s, took_s);
    bench.expect_object(0x6064, 0, Expect::Near(0.0, IN_PLACE_COUNTS), "counts");
    bench.aim_at_nothing();
    bench.write("special function 0", 0x2619, 0, 0);
    bench.write("acceleration 20000", 0x6083, 0, 20_000);
    save(bench);
    power_cycle(bench);
}

/// An absolute move, as one row.
pub(super) fn go_to(bench: &mut Bench, target: i64) {
    bench.write("position mode", 0x6060, 0, 1);
    bench.write("2Fh: absolute, at once", 0x6040, 0, 0x2F);
    let from = bench.report().position;
    bench.write(format!("target {target:+}"), 0x607A, 0, target);
    bench.aim_at(target as f64);
    bench.run_until(Duration::from_secs(5), |word| word & TARGET_REACHED != 0);
    bench.run_ms(50);
    let position = bench.report().position;
    bench.moved(format!("{:+} counts", position - from));
    bench.expect("at", Expect::Near(target as f64, IN_PLACE_COUNTS), "counts", position as f64);
}
