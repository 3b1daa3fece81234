//! 5.3.6: homing 17, 18, 24 and 29, the second one with the example's datagrams; the offset, an interrupted, a halted and
//! a failed run.
//!
//! The track, in pulses from where it is set up: limits from 8000 outwards, the home switch from -400 to 400.

use std::f64::consts::TAU;
use std::time::Duration;

use super::position::go_to;
use super::steps::{PULSES_PER_TURN, PULSES_S_PER_RPM, release};
use crate::bench::Bench;
use crate::datagram::frame;
use crate::expect::Expect;
use plot::EventKind;

const ACCEPTED: &str = "60 40 60 00 00 00 00 00";

/// The last move crosses the edge at 6099h:02, and the input's filter (10 ms, 3.2) passes it on later.
const FILTER_PULSES: f64 = 60.0 * PULSES_S_PER_RPM * 0.010;

/// Bits 8 (homed), 10 (at the end), 14 (running).
const HOMING_BITS: u16 = 0x4500;
const HOMED: u16 = 0x0500;
const FAILED: u16 = 0x0400;
const RUNNING: u16 = 0x4000;

/// 5.3.6.
pub(super) fn all(bench: &mut Bench) {
    bench.section("5.3.6", "homing");
    let zero = track(bench);
    example(bench);
    finish(bench, zero + 8000.0, 1.0, 0);
    run(bench, 17, zero - 8000.0, -1.0, 0);
    run(bench, 24, zero - 400.0, 1.0, 250);
    run(bench, 29, zero - 400.0, 1.0, 0);
    interrupted(bench);
    halted(bench);
    failed(bench);
    for (input, sub_index) in [("X0", 2), ("X1", 3), ("X2", 4)] {
        bench.write(format!("{input} has no function"), 0x2030, sub_index, 0);
        bench.machine(&format!("input {input} 0"));
    }
    release(bench);
}

/// Switches at X0 to X2 and their functions; where the shaft's zero is, pulses.
fn track(bench: &mut Bench) -> f64 {
    go_to(bench, 3000);
    bench.write("current position := 0 (2012h)", 0x2012, 0, 1);
    bench.run_ms(5);
    bench.expect_object(0x6064, 0, Expect::Near(0.0, 0.0), "pulses");
    bench.write("X0 is the home switch", 0x2030, 2, 1);
    bench.machine("switch X0 -400 400");
    bench.write("X1 is the positive limit", 0x2030, 3, 2);
    bench.machine("switch X1 8000 max");
    bench.write("X2 is the negative limit", 0x2030, 4, 3);
    bench.machine("switch X2 min -8000");
    shaft(bench)
}

/// The example: 12h, the positive limit.
fn example(bench: &mut Bench) {
    bench.step("NMT start");
    bench.send(frame("000 01 00"));
    bench.ask("initialise the state machine", "2B 40 60 00 00 00 00 00", ACCEPTED);
    bench.ask("method 18: positive limit", "2F 98 60 00 12 00 00 00", "60 98 60 00 00 00 00 00");
    bench.ask("homing speed 120 r/min", "23 99 60 01 78 00 00 00", "60 99 60 01 00 00 00 00");
    bench.ask("search speed 60 r/min", "23 99 60 02 3C 00 00 00", "60 99 60 02 00 00 00 00");
    bench.ask("deceleration time 100 ms", "23 9A 60 00 64 00 00 00", "60 9A 60 00 00 00 00 00");
    bench.ask("homing mode", "2F 60 60 00 06 00 00 00", "60 60 60 00 00 00 00 00");
    bench.ask("controlword 06h", "2B 40 60 00 06 00 00 00", ACCEPTED);
    bench.ask("controlword 07h", "2B 40 60 00 07 00 00 00", ACCEPTED);
    bench.ask("controlword 0Fh", "2B 40 60 00 0F 00 00 00", ACCEPTED);
    bench.ask("controlword 1Fh: homing starts", "2B 40 60 00 1F 00 00 00", ACCEPTED);
}

