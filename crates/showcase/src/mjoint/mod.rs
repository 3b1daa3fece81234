//! Every procedure of the M joint's manual ("M Robot Joint Motor CanOpen Manual").
//!
//! Chapters without a number go by a word of their title: "wiring 2" is "2. Command pulse + direction position control
//! mode" of the wiring chapter.

mod alarms;
mod communication;
mod homing;
mod motion;
mod multi_turn;
mod pdo;
mod pulses;
mod special_function;

use std::time::Duration;

use super::bench::Bench;
use super::expect::Expect;

/// Counts in a turn of the motor: 15 bits (parameter tables).
pub(super) const COUNTS_PER_TURN: f64 = 32_768.0;

/// How near to a target the motor comes to rest, counts: a third of a degree of the motor's shaft.
pub(super) const IN_PLACE_COUNTS: f64 = 30.0;

const TARGET_REACHED: u16 = 1 << 10;
const ALARM: u16 = 1 << 3;

/// All of it. What has to be set and restarted comes last, so that the worked examples find the joint as delivered.
pub(super) fn procedures(bench: &mut Bench) {
    communication::boot_up(bench);
    communication::device_information(bench);
    communication::sdo_format(bench);
    motion::absolute(bench);
    motion::relative(bench);
    motion::incremental(bench);
    motion::speed(bench);
    motion::readings(bench);
    communication::registers(bench);
    communication::nmt(bench);
    pdo::parameters(bench);
    pdo::synchronised(bench);
    pdo::absolute(bench);
    pdo::speed(bench);
    homing::all(bench);
    communication::host_heartbeat(bench);
    alarms::all(bench);
    multi_turn::zero_setting(bench);
    multi_turn::known_after_power_on(bench);
    multi_turn::origin_signal(bench);
    multi_turn::return_to_origin(bench);
    pulses::pulse_and_direction(bench);
    pulses::internal_curve(bench);
    pulses::quadrature(bench);
    special_function::duty_cycle(bench);
    special_function::communication_control(bench);
    special_function::angle(bench);
    special_function::brake(bench);
    communication::address(bench);
}

/// Counts a second at a speed in r/min.
fn counts_s(rpm: f64) -> f64 {
    rpm / 60.0 * COUNTS_PER_TURN
}

/// The time of a move with ramps: the way at full speed, and the speed over the acceleration.
fn move_time_s(counts: f64, rpm: f64, rpm_s: f64) -> f64 {
    counts.abs() / counts_s(rpm) + rpm / rpm_s
}

/// Waits for bit 10; says what moved since `from`, and checks where and when it ended.
fn until_reached(bench: &mut Bench, goal: f64, from: f64, time_s: f64) {
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
fn expect_time(bench: &mut Bench, what: &str, planned_s: f64, took_s: f64) {
    let settling_s = if bench.model().model.starts_with("m8025") { 0.3 } else { 0.03 };
    bench.expect(what, Expect::Near(planned_s, 0.05 * planned_s + settling_s), "s", took_s);
}

/// Power off the motor, position mode.
fn idle(bench: &mut Bench) {
    bench.aim_at_nothing();
    bench.ask("control word 0: power off the motor", "2B 40 60 00 00 00", "60 40 60 00");
    bench.ask("work mode 1: position", "2F 60 60 00 01", "60 60 60 00");
}

/// "Parameter save and send 1 (after the parameter is saved and sent 1, it will display 2)".
fn save(bench: &mut Bench) {
    bench.ask("save: 2614h = 1", "2B 14 26 00 01 00", "60 14 26 00");
    bench.run_ms(5);
    bench.ask("saved: 2614h shows 2", "40 14 26 00", "4B 14 26 00 02 00");
}

/// Supply off and on, and the boot-up message after it.
fn power_cycle(bench: &mut Bench) {
    bench.step("restart");
    let begin = bench.now();
    bench.machine("power off");
    bench.run_ms(200);
    bench.machine("power on");
    bench.run_ms(10);
    let heard = !bench.heard_since(begin, 0x701).is_empty();
    bench.compare("701#00", if heard { "701#00" } else { "nothing" }, heard);
}
