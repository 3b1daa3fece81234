//! Chapter 5: alarm PWM, parking, speed resolution, I/O emergency stop, brake.

use std::time::Duration;

use sim::Brake;

use super::velocity::enable_again;
use crate::bench::Bench;
use crate::expect::Expect;
use plot::EventKind;

const SAVE: (&str, &str) = ("2B 09 20 00 02 00 00 00", "60 09 20 00 00 00 00 00");
const WRITE_OK_202F: &str = "60 2F 20";

/// 5.1: in an alarm the drive shorts the motor's phases, so that the motor brakes instead of rolling on.
pub(super) fn alarm_pwm(bench: &mut Bench) {
    bench.section("5.1", "alarm PWM");
    bench.ask("close", "2B 2F 20 01 00 00 00 00", &format!("{WRITE_OK_202F} 01 00 00 00 00"));
    let rolling_rpm = speed_after_alarm(bench, "alarm while closed");
    bench.ask("open", "2B 2F 20 01 01 00 00 00", &format!("{WRITE_OK_202F} 01 00 00 00 00"));
    bench.ask("save", SAVE.0, SAVE.1);
    let braked_rpm = speed_after_alarm(bench, "alarm while open");
    bench.expect("less than half of", Expect::AtMost(rolling_rpm / 2.0), "r/min", braked_rpm);
    bench.ask("close", "2B 2F 20 01 00 00 00 00", &format!("{WRITE_OK_202F} 01 00 00 00 00"));
}

/// The speed that is left of 100 r/min 300 ms after an alarm.
fn speed_after_alarm(bench: &mut Bench, step: &str) -> f64 {
    run_at_100(bench);
    bench.step(step);
    bench.mark("Hall alarm", EventKind::Fault);
    bench.machine("fault hall on");
    bench.run(Duration::from_millis(300));
    let left = bench.report().velocity_rpm.abs();
    bench.moved(format!("{left:.1} r/min after 0.3 s"));
    bench.machine("fault hall off");
    bench.run(Duration::from_millis(1_500));
    clear_fault(bench);
    left
}

/// 5.2: in parking mode the motor current does not exceed 3 A.
pub(super) fn parking(bench: &mut Bench) {
    bench.section("5.2", "parking mode");
    bench.ask("open", "2B 2F 20 04 01 00 00 00", &format!("{WRITE_OK_202F} 04 00 00 00 00"));
    bench.machine("rotor lock");
    velocity_mode(bench);
    bench.ask("target 100 r/min, shaft locked", "23 FF 60 00 64 00 00 00", "60 FF 60 00 00 00 00 00");
    let mut largest_a = 0f64;
    for _ in 0..100 {
        bench.run(Duration::from_millis(10));
        largest_a = largest_a.max(bench.report().current_a.abs());
    }
    bench.moved(format!("up to {largest_a:.2} A"));
    bench.expect("current", Expect::AtMost(3.1), "A", largest_a);
    bench.expect("and not less than", Expect::AtLeast(2.5), "A", largest_a);
    bench.ask("target 0 r/min", "23 FF 60 00 00 00 00 00", "60 FF 60 00 00 00 00 00");
    bench.ask("stop", "2B 40 60 00 00 00 00 00", "60 40 60 00 00 00 00 00");
    bench.machine("rotor free");
    bench.ask("close", "2B 2F 20 04 00 00 00 00", &format!("{WRITE_OK_202F} 04 00 00 00 00"));
    bench.run(Duration::from_millis(300));
}

/// 5.3: a finer unit of the target speed, in force after saving and restarting.
pub(super) fn speed_resolution(bench: &mut Bench) {
    bench.section("5.3", "speed resolution");
    for (setting, request, speed_rpm, counts_per_rpm) in [
        ("A", "2B 2F 20 05 0A 00 00 00", 10.0, 10.0),
        ("5", "2B 2F 20 05 05 00 00 00", 20.0, 5.0),
        ("1", "2B 2F 20 05 01 00 00 00", 100.0, 1.0),
    ] {
        bench.ask(format!("resolution {setting}"), request, &format!("{WRITE_OK_202F} 05 00 00 00 00"));
        bench.ask("save", SAVE.0, SAVE.1);
        power_cycle(bench);
        bench.resolve(counts_per_rpm);
        velocity_mode(bench);
        bench.ask("target 100", "23 FF 60 00 64 00 00 00", "60 FF 60 00 00 00 00 00");
        bench.run(Duration::from_millis(1_200));
        let speed = bench.report().velocity_rpm;
        bench.moved(format!("{speed:.2} r/min"));
        bench.expect("speed", Expect::Near(speed_rpm, 0.5), "r/min", speed);
    }
    bench.ask("target 0 r/min", "23 FF 60 00 00 00 00 00", "60 FF 60 00 00 00 00 00");
    bench.run(Duration::from_millis(700));
}

