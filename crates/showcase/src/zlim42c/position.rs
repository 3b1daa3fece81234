//! 5.3.4: position mode. The example, absolute moves, moves too short for their speed, and set-points given on the way.

use std::time::Duration;

use super::steps::{ACKNOWLEDGE, TARGET_REACHED, enable_in, expect_position, move_time_s, release};
use crate::bench::Bench;
use crate::datagram::frame;
use crate::expect::Expect;

const ACCEPTED: &str = "60 40 60 00 00 00 00 00";

/// 6081h as the example sets it.
const SPEED_RPM: f64 = 60.0;

/// Statusword bits 10 (reached), 12 (in effect), 14 (running), 15 (in position).
const MOTION_BITS: u16 = 0xD400;

/// The example: relative by 3200 pulses at 60 r/min.
pub(super) fn example(bench: &mut Bench) {
    bench.section("5.3.4", "relative position");
    bench.step("NMT start");
    bench.send(frame("000 01 00"));
    bench.ask("initialise the state machine", "2B 40 60 00 00 00 00 00", ACCEPTED);
    bench.ask("acceleration time 100 ms", "23 83 60 00 64 00 00 00", "60 83 60 00 00 00 00 00");
    bench.ask("deceleration time 100 ms", "23 84 60 00 64 00 00 00", "60 84 60 00 00 00 00 00");
    bench.ask("maximum speed 60 r/min", "23 81 60 00 3C 00 00 00", "60 81 60 00 00 00 00 00");
    bench.ask("3200 pulses", "23 7A 60 00 80 0C 00 00", "60 7A 60 00 00 00 00 00");
    bench.ask("position mode", "2F 60 60 00 01 00 00 00", "60 60 60 00 00 00 00 00");
    bench.ask("controlword 06h", "2B 40 60 00 06 00 00 00", ACCEPTED);
    bench.ask("controlword 07h", "2B 40 60 00 07 00 00 00", ACCEPTED);
    bench.ask("controlword 0Fh", "2B 40 60 00 0F 00 00 00", ACCEPTED);
    for end in [3200.0, 6400.0] {
        bench.ask("relative motion, command 1", "2B 40 60 00 4F 00 00 00", ACCEPTED);
        start(bench, "relative motion, command 2", 0x5F, end);
        until_reached(bench, end, move_time_s(3200.0, SPEED_RPM));
    }
}

/// 0Fh then 1Fh: the same target as a place.
pub(super) fn absolute(bench: &mut Bench) {
    bench.section("5.3.4", "absolute");
    for (target, request) in [(-3200.0, "23 7A 60 00 80 F3 FF FF"), (0.0, "23 7A 60 00 00 00 00 00")] {
        let way = bench.report().position as f64 - target;
        bench.ask(format!("target {target} pulses"), request, "60 7A 60 00 00 00 00 00");
        bench.ask("absolute motion, 0Fh", "2B 40 60 00 0F 00 00 00", ACCEPTED);
        start(bench, "absolute motion, 1Fh", 0x1F, target);
        until_reached(bench, target, move_time_s(way, SPEED_RPM));
    }
}

/// The second figure: fewer pulses than both ramps need. The motor turns back before it has its full speed.
pub(super) fn short(bench: &mut Bench) {
    bench.section("5.3.4", "short");
    let mut end = 0.0;
    for pulses in [200, 100] {
        bench.write(format!("{pulses} pulses"), 0x607A, 0, pulses);
        bench.ask("relative motion, command 1", "2B 40 60 00 4F 00 00 00", ACCEPTED);
        end += f64::from(pulses as i32);
        start(bench, "relative motion, command 2", 0x5F, end);
        until_reached(bench, end, move_time_s(pulses as f64, SPEED_RPM));
    }
}

