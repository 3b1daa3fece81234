//! 5.2: boot-up, NMT, heartbeat, the SDO commands; 4.1 and 5.4: node number and bit rate.

use std::time::Duration;

use can::Instant;

use crate::bench::Bench;
use crate::datagram::frame;
use crate::expect::Expect;
use crate::timing::largest_gap_ms;

/// 5.2, NMT: a Boot-Up message after initialisation.
pub(super) fn boot_up(bench: &mut Bench) {
    bench.section("5.2", "boot-up");
    bench.step("power on");
    bench.run_silently(Duration::from_millis(500));
    let heard = bench.heard_since(Instant::ZERO, 0x701);
    let first = heard.first().map_or_else(|| "nothing".into(), |(_, frame)| frame.to_string());
    bench.compare("701#00", &first, first == "701#00");
    bench.expect("and nothing else", Expect::Near(1.0, 0.0), "frame", heard.len() as f64);
    // 3.4: green while there is power, red for faults.
    let lights = (bench.output("GREEN"), bench.output("RED"));
    bench.compare(
        "green on, red off",
        format!("green {}, red {}", on(lights.0), on(lights.1)),
        lights == (true, false),
    );
}

fn on(level: bool) -> &'static str {
    if level { "on" } else { "off" }
}

/// 5.4: what the drive says it is, and its predefined identifiers.
pub(super) fn identity(bench: &mut Bench) {
    bench.section("5.4", "identity");
    bench.ask("device type 00040192h", "40 00 10 00 00 00 00 00", "43 00 10 00 92 01 04 00");
    bench.ask("vendor ID 0100h", "40 18 10 01 00 00 00 00", "43 18 10 01 00 01 00 00");
    bench.ask("product code 0001h", "40 18 10 02 00 00 00 00", "43 18 10 02 01 00 00 00");
    bench.ask("SYNC 80h", "40 05 10 00 00 00 00 00", "43 05 10 00 80 00 00 00");
    bench.ask("EMCY 80h + node", "40 14 10 00 00 00 00 00", "43 14 10 00 81 00 00 00");
    bench.ask("SDO from the client 600h + node", "40 00 12 01 00 00 00 00", "43 00 12 01 01 06 00 00");
    bench.ask("SDO to the client 580h + node", "40 00 12 02 00 00 00 00", "43 00 12 02 81 05 00 00");
    bench.ask("node number", "40 00 20 00 00 00 00 00", "4B 00 20 00 01 00 00 00");
}

/// 5.2, the table of commands, expedited; then the normal (segmented) protocol with the same object.
pub(super) fn sdo_commands(bench: &mut Bench) {
    bench.section("5.2", "SDO");
    bench.ask("2F: write one byte", "2F 98 60 00 12 00 00 00", "60 98 60 00 00 00 00 00");
    bench.ask("4F: read one byte", "40 98 60 00 00 00 00 00", "4F 98 60 00 12 00 00 00");
    bench.ask("2B: write two bytes", "2B 0E 20 00 05 00 00 00", "60 0E 20 00 00 00 00 00");
    bench.ask("4B: read two bytes", "40 0E 20 00 00 00 00 00", "4B 0E 20 00 05 00 00 00");
    bench.ask("23: write four bytes", "23 7A 60 00 80 0C 00 00", "60 7A 60 00 00 00 00 00");
    bench.ask("43: read four bytes", "40 7A 60 00 00 00 00 00", "43 7A 60 00 80 0C 00 00");
    bench.ask("27: three bytes are too short for it", "27 7A 60 00 80 0C 00 00", "80 7A 60 00 13 00 07 06");
    bench.ask("80: read what is not there (1016h)", "40 16 10 00 00 00 00 00", "80 16 10 00 00 00 02 06");
    bench.ask("80: write what can only be read", "23 64 60 00 01 00 00 00", "80 64 60 00 02 00 01 06");
    bench.ask("normal: write, four bytes follow", "21 7A 60 00 04 00 00 00", "60 7A 60 00 00 00 00 00");
    bench.ask("normal: the four bytes (5000)", "07 88 13 00 00 00 00 00", "20 00 00 00 00 00 00 00");
    bench.ask("read it", "40 7A 60 00 00 00 00 00", "43 7A 60 00 88 13 00 00");
}

/// 5.2, NMT and heartbeat.
pub(super) fn heartbeat(bench: &mut Bench) {
    bench.section("5.2", "NMT, heartbeat");
    bench.ask("heartbeat each 500 ms (1017h)", "2B 17 10 00 F4 01 00 00", "60 17 10 00 00 00 00 00");
    let begin = bench.now();
    bench.run_ms(2_200);
    bench.expect("apart", Expect::Near(500.0, 2.0), "ms", largest_gap_ms(&bench.heard_since(begin, 0x701)));
    let commands = [("start", "000 01 01", 0x05), ("stop", "000 02 01", 0x04), ("pre-operational", "000 80 01", 0x7F)];
    for (name, command, state) in commands {
        bench.step(format!("NMT {name}"));
        bench.send(frame(command));
        expect_last(bench, 510, "heartbeat", state);
    }
    bench.ask("heartbeat off", "2B 17 10 00 00 00 00 00", "60 17 10 00 00 00 00 00");
    for (name, command) in [("reset node", "000 81 01"), ("reset communication", "000 82 01")] {
        bench.step(format!("NMT {name}"));
        bench.send(frame(command));
        expect_last(bench, 200, "boot-up", 0x00);
    }
}

fn expect_last(bench: &mut Bench, ms: u64, what: &str, state: u32) {
    // The answer to a reset may come within the time that sending takes.
    let begin = bench.now();
    bench.run_ms(ms);
    let since = Instant::from_nanos(begin.as_nanos().saturating_sub(2_000_000));
    let seen = bench.heard_since(since, 0x701).last().map_or(f64::NAN, |(_, frame)| f64::from(frame.padded()[0]));
    bench.expect(what, Expect::Bits(state), "", seen);
}

/// 4.1: the switches decide over 2008h; 5.4: 2009h = 2 is 250 kbit/s after a restart, off this bus.
pub(super) fn node_and_bit_rate(bench: &mut Bench) {
    bench.section("4.1", "node number");
    bench.write("custom node number 42 (2008h)", 0x2008, 0, 42);
    bench.run_ms(200);
    expect_boot_up(bench, "restart: the switches say 1", 1);
    bench.section("5.4", "bit rate");
    bench.write("bit rate 2: 250 kbit/s (2009h)", 0x2009, 0, 2);
    bench.run_ms(200);
    expect_boot_up(bench, "restart: not on a bus of 500 kbit/s", 0);
}

fn expect_boot_up(bench: &mut Bench, step: &str, messages: usize) {
    bench.step(step);
    let begin = bench.now();
    bench.machine("power off");
    bench.run_ms(200);
    bench.machine("power on");
    bench.run_ms(100);
    let heard = bench.heard_since(begin, 0x701).len();
    bench.expect("701#00", Expect::Near(messages as f64, 0.0), "heard", heard as f64);
}
