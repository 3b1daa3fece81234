//! 4.1, 4.6 and 7.1: profile velocity mode, its statusword, and the emergency stop.

use std::time::Duration;

use super::as_delivered::COUNTS_PER_TURN;
use crate::bench::Bench;
use crate::expect::Expect;
use plot::EventKind;

/// Acceleration and deceleration time as delivered (6083h, 6084h), s: from the present speed to the target.
const RAMP_S: f64 = 0.5;

/// How long each target is held after it was given.
const HOLD: Duration = Duration::from_millis(1500);

/// Controlwords and the low four bits of the statusword that 7.1 prints for them.
pub(super) const ENABLE: [(&str, u16); 3] =
    [("2B 40 60 00 06 00 00 00", 0x1), ("2B 40 60 00 07 00 00 00", 0x3), ("2B 40 60 00 0F 00 00 00", 0x7)];

/// 4.1 with the statuswords of 7.1.
pub(super) fn profile_velocity(bench: &mut Bench) {
    bench.section("4.1", "profile velocity");
    bench.ask("velocity mode", "2F 60 60 00 03 00 00 00", "60 60 60 00 00 00 00 00");
    enable(bench);
    let targets = [
        (100.0, "23 FF 60 00 64 00 00 00"),
        (-100.0, "23 FF 60 00 9C FF FF FF"),
        (50.0, "23 FF 60 00 32 00 00 00"),
        (-50.0, "23 FF 60 00 CE FF FF FF"),
    ];
    let mut before_rpm = 0.0;
    for (target_rpm, request) in targets {
        drive_at(bench, before_rpm, target_rpm, request);
        before_rpm = target_rpm;
    }
}

/// The three steps to Operation enabled, with the statusword's low bits as 7.1 prints them.
pub(super) fn enable(bench: &mut Bench) {
    for (request, nibble) in ENABLE {
        bench.ask(format!("enable: controlword {}h", &request[12..14]), request, "60 40 60 00 00 00 00 00");
        bench.run(Duration::from_millis(20));
        let word = bench.statusword().unwrap_or_default();
        bench.expect("6041h bits 0-3", Expect::Bits(u32::from(nibble)), "", f64::from(word & 0xF));
    }
}

/// The same three steps as one row, where they have been shown before.
pub(super) fn enable_again(bench: &mut Bench) {
    bench.step("enable (06h, 07h, 0Fh)");
    let mut nibbles = Vec::new();
    for (request, _) in ENABLE {
        bench.send_sdo(request);
        bench.run(Duration::from_millis(20));
        nibbles.push(format!("{:X}", bench.statusword().unwrap_or_default() & 0xF));
    }
    let seen = nibbles.join(", ");
    let ok = seen == "1, 3, 7";
    bench.compare("6041h bits 0-3 1, 3, 7", seen, ok);
}

/// Gives a target velocity; checks the speed reached and the way made by then.
fn drive_at(bench: &mut Bench, before_rpm: f64, target_rpm: f64, request: &str) {
    let from = bench.report().position as f64;
    bench.ask(format!("target {target_rpm} r/min"), request, "60 FF 60 00 00 00 00 00");
    bench.run(HOLD);
    let way = bench.report().position as f64 - from;
    let hold_s = HOLD.as_secs_f64();
    let way_turns = way_turns(before_rpm, target_rpm, hold_s);
    let reference_turns = target_rpm.abs() / 60.0 * hold_s;
    bench.moved(format!("{way:.0} counts in {hold_s} s"));
    bench.expect(
        "way",
        Expect::Near((way_turns * COUNTS_PER_TURN).round(), (0.03 * reference_turns * COUNTS_PER_TURN).round()),
        "counts",
        way,
    );
    // 606Ch is in 0.1 r/min; the manual's finest step of a target is 1 r/min.
    let speed = bench.read_f64(0x606C, 0) / 10.0;
    bench.expect("606Ch", Expect::Near(target_rpm, 1.0), "r/min", speed);
    bench.step_in("7.1", format!("statusword at {target_rpm} r/min"));
    let word = bench.statusword().unwrap_or_default();
    // Bit 5 no emergency stop, 10 in place, 12 speed is 0, 14 running, 15 external stop.
    bench.expect("bits 5, 10, 12, 14, 15", Expect::Bits(0x4420), "", f64::from(word & 0xD420));
}