/// 5.4: the external emergency stop at an input, with the shaft locked or released.
pub(super) fn io_stop(bench: &mut Bench) {
    bench.section("5.4", "I/O emergency stop");
    bench.ask("INPUT1 stops", "2B 30 20 02 09 00 00 00", "60 30 20 02 00 00 00 00");
    bench.ask("INPUT2 stops", "2B 30 20 03 09 00 00 00", "60 30 20 03 00 00 00 00");
    bench.ask("save", SAVE.0, SAVE.1);
    for (input, name) in [("X0", "INPUT1"), ("X1", "INPUT2")] {
        run_at_100(bench);
        bench.step(format!("{name} on"));
        bench.mark(format!("{name} on"), EventKind::Stop);
        bench.machine(&format!("input {input} 1"));
        bench.run(Duration::from_millis(1_000));
        let speed = bench.report().velocity_rpm;
        bench.moved(format!("{speed:.1} r/min"));
        bench.expect("speed", Expect::Near(0.0, 1.0), "r/min", speed);
        let word = bench.statusword().unwrap_or_default();
        bench.expect("6041h bits 0-3, 15", Expect::Bits(0x8007), "", f64::from(word & 0x800F));
        bench.step(format!("{name} off"));
        bench.machine(&format!("input {input} 0"));
        bench.run(Duration::from_millis(50));
        let word = bench.statusword().unwrap_or_default();
        bench.expect("6041h bit 15", Expect::Bits(0), "", f64::from(word & 0x8000));
        stop(bench);
    }
    bench.ask("release the shaft", "2B 2F 20 03 01 00 00 00", &format!("{WRITE_OK_202F} 03 00 00 00 00"));
    bench.ask("save", SAVE.0, SAVE.1);
    run_at_100(bench);
    bench.step("INPUT1 on");
    bench.mark("INPUT1 on, shaft released", EventKind::Stop);
    bench.machine("input X0 1");
    bench.run(Duration::from_millis(1_000));
    let current = bench.report().current_a;
    bench.expect("current", Expect::Near(0.0, 0.05), "A", current);
    let word = bench.statusword().unwrap_or_default();
    bench.expect("6041h bits 0-3, 15", Expect::Bits(0x8000), "", f64::from(word & 0x800F));
    bench.machine("input X0 0");
    stop(bench);
    bench.ask("lock the shaft", "2B 2F 20 03 00 00 00 00", &format!("{WRITE_OK_202F} 03 00 00 00 00"));
    bench.ask("save", SAVE.0, SAVE.1);
}

/// 5.5: the brake output.
pub(super) fn brake(bench: &mut Bench) {
    bench.section("5.5", "brake");
    for (name, request, state) in [
        ("close the brake", "2B 30 20 0E 01 00 00 00", Brake::Engaged),
        ("release the brake", "2B 30 20 0E 00 00 00 00", Brake::Released),
    ] {
        bench.ask(name, request, "60 30 20 0E 00 00 00 00");
        bench.run(Duration::from_millis(200));
        let seen = bench.report().brake;
        let word = |brake: Brake| if brake == Brake::Engaged { "engaged" } else { "released" };
        bench.compare(word(state), seen.map_or("none", word), seen == Some(state));
    }
}

/// Supply off and on, and the boot-up message after it.
pub(super) fn power_cycle(bench: &mut Bench) {
    bench.step("restart");
    let begin = bench.now();
    bench.machine("power off");
    bench.run_silently(Duration::from_millis(200));
    bench.machine("power on");
    bench.run_silently(Duration::from_millis(1_000));
    let heard = bench.heard_since(begin, 0x704).len();
    bench.compare("704#00", if heard > 0 { "704#00" } else { "nothing" }, heard > 0);
}

/// 4.5: clears a fault whose cause is gone.
pub(super) fn clear_fault(bench: &mut Bench) {
    bench.ask("clear fault", "2B 40 60 00 80 00 00 00", "60 40 60 00 00 00 00 00");
    bench.run(Duration::from_millis(20));
    let code = bench.read_f64(0x603F, 0);
    bench.expect("603Fh", Expect::Bits(0), "", code);
    bench.ask("target 0 r/min", "23 FF 60 00 00 00 00 00", "60 FF 60 00 00 00 00 00");
}

/// Velocity mode, enabled.
pub(super) fn velocity_mode(bench: &mut Bench) {
    bench.ask("velocity mode", "2F 60 60 00 03 00 00 00", "60 60 60 00 00 00 00 00");
    enable_again(bench);
}

/// Enabled and turning at 100 r/min.
pub(super) fn run_at_100(bench: &mut Bench) {
    velocity_mode(bench);
    bench.ask("target 100 r/min", "23 FF 60 00 64 00 00 00", "60 FF 60 00 00 00 00 00");
    bench.run(Duration::from_millis(800));
    let speed = bench.report().velocity_rpm;
    bench.moved(format!("{speed:.1} r/min"));
    bench.expect("speed", Expect::Near(100.0, 1.0), "r/min", speed);
}

/// Target 0, then the power off the motor.
pub(super) fn stop(bench: &mut Bench) {
    bench.ask("target 0 r/min", "23 FF 60 00 00 00 00 00", "60 FF 60 00 00 00 00 00");
    bench.run(Duration::from_millis(700));
    bench.ask("stop", "2B 40 60 00 00 00 00 00", "60 40 60 00 00 00 00 00");
}
