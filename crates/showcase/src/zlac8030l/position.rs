//! 4.2, 4.3 and 7.2: profile position mode, relative and absolute, and its statusword.

use std::time::Duration;

use super::as_delivered::COUNTS_PER_TURN;
use super::velocity::enable_again;
use crate::bench::Bench;
use crate::expect::Expect;

/// 2002h as delivered: the drive is in place within this many counts.
const IN_PLACE_COUNTS: f64 = 30.0;

/// Acceleration and deceleration times as delivered (6083h, 6084h), s.
const RAMP_S: f64 = 0.5;

/// 6081h as 4.2 and 4.3 set it.
const SPEED_RPM: f64 = 60.0;

const RELATIVE: [&str; 2] = ["2B 40 60 00 4F 00 00 00", "2B 40 60 00 5F 00 00 00"];
const ABSOLUTE: [&str; 2] = ["2B 40 60 00 0F 00 00 00", "2B 40 60 00 1F 00 00 00"];
const TARGETS: [(f64, &str); 2] = [(32_000.0, "23 7A 60 00 00 7D 00 00"), (-32_000.0, "23 7A 60 00 00 83 FF FF")];

const TARGET_REACHED: u16 = 1 << 10;
const ACKNOWLEDGE: u16 = 1 << 12;

/// 4.2.
pub(super) fn relative(bench: &mut Bench) {
    bench.section("4.2", "relative position");
    position_mode(bench);
    for (counts, request) in TARGETS {
        let from = bench.report().position as f64;
        go(bench, "relative", from + counts, request, RELATIVE);
    }
}

/// Position mode at 60 r/min, enabled.
pub(super) fn position_mode(bench: &mut Bench) {
    bench.ask("position mode", "2F 60 60 00 01 00 00 00", "60 60 60 00 00 00 00 00");
    bench.ask("max speed 60 r/min", "23 81 60 00 3C 00 00 00", "60 81 60 00 00 00 00 00");
    enable_again(bench);
}

/// 4.3.
pub(super) fn absolute(bench: &mut Bench) {
    bench.section("4.3", "absolute position");
    for (counts, request) in TARGETS {
        go(bench, "absolute", counts, request, ABSOLUTE);
    }
}

/// One move: target, start, wait until it is reached; checks where, how long, and the statusword of 7.2.
fn go(bench: &mut Bench, kind: &str, goal: f64, target: &str, [prepare, start]: [&str; 2]) {
    let sign = if target.ends_with("FF") { "-" } else { "+" };
    bench.ask(format!("target position {sign}32000"), target, "60 7A 60 00 00 00 00 00");
    bench.ask(format!("start {kind} motion"), prepare, "60 40 60 00 00 00 00 00");
    let from = bench.report().position as f64;
    let begin = bench.now();
    bench.aim_at(goal);
    bench.ask(format!("start {kind} motion"), start, "60 40 60 00 00 00 00 00");
    let acknowledged = bench.run_until(Duration::from_millis(100), |word| word & ACKNOWLEDGE != 0);
    bench.compare("bit 12 acknowledges", if acknowledged.is_some() { "yes" } else { "no" }, acknowledged.is_some());
    // The way at 60 r/min takes as long as the way alone and half of each ramp.
    let time_s = (goal - from).abs() / COUNTS_PER_TURN / (SPEED_RPM / 60.0) + RAMP_S;
    bench.run_until(Duration::from_secs_f64(time_s * 1.5 + 1.0), |word| word & TARGET_REACHED != 0);
    let took_s = (bench.now() - begin).as_secs_f64();
    bench.run(Duration::from_millis(200));
    let position = bench.report().position as f64;
    bench.moved(format!("{:+.0} counts in {took_s:.2} s", position - from));
    bench.expect("at", Expect::Near(goal.round(), IN_PLACE_COUNTS), "counts", position);
    bench.expect("after", Expect::Near(time_s, 0.03 * time_s), "s", took_s);
    bench.step_in("7.2", "statusword at the target");
    let word = bench.statusword().unwrap_or_default();
    // Bit 5 no emergency stop, 10 reached, 12 valid, 13 in place, 14 not running, 15 no external stop.
    bench.expect("bits 5, 10, 13, 14, 15", Expect::Bits(0x2420), "", f64::from(word & 0xE420));
}
