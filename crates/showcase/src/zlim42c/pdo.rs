//! 5.2 and 5.4: mapping of PDOs, each way of sending one, SYNC, and RPDOs that take effect at once or with SYNC.

use std::time::Duration;

use super::steps::{enable_in, release};
use crate::bench::Bench;
use crate::datagram::frame;
use crate::expect::Expect;
use crate::timing::{largest_gap_ms, smallest_gap_ms};

const TPDO0: u16 = 0x181;

/// Mapping of 6064h and 606Ch into TPDO0 and of 60FFh into RPDO1, with timer, SYNC and change.
pub(super) fn mapping(bench: &mut Bench) {
    bench.section("5.2", "PDO");
    bench.ask("TPDO0: clear the mapping", "2F 00 1A 00 00 00 00 00", "60 00 1A 00 00 00 00 00");
    bench.ask("map 6064h", "23 00 1A 01 20 00 64 60", "60 00 1A 01 00 00 00 00");
    bench.ask("map 606Ch", "23 00 1A 02 20 00 6C 60", "60 00 1A 02 00 00 00 00");
    bench.ask("two objects", "2F 00 1A 00 02 00 00 00", "60 00 1A 00 00 00 00 00");
    bench.ask("RPDO1: clear the mapping", "2F 01 16 00 00 00 00 00", "60 01 16 00 00 00 00 00");
    bench.ask("map 60FFh", "23 01 16 01 20 00 FF 60", "60 01 16 01 00 00 00 00");
    bench.ask("one object", "2F 01 16 00 01 00 00 00", "60 01 16 00 00 00 00 00");
    by_timer(bench);
    by_sync(bench);
    on_change(bench);
    bench.step("NMT pre-operational: PDOs are silent");
    bench.send(frame("000 80 01"));
    let begin = bench.now();
    bench.run_ms(500);
    let sent = bench.heard_since(begin, TPDO0).len();
    bench.expect("181h", Expect::Near(0.0, 0.0), "frames", sent as f64);
    release(bench);
}

/// Type 255 with an event timer; the unit of 0.5 ms is that of the vendor's other drive.
fn by_timer(bench: &mut Bench) {
    bench.write("TPDO0 type 255", 0x1800, 2, 255);
    bench.write("event timer 100 ms", 0x1800, 5, 200);
    bench.step("NMT start");
    bench.send(frame("000 01 01"));
    let begin = bench.now();
    bench.run_ms(1_050);
    let sent = bench.heard_since(begin, TPDO0);
    bench.expect("181h in 1.05 s", Expect::Near(10.0, 1.0), "frames", sent.len() as f64);
    bench.expect("apart", Expect::Near(100.0, 1.0), "ms", largest_gap_ms(&sent));
    bench.write("event timer off", 0x1800, 5, 0);
}

/// Type 1 sends with each SYNC; an RPDO of type 1 takes effect with it.
fn by_sync(bench: &mut Bench) {
    bench.write("TPDO0 type 1", 0x1800, 2, 1);
    bench.write("RPDO1 type 1", 0x1401, 2, 1);
    enable_in(bench, 3);
    bench.step("RPDO1: 60 r/min, waits for SYNC");
    bench.send(frame("301 3C 00 00 00"));
    bench.expect_object(0x60FF, 0, Expect::Near(0.0, 0.0), "r/min");
    bench.step("SYNC");
    let begin = bench.now();
    bench.send(frame("80"));
    bench.run_ms(5);
    bench.expect_object(0x60FF, 0, Expect::Near(60.0, 0.0), "r/min");
    let sent = bench.heard_since(begin, TPDO0).len();
    bench.expect("181h", Expect::Near(1.0, 0.0), "frame", sent as f64);
    bench.run_ms(300);
    let position = bench.report().position as i32;
    // 100 ms of ramp from 5 to 60 r/min, and the rest at 60 r/min. What SYNC sends holds both values.
    let [a, b, c, d] = position.to_le_bytes();
    let answer = bench.exchange_pdo("SYNC at 60 r/min", "80", "181 .. .. .. .. 3C 00 00 00");
    let sent = answer.map_or(f64::NAN, |frame| {
        let [low, second, third, high, ..] = *frame.padded();
        f64::from(i32::from_le_bytes([low, second, third, high]))
    });
    // A millisecond at 60 r/min is 4 pulses.
    bench.expect("position", Expect::Near(f64::from(i32::from_le_bytes([a, b, c, d])), 8.0), "pulses", sent);
    bench.write("RPDO1 type 255", 0x1401, 2, 255);
    bench.step("RPDO1: 0 r/min, at once");
    bench.send(frame("301 00 00 00 00"));
    bench.expect_object(0x60FF, 0, Expect::Near(0.0, 0.0), "r/min");
    bench.run_ms(200);
}

/// Type 254 or 255 without a timer sends when a value has changed, at most once in the inhibit time.
fn on_change(bench: &mut Bench) {
    bench.write("TPDO0 type 254", 0x1800, 2, 254);
    bench.write("inhibit time 50 ms", 0x1800, 3, 100);
    bench.run_silently(Duration::from_millis(200));
    bench.step("stands: nothing changes");
    let begin = bench.now();
    bench.run_silently(Duration::from_millis(300));
    let sent = bench.heard_since(begin, TPDO0).len();
    bench.expect("181h", Expect::Near(0.0, 0.0), "frames", sent as f64);
    bench.step("RPDO1: 30 r/min");
    let begin = bench.now();
    bench.send(frame("301 1E 00 00 00"));
    bench.run_silently(Duration::from_millis(500));
    let sent = bench.heard_since(begin, TPDO0);
    bench.expect("not closer than", Expect::AtLeast(50.0), "ms", smallest_gap_ms(&sent));
    bench.expect("nor farther than", Expect::AtMost(52.0), "ms", largest_gap_ms(&sent));
    bench.step("RPDO1: 0 r/min");
    bench.send(frame("301 00 00 00 00"));
    bench.run_ms(200);
    bench.expect_object(0x606C, 0, Expect::Near(0.0, 0.0), "r/min");
}