/// Another method from where the motor stands.
fn run(bench: &mut Bench, method: i64, edge: f64, direction: f64, offset: i64) {
    bench.write("controlword 0Fh", 0x6040, 0, 0x0F);
    bench.write(format!("home offset {offset}"), 0x607C, 0, offset);
    bench.write(format!("method {method}"), 0x6098, 0, method);
    bench.write("controlword 1Fh: homing starts", 0x6040, 0, 0x1F);
    finish(bench, edge, direction, offset);
}

/// Waits until it is homed, and checks where it stands: at minus the offset, on the switch, whose edge was met in `direction`.
fn finish(bench: &mut Bench, edge: f64, direction: f64, offset: i64) {
    bench.run_ms(20);
    bench.expect_status("on the way: bits 8, 10, 14", HOMING_BITS, RUNNING);
    let from = shaft(bench);
    bench.run_until(Duration::from_secs(8), |word| word & HOMING_BITS == HOMED);
    let method = bench.read(0x6098, 0).unwrap_or_default();
    bench.mark(format!("homed ({method})"), EventKind::Note);
    bench.run_ms(150);
    let way = shaft(bench) - from;
    bench.moved(format!("{way:+.0} pulses"));
    bench.expect_status("homed", HOMING_BITS, HOMED);
    bench.expect_object(0x6064, 0, Expect::Near(-offset as f64, 0.0), "pulses");
    bench.expect_object(0x2003, 0, Expect::AtLeast(1.0), "on the switch");
    let beyond = (shaft(bench) - edge) * direction;
    bench.expect("beyond the edge", Expect::Near(FILTER_PULSES, 8.0), "pulses", beyond.round());
}

/// Bit 4 falls on the way.
fn interrupted(bench: &mut Bench) {
    start(bench, "controlword 1Fh, on the way", 17);
    bench.write("controlword 0Fh: bit 4 falls", 0x6040, 0, 0x0F);
    bench.run_ms(300);
    bench.expect_status("interrupted", HOMING_BITS, FAILED);
}

/// Bit 8 on the way, and its end.
fn halted(bench: &mut Bench) {
    start(bench, "controlword 1Fh, on the way", 18);
    bench.write("controlword 11Fh: halt", 0x6040, 0, 0x11F);
    bench.run_ms(300);
    bench.expect_object(0x606C, 0, Expect::Near(0.0, 0.0), "r/min");
    bench.write("controlword 1Fh: goes on", 0x6040, 0, 0x1F);
    bench.run_until(Duration::from_secs(6), |word| word & HOMING_BITS == HOMED);
    bench.run_ms(100);
    bench.expect_status("homed", HOMING_BITS, HOMED);
}

/// Method 24 without a home switch turns back at the positive limit and fails at the negative one.
fn failed(bench: &mut Bench) {
    bench.write("X0 has no function", 0x2030, 2, 0);
    start(bench, "method 24 without a home switch", 24);
    bench.run_until(Duration::from_secs(8), |word| word & HOMING_BITS == FAILED);
    bench.mark("homing failed", EventKind::Stop);
    bench.run_ms(100);
    bench.expect_status("failed", HOMING_BITS, FAILED);
    bench.expect_object(0x606C, 0, Expect::Near(0.0, 0.0), "r/min");
}

fn start(bench: &mut Bench, step: &str, method: i64) {
    bench.write("controlword 0Fh", 0x6040, 0, 0x0F);
    bench.write(format!("method {method}"), 0x6098, 0, method);
    bench.write(step, 0x6040, 0, 0x1F);
    bench.run_ms(400);
    bench.expect_status("bits 8, 10, 14", HOMING_BITS, RUNNING);
}

/// Where the shaft truly is, in pulses from where it stood at the start.
fn shaft(bench: &mut Bench) -> f64 {
    bench.report().shaft_angle_rad / TAU * PULSES_PER_TURN
}
