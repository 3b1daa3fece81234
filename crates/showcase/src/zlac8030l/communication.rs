//! Chapter 3: boot-up message, SDO format, heartbeat.

use std::time::Duration;

use can::{CanId, Frame, Instant};

use super::as_delivered::NODE;
use crate::bench::Bench;
use crate::expect::Expect;
use crate::timing::largest_gap_ms;

/// 3.2: "will send a 700+ID NMT message when it is powered on".
pub(super) fn boot_up(bench: &mut Bench) {
    bench.section("3.2", "boot-up");
    bench.step("power on");
    bench.run_silently(Duration::from_secs(1));
    let heard = bench.heard_since(Instant::ZERO, 0x704);
    let first = heard.first().map_or_else(|| "nothing".into(), |(_, frame)| frame.to_string());
    bench.compare("704#00", &first, first == "704#00");
}

/// 3.3: the SDO format, by its own example.
pub(super) fn sdo_format(bench: &mut Bench) {
    bench.section("3.3", "SDO format");
    bench.ask("write 60FFh = 100", "23 FF 60 00 64 00 00 00", "60 FF 60 00 00 00 00 00");
    let target = bench.read_f64(0x60FF, 0);
    bench.expect("60FFh", Expect::Near(100.0, 0.0), "r/min", target);
    bench.ask("write it back to 0", "23 FF 60 00 00 00 00 00", "60 FF 60 00 00 00 00 00");
    bench.ask("read what is not there (1016h)", "40 16 10 00 00 00 00 00", "80 16 10 00 00 00 02 06");
    bench.ask("write what can only be read (1000h)", "23 00 10 00 01 00 00 00", "80 00 10 00 02 00 01 06");
}

/// 3.4: the heartbeat and its states.
pub(super) fn heartbeat(bench: &mut Bench) {
    bench.section("3.4", "heartbeat");
    bench.ask("heartbeat each 1000 ms", "2B 17 10 00 E8 03 00 00", "60 17 10 00 00 00 00 00");
    let begin = bench.now();
    bench.run_silently(Duration::from_millis(5_500));
    let beats = bench.heard_since(begin, 0x700 + u16::from(NODE));
    // "The heartbeat protocol begins immediately" (CiA 301, 7.2.8.3.2.2): at 0, 1, 2, 3, 4 and 5 s.
    bench.expect("heartbeats in 5.5 s", Expect::Near(6.0, 0.0), "", beats.len() as f64);
    let gap_ms = largest_gap_ms(&beats);
    bench.expect("apart", Expect::Near(1000.0, 2.0), "ms", gap_ms);
    for (command, name, state) in [(0x01, "start", 0x05), (0x02, "stop", 0x04), (0x80, "pre-operational", 0x7F)] {
        bench.step(format!("NMT {name}"));
        bench.send(Frame::new(CanId::standard(0), &[command, NODE]));
        let begin = bench.now();
        bench.run_silently(Duration::from_millis(1_010));
        let beats = bench.heard_since(begin, 0x700 + u16::from(NODE));
        let seen = beats.last().map_or(f64::NAN, |(_, frame)| f64::from(frame.padded()[0]));
        bench.expect("heartbeat", Expect::Bits(state), "", seen);
    }
    bench.ask("heartbeat off", "2B 17 10 00 00 00 00 00", "60 17 10 00 00 00 00 00");
}
