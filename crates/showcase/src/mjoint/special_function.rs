//! 2619h, "mode selection" (5.04): duty-cycle speed, the host in control from power-on, an angle to turn to, the brake.
//! "5. Power-on default communication control" is the gear of 0.

use std::time::Duration;

use sim::Brake;

use super::multi_turn::go_to;
use super::steps::{COUNTS_PER_TURN, IN_PLACE_COUNTS, TARGET_REACHED, idle, power_cycle, save};
use crate::bench::Bench;
use crate::expect::Expect;

fn set(bench: &mut Bench, function: i64) {
    bench.write(format!("special function {function}"), 0x2619, 0, function);
    save(bench);
    power_cycle(bench);
}

/// "Speed mode, duty cycle speed regulation (10%~90% for 0~1000RPM)".
pub(super) fn duty_cycle(bench: &mut Bench) {
    bench.section("5.04", "duty");
    // The mode's number is lost in the table; 1 and 3 are the free ones (docs/drives/mjoint.md, J054).
    set(bench, 1);
    for (percent, rpm) in [(10, 0.0), (30, 250.0), (50, 500.0), (90, 1000.0), (10, 0.0)] {
        bench.step(format!("duty cycle {percent} %"));
        bench.machine(&format!("duty {percent}"));
        bench.run_ms(400);
        let speed = bench.report().velocity_rpm;
        bench.moved(format!("{speed:.1} r/min"));
        bench.expect("speed", Expect::Near(rpm, 8.0), "r/min", speed);
    }
}

/// Special function 9 and a gear of 0: CANopen from power-on, "pulse is invalid".
pub(super) fn communication_control(bench: &mut Bench) {
    bench.section("debug 5", "host control");
    set(bench, 9);
    ignores_pulses(bench);
    bench.write("special function 0", 0x2619, 0, 0);
    bench.write("electronic gear molecule 0", 0x260A, 0, 0);
    save(bench);
    power_cycle(bench);
    bench.ask("modbus enable is 1", "40 00 26 00", "4B 00 26 00 01 00");
    ignores_pulses(bench);
    bench.write("electronic gear molecule 32768", 0x260A, 0, 32_768);
    save(bench);
}

fn ignores_pulses(bench: &mut Bench) {
    bench.step("1000 pulses");
    let from = bench.report().position as f64;
    bench.machine("pulses 1000 10000");
    bench.run_ms(300);
    let way = bench.report().position as f64 - from;
    bench.expect("way", Expect::Near(0.0, 2.0), "counts", way);
}

/// 30 to 32768: the angle that is turned to after power-on, x · 360° / 32768.
pub(super) fn angle(bench: &mut Bench) {
    bench.section("5.04", "angle");
    let turns = 2.0 * COUNTS_PER_TURN;
    go_to(bench, turns as i64 + 1000);
    idle(bench);
    set(bench, 16_384);
    bench.step("turns to 180° of its turn");
    bench.aim_at(turns + 16_384.0);
    bench.run_until(Duration::from_secs(3), |word| word & TARGET_REACHED != 0);
    bench.expect_object(0x6064, 0, Expect::Near(turns + 16_384.0, IN_PLACE_COUNTS), "counts");
    bench.aim_at_nothing();
}

/// 7: "with brake motor", and 8, which returns to the origin as well.
pub(super) fn brake(bench: &mut Bench) {
    bench.section("5.04", "brake");
    set(bench, 7);
    expect_brake(bench, "after power-on", Brake::Engaged);
    bench.write("enable", 0x6040, 0, 0x0F);
    bench.run_ms(5);
    expect_brake(bench, "while the motor has power", Brake::Released);
    bench.write("power off the motor", 0x6040, 0, 0);
    bench.run_ms(5);
    expect_brake(bench, "without", Brake::Engaged);
    go_to(bench, 3 * COUNTS_PER_TURN as i64);
    idle(bench);
    set(bench, 8);
    bench.step("returns to its origin");
    bench.aim_at(0.0);
    bench.run_ms(50);
    bench.run_until(Duration::from_secs(5), |word| word & TARGET_REACHED != 0);
    bench.expect_object(0x6064, 0, Expect::Near(0.0, IN_PLACE_COUNTS), "counts");
    bench.aim_at_nothing();
    bench.write("special function 0", 0x2619, 0, 0);
    save(bench);
    power_cycle(bench);
}

fn expect_brake(bench: &mut Bench, when: &str, state: Brake) {
    bench.step(format!("brake {when}"));
    let seen = bench.report().brake;
    let word = |brake: Brake| if brake == Brake::Engaged { "engaged" } else { "released" };
    bench.compare(word(state), seen.map_or("none", word), seen == Some(state));
}
