//! Figures and steps that several procedures of the joint share.

use std::time::Duration;

use crate::bench::Bench;
use crate::expect::Expect;

/// Counts in a turn of the motor: 15 bits (parameter tables).
pub(crate) const COUNTS_PER_TURN: f64 = 32_768.0;

/// How near to a target the motor comes to rest, counts: a third of a degree of the motor's shaft.
pub(crate) const IN_PLACE_COUNTS: f64 = 30.0;

pub(super) const TARGET_REACHED: u16 = 1 << 10;
pub(super) const ALARM: u16 = 1 << 3;

/// Counts a second at a speed in r/min.
pub(super) fn counts_s(rpm: f64) -> f64 {
    rpm / 60.0 * COUNTS_PER_TURN
}

/// The time of a move with ramps: the way at full speed, and the speed over the acceleration.
pub(super) fn move_time_s(counts: f64, rpm: f64, rpm_s: f64) -> f64 {
    counts.abs() / counts_s(rpm) + rpm / rpm_s
}

/// Waits for bit 10; says what moved since `from`, and checks where and when it ended.
pub(super) fn until_reached(bench: &mut Bench, goal: f64, from: f64, time_s: f64) {
    let begin = bench.now();
    bench.aim_at(goal);
    bench.run_until(Duration::from_secs_f64(time_s * 1.5 + 1.0), |word| word & TARGET_REACHED != 0);
    let took_s = (bench.now() - begin).as_secs_f64();
    bench.run_ms(100);
    let position = bench.report().position as f64;
    bench.moved(format!("{:+.0} counts in {took_s:.2} s", position - from));
    bench.expect("at", Expect::Near(goal, IN_PLACE_COUNTS), "counts", position);
    expect_time(bench, "after", time_s, took_s);
}

/// How long a move took, beside its plan. How long the loops take to settle at its end the manual does not print. The
/// M8025's rotor is 2.5 times as heavy as the M4230's, with the same gains as delivered.
pub(super) fn expect_time(bench: &mut Bench, what: &str, planned_s: f64, took_s: f64) {
    let settling_s = if bench.model().name.starts_with("m8025") { 0.3 } else { 0.03 };
    bench.expect(what, Expect::Near(planned_s, 0.05 * planned_s + settling_s), "s", took_s);
}

/// Power off the motor, position mode.
pub(super) fn idle(bench: &mut Bench) {
    bench.aim_at_nothing();
    bench.ask("control word 0: power off the motor", "2B 40 60 00 00 00", "60 40 60 00");
    bench.ask("work mode 1: position", "2F 60 60 00 01", "60 60 60 00");
}

/// "Parameter save and send 1 (after the parameter is saved and sent 1, it will display 2)".
pub(super) fn save(bench: &mut Bench) {
    bench.ask("save: 2614h = 1", "2B 14 26 00 01 00", "60 14 26 00");
    bench.run_ms(5);
    bench.ask("saved: 2614h shows 2", "40 14 26 00", "4B 14 26 00 02 00");
}

/// Supply off and on, and the boot-up message after it from the joint as delivered.
pub(super) fn power_cycle(bench: &mut Bench) {
    restart_as(bench, 1);
}

/// Supply off and on, and the boot-up message after it from the address that was saved.
pub(super) fn restart_as(bench: &mut Bench, address: u16) {
    bench.step("restart");
    let begin = bench.now();
    bench.machine("power off");
    bench.run_ms(200);
    bench.machine("power on");
    bench.run_ms(10);
    let id = 0x700 + address;
    let heard = !bench.heard_since(begin, id).is_empty();
    let boot_up = format!("{id:03X}#00");
    bench.compare(&boot_up, if heard { boot_up.as_str() } else { "nothing" }, heard);
}