/// Bit 5: 0 finishes the present move first, 1 interrupts it.
pub(super) fn several_set_points(bench: &mut Bench) {
    bench.section("5.3.4", "set-points");
    go_to(bench, 0);
    let begin = bench.now();
    for target in [4000, 6000] {
        bench.write(format!("target {target}"), 0x607A, 0, target);
        bench.write("absolute motion, 0Fh", 0x6040, 0, 0x0F);
        start(bench, "absolute motion, 1Fh (bit 5 = 0)", 0x1F, target as f64);
        bench.run_ms(10);
    }
    // Both in full: 4000 pulses, and then 2000.
    let both_s = move_time_s(4000.0, SPEED_RPM) + move_time_s(2000.0, SPEED_RPM);
    bench.run_ms((both_s * 1e3) as u64 - 50);
    let reached_early = bench.statusword().is_some_and(|word| word & TARGET_REACHED != 0);
    bench.compare("on the way until both are done", if reached_early { "there" } else { "on the way" }, !reached_early);
    until_reached(bench, 6000.0, 0.0);
    let took_s = (bench.now() - begin).as_secs_f64() - 0.1;
    bench.expect("both after", Expect::Near(both_s, 0.05), "s", took_s);

    bench.write("target 20000", 0x607A, 0, 20_000);
    bench.write("absolute motion, 0Fh", 0x6040, 0, 0x0F);
    start(bench, "absolute motion, 1Fh", 0x1F, 20_000.0);
    bench.run_ms(600);
    bench.write("target 2000", 0x607A, 0, 2000);
    bench.write("absolute motion, 2Fh", 0x6040, 0, 0x2F);
    start(bench, "absolute motion at once, 3Fh (bit 5 = 1)", 0x3F, 2000.0);
    bench.run_until(Duration::from_secs(4), |word| word & TARGET_REACHED != 0);
    bench.run_ms(50);
    expect_position(bench, 2000.0);
    release(bench);
}

/// Gives the edge of bit 4, and checks bits 11 and 12.
fn start(bench: &mut Bench, step: &str, controlword: u8, goal: f64) {
    bench.aim_at(goal);
    bench.ask(step, &format!("2B 40 60 00 {controlword:02X} 00 00 00"), ACCEPTED);
    bench.run_until(Duration::from_millis(50), |word| word & ACKNOWLEDGE != 0);
    // Bit 11 is bit 4 of the controlword (5.3.2).
    bench.expect_status("bits 11, 12", 0x1800, 0x1800);
}

/// Waits for bit 10; checks place, time (if there is one to check) and the bits of 5.3.4 and 5.3.2.
fn until_reached(bench: &mut Bench, goal: f64, time_s: f64) {
    let begin = bench.now();
    let from = bench.report().position as f64;
    bench.run_until(Duration::from_secs_f64(time_s * 1.5 + 3.0), |word| word & TARGET_REACHED != 0);
    let took_s = (bench.now() - begin).as_secs_f64();
    bench.run_ms(100);
    let report = bench.report();
    bench.moved(format!("{:+.0} pulses in {took_s:.2} s", report.position as f64 - from));
    expect_position(bench, goal);
    if time_s > 0.0 {
        // The acknowledgement takes some milliseconds before the clock here runs.
        bench.expect("after", Expect::Near(time_s, 0.01), "s", took_s);
    }
    bench.step("statusword at the target");
    bench.expect_status("bits 10, 12, 14, 15", MOTION_BITS & !ACKNOWLEDGE, 0x8400);
}

/// An absolute move as one row.
pub(super) fn go_to(bench: &mut Bench, target: i64) {
    enable_in(bench, 1);
    bench.write(format!("target {target}"), 0x607A, 0, target);
    bench.aim_at(target as f64);
    bench.write("absolute motion, 1Fh", 0x6040, 0, 0x1F);
    bench.run_ms(10);
    bench.run_until(Duration::from_secs(20), |word| word & TARGET_REACHED != 0);
    bench.run_ms(100);
    expect_position(bench, target as f64);
    bench.write("0Fh", 0x6040, 0, 0x0F);
}
