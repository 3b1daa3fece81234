//! The alarm table ("3. Status indication and alarm"): each alarm provoked, seen in 260Eh, the status word, the heartbeat
//! and the red light, and cleared as the table says. Alarm 20h is with the host's heartbeat, 10h with the multi-turn origin.

use std::time::Duration;

use super::steps::{ALARM, idle};
use crate::bench::Bench;
use crate::expect::Expect;
use crate::lights::red_flashes;
use plot::EventKind;

/// A flash that lasts this long is a long one. The table does not print times.
const LONG: Duration = Duration::from_millis(500);

/// The table of alarms that stop the motor.
pub(super) fn all(bench: &mut Bench) {
    bench.section("interface 3", "alarms");
    expect_green(bench, "always bright", Expect::Near(0.0, 0.0));
    locked_rotor(bench);
    stall(bench);
    over_voltage(bench);
    idle(bench);
}

fn locked_rotor(bench: &mut Bench) {
    bench.write("3 A for 2 s at most (261Dh)", 0x261D, 0, 3002);
    run_at_300(bench);
    bench.step("locked rotor");
    let healthy = !bench.output("WR");
    bench.compare("alarm output off", if healthy { "off" } else { "on" }, healthy);
    bench.machine("rotor lock");
    bench.run_ms(300);
    let current = bench.report().current_a;
    bench.expect("current", Expect::Near(3.0, 0.1), "A", current);
    // The deviation has to grow before the current is at its limit.
    expect_alarm(bench, 0x12, "locked rotor (12h)", 2.0 - 0.3);
    let alarmed = bench.output("WR");
    bench.compare("alarm output on", if alarmed { "on" } else { "off" }, alarmed);
    expect_flashes(bench, 1, 2);
    expect_heartbeat_04(bench);
    bench.machine("rotor free");
    bench.write("control word bit 7: clear", 0x6040, 0, 0x80);
    bench.expect_object(0x260E, 0, Expect::Bits(0), "");
    bench.write("10 A for 5 s (261Dh)", 0x261D, 0, 10_005);
}

fn stall(bench: &mut Bench) {
    bench.write("10 % output for 1 s at most (2618h)", 0x2618, 0, 101);
    run_at_300(bench);
    bench.step("stall");
    bench.machine("rotor lock");
    // The motor swings on the gear's spring for half a second before it stands.
    expect_alarm(bench, 0x14, "stall (14h)", 1.0 + 0.5);
    expect_flashes(bench, 1, 4);
    bench.machine("rotor free");
    bench.write("2601h: output forbidden", 0x2601, 0, 0);
    bench.write("2601h: EN enable 1 clears", 0x2601, 0, 1);
    bench.expect_object(0x260E, 0, Expect::Bits(0), "");
    bench.run_ms(300);
    let speed = bench.report().velocity_rpm;
    bench.moved(format!("{speed:.1} r/min"));
    bench.expect("runs again", Expect::Near(300.0, 10.0), "r/min", speed);
    bench.write("60.0 % output for 5 s (2618h)", 0x2618, 0, 605);
}

fn over_voltage(bench: &mut Bench) {
    bench.step("51.5 V");
    bench.machine("supply 51.5");
    bench.run_ms(300);
    bench.expect_object(0x260E, 0, Expect::Bits(0), "");
    bench.step("53 V: over 52 V");
    bench.machine("supply 53");
    expect_alarm(bench, 0x15, "over-voltage (15h)", 0.1);
    expect_flashes(bench, 1, 5);
    bench.write("control word bit 7 while it lasts", 0x6040, 0, 0x8F);
    bench.expect_object(0x260E, 0, Expect::Bits(0x15), "");
    bench.machine("supply 36");
    bench.run_ms(200);
    bench.write("control word without bit 7", 0x6040, 0, 0x0F);
    bench.write("control word bit 7: clear", 0x6040, 0, 0x8F);
    bench.expect_object(0x260E, 0, Expect::Bits(0), "");
    bench.write("0 r/min", 0x60FF, 0, 0);
    bench.run_ms(300);
}

fn run_at_300(bench: &mut Bench) {
    bench.write("speed mode", 0x6060, 0, 3);
    bench.write("300 r/min", 0x60FF, 0, 300);
    bench.write("enable", 0x6040, 0, 0x0F);
    bench.run_ms(300);
    let speed = bench.report().velocity_rpm;
    bench.moved(format!("{speed:.1} r/min"));
    bench.expect("speed", Expect::Near(300.0, 5.0), "r/min", speed);
}

/// Waits for an alarm and checks when it came, its code, and that the motor has no power.
fn expect_alarm(bench: &mut Bench, code: u32, label: &str, after_s: f64) {
    let begin = bench.now();
    bench.run_until(Duration::from_secs(4), |word| word & ALARM != 0);
    let seen_s = (bench.now() - begin).as_secs_f64();
    bench.mark(label, EventKind::Fault);
    bench.expect("alarm after", Expect::Near(after_s, 0.25), "s", seen_s);
    bench.expect_object(0x260E, 0, Expect::Bits(code), "");
    bench.run_ms(100);
    let current = bench.report().current_a;
    bench.expect("downtime: current", Expect::Near(0.0, 0.05), "A", current);
}

/// "04 represents alarm" (5.11.1).
pub(super) fn expect_heartbeat_04(bench: &mut Bench) {
    let begin = bench.now();
    bench.unseen(|bench| bench.run_ms(1_010));
    let beats = bench.heard_since(begin, 0x701);
    let seen = beats.last().map_or(f64::NAN, |(_, frame)| f64::from(frame.padded()[0]));
    bench.expect("heartbeat", Expect::Bits(4), "", seen);
}

/// Counts how often the green light changes in a second: not at all while the battery is charged, often while there is none.
pub(super) fn expect_green(bench: &mut Bench, how: &str, changes: Expect) {
    const LOOKS: u32 = 200;
    bench.step(format!("green light {how}"));
    let mut lit = bench.output("GREEN");
    let on = lit;
    let mut seen = 0;
    for _ in 0..LOOKS {
        bench.unseen(|bench| bench.run_ms(5));
        let now = bench.output("GREEN");
        seen += u32::from(now != lit);
        lit = now;
    }
    bench.expect("changes in 1 s", changes, "", seen.into());
    if seen == 0 {
        bench.compare("on", if on { "on" } else { "off" }, on);
    }
}

/// Watches one whole round of the red light.
pub(super) fn expect_flashes(bench: &mut Bench, long: usize, short: usize) {
    let seen = red_flashes(bench);
    let (seen_long, seen_short) =
        (seen.iter().filter(|on| **on >= LONG).count(), seen.iter().filter(|on| **on < LONG).count());
    let words = |long: usize, short: usize| format!("red {long} long {short} short");
    bench.compare(words(long, short), words(seen_long, seen_short), (seen_long, seen_short) == (long, short));
}
