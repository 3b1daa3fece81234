//! 2.1: the holding torque, and what a drive without an encoder cannot know.

use std::time::Duration;

use super::position::go_to;
use super::steps::{TARGET_REACHED, release};
use crate::bench::Bench;
use crate::expect::Expect;
use plot::EventKind;

/// Holding torque of the 70 mm motor (2.1), N·m.
const HOLDING_NM: f64 = 0.48;

/// The rotor falls back into step by whole electrical turns: four full steps of 1.8°.
const ELECTRICAL_TURN_PULSES: i64 = 80;

/// The rotor is held for a moment on the way: the drive arrives, the rotor does not.
pub(super) fn step_loss(bench: &mut Bench) {
    bench.section("2.1", "open loop");
    bench.write("current 7: 2.2 A (2005h)", 0x2005, 0, 7);
    bench.write("all at rest (2007h)", 0x2007, 0, 1);
    go_to(bench, 0);
    bench.step(format!("{:.2} N·m at rest", 0.9 * HOLDING_NM));
    for part in 1..=20 {
        bench.machine(&format!("load torque {}", 0.9 * HOLDING_NM * f64::from(part) / 20.0));
        bench.run_ms(10);
    }
    let rotor = bench.report().rotor_position.unwrap_or(i64::MAX);
    // Below the holding torque it yields by less than a full step, 20 pulses.
    bench.expect("rotor yields", Expect::Near(0.0, 20.0), "pulses", rotor as f64);
    bench.machine("load torque 0");
    bench.run_ms(200);
    bench.write("target 8000", 0x607A, 0, 8000);
    bench.aim_at(8000.0);
    bench.write("absolute motion, 1Fh", 0x6040, 0, 0x1F);
    bench.run_ms(400);
    bench.step("the rotor is blocked for 0.2 s");
    bench.mark("rotor blocked", EventKind::Note);
    bench.machine("rotor lock");
    bench.run_ms(200);
    bench.machine("rotor free");
    bench.run_until(Duration::from_secs(4), |word| word & TARGET_REACHED != 0);
    bench.run_ms(300);
    bench.expect_object(0x6064, 0, Expect::Near(8000.0, 0.0), "pulses");
    bench.expect_status("reached, no fault: bits 10, 3", 0x0408, 0x0400);
    let lost = 8000 - bench.report().rotor_position.unwrap_or_default();
    bench.moved(format!("{lost} pulses lost"));
    bench.expect("lost", Expect::AtLeast(ELECTRICAL_TURN_PULSES as f64), "pulses", lost as f64);
    let rest = (lost + ELECTRICAL_TURN_PULSES / 2).rem_euclid(ELECTRICAL_TURN_PULSES) - ELECTRICAL_TURN_PULSES / 2;
    bench.expect("and whole electrical turns", Expect::Near(0.0, 4.0), "pulses off", rest as f64);
    bench.write("current 3 (2005h)", 0x2005, 0, 3);
    bench.write("half at rest (2007h)", 0x2007, 0, 0);
    release(bench);
}