/// Turns made in a time from one speed to another. An S-shaped ramp is symmetric: its mean speed is that of its ends.
fn way_turns(before_rpm: f64, target_rpm: f64, time_s: f64) -> f64 {
    if before_rpm * target_rpm < 0.0 {
        // A reversal is two changes: to a stop in 6084h, and up again in 6083h.
        let ramps = (before_rpm + target_rpm) / 2.0 * RAMP_S;
        return (ramps + target_rpm * (time_s - 2.0 * RAMP_S)) / 60.0;
    }
    ((before_rpm + target_rpm) / 2.0 * RAMP_S + target_rpm * (time_s - RAMP_S)) / 60.0
}

/// 4.6: emergency stop by controlword 2, and its release.
pub(super) fn emergency_stop(bench: &mut Bench) {
    bench.section("4.6", "emergency stop");
    bench.ask("target 100 r/min", "23 FF 60 00 64 00 00 00", "60 FF 60 00 00 00 00 00");
    bench.run(HOLD);
    bench.mark("emergency stop (controlword 02h)", EventKind::Stop);
    let from = bench.report().position as f64;
    bench.ask("emergency stop", "2B 40 60 00 02 00 00 00", "60 40 60 00 00 00 00 00");
    bench.run(Duration::from_millis(1_000));
    let way = bench.report().position as f64 - from;
    bench.moved(format!("{way:.0} counts to a stop"));
    // 605Ah = 5 stops normally, in 6084h = 500 ms: half the speed times the time.
    let way_counts = 100.0 / 60.0 / 2.0 * RAMP_S * COUNTS_PER_TURN;
    bench.expect("way", Expect::Near(way_counts.round(), (0.1 * way_counts).round()), "counts", way);
    let speed = bench.read_f64(0x606C, 0) / 10.0;
    bench.expect("speed", Expect::Near(0.0, 1.0), "r/min", speed);
    let word = bench.statusword().unwrap_or_default();
    bench.expect("6041h bits 0-3, 5", Expect::Bits(0x07), "", f64::from(word & 0x2F));
    bench.mark("released (0Fh)", EventKind::Note);
    bench.ask("release", "2B 40 60 00 0F 00 00 00", "60 40 60 00 00 00 00 00");
    bench.run(HOLD);
    let word = bench.statusword().unwrap_or_default();
    bench.expect("6041h bits 0-3, 5", Expect::Bits(0x27), "", f64::from(word & 0x2F));
    let speed = bench.read_f64(0x606C, 0) / 10.0;
    bench.expect("speed", Expect::Near(100.0, 1.0), "r/min", speed);
}

/// 4.5: "stop" takes the power off the motor.
pub(super) fn stop(bench: &mut Bench) {
    bench.section("4.5", "general commands");
    bench.mark("stop (controlword 00h)", EventKind::Stop);
    bench.ask("stop", "2B 40 60 00 00 00 00 00", "60 40 60 00 00 00 00 00");
    bench.run(Duration::from_millis(100));
    let word = bench.statusword().unwrap_or_default();
    bench.expect("6041h bits 0-3", Expect::Bits(0), "", f64::from(word & 0xF));
    let current = bench.report().current_a;
    bench.expect("current", Expect::Near(0.0, 0.05), "A", current);
    bench.run(Duration::from_millis(1_000));
    bench.ask("target 0 r/min", "23 FF 60 00 00 00 00 00", "60 FF 60 00 00 00 00 00");
}

/// 4.5: the values that can be read, against what is measured at the machine.
pub(super) fn readings(bench: &mut Bench) {
    let report = bench.report();
    let values = [
        ("encoder", 0x6064, 0, "counts", 1.0, report.position as f64, 1.0),
        ("speed", 0x606C, 0, "r/min", 0.1, report.velocity_rpm, 1.0),
        ("current", 0x6077, 0, "A", 0.1, report.current_a, 0.1),
        ("fault code", 0x603F, 0, "", 1.0, 0.0, 0.0),
        ("motor temperature", 0x2026, 1, "°C", 0.1, report.motor_c.unwrap_or(f64::NAN), 0.5),
    ];
    for (name, index, sub_index, unit, per_count, true_value, tolerance) in values {
        bench.step(format!("read {name} ({index:04X}h)"));
        let read = bench.read_f64(index, sub_index) * per_count;
        bench.expect("", Expect::Near(true_value, tolerance), unit, read);
    }
    bench.step("read software version (2025h)");
    let version = bench.read(0x2025, 0);
    bench.compare("a number", version.map_or_else(|| "nothing".into(), |v| format!("{v:04X}h")), version.is_some());
}
