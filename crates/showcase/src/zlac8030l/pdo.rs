//! Chapter 6: PDO mapping, event and timer triggered TPDOs, RPDOs, NMT start and "close".

use std::time::Duration;

use can::{CanId, Frame};

use super::as_delivered::NODE;
use super::functions::{stop, velocity_mode};
use crate::bench::Bench;
use crate::expect::Expect;
use crate::timing::{largest_gap_ms, smallest_gap_ms};

const TPDO0: u16 = 0x180 + NODE as u16;

/// 6.1: 606Ch in TPDO0, event triggered with inhibit time, then timer triggered.
pub(super) fn tpdo(bench: &mut Bench) {
    bench.section("6.1", "TPDO mapping");
    map(
        bench,
        &[("event trigger (254)", "2F 00 18 02 FE 00 00 00"), ("inhibit time 500 ms", "2B 00 18 03 E8 03 00 00")],
    );
    nmt(bench, "start node 4", 0x01, NODE);
    velocity_mode(bench);
    bench.ask("target 100 r/min", "23 FF 60 00 64 00 00 00", "60 FF 60 00 00 00 00 00");
    let begin = bench.now();
    bench.run(Duration::from_millis(2_000));
    let sent = bench.heard_since(begin, TPDO0);
    bench.expect("184h in 2 s, on change", Expect::Near(4.0, 1.0), "frames", sent.len() as f64);
    bench.expect("not closer than", Expect::AtLeast(500.0), "ms", smallest_gap_ms(&sent));
    stop(bench);
    nmt(bench, "close node 4", 0x80, NODE);
    silent(bench);

    map(
        bench,
        &[("timer trigger (255)", "2F 00 18 02 FF 00 00 00"), ("event timer 500 ms", "2B 00 18 05 E8 03 00 00")],
    );
    bench.ask("inhibit time off", "2B 00 18 03 00 00 00 00", "60 00 18 03 00 00 00 00");
    nmt(bench, "start all nodes", 0x01, 0);
    bench.step("listen");
    let begin = bench.now();
    bench.run(Duration::from_millis(5_200));
    let sent = bench.heard_since(begin, TPDO0);
    bench.expect("184h in 5.2 s", Expect::Near(10.0, 1.0), "frames", sent.len() as f64);
    bench.expect("apart", Expect::Near(500.0, 2.0), "ms", largest_gap_ms(&sent));
    nmt(bench, "close all nodes", 0x80, 0);
    silent(bench);
}

/// 6.2: 60FFh in RPDO1.
pub(super) fn rpdo(bench: &mut Bench) {
    bench.section("6.2", "RPDO mapping");
    bench.ask("clear RPDO1 mapping", "2F 01 16 00 00 00 00 00", "60 01 16 00 00 00 00 00");
    bench.ask("map 60FFh", "23 01 16 01 20 00 FF 60", "60 01 16 01 00 00 00 00");
    bench.ask("enable the mapping", "2F 01 16 00 01 00 00 00", "60 01 16 00 00 00 00 00");
    bench.ask("save", "2B 09 20 00 02 00 00 00", "60 09 20 00 00 00 00 00");
    nmt(bench, "start node 4", 0x01, NODE);
    velocity_mode(bench);
    bench.step("RPDO1: target 60 r/min");
    bench.send(Frame::new(CanId::standard(0x304), &[60, 0, 0, 0]));
    bench.run(Duration::from_millis(1_000));
    let speed = bench.report().velocity_rpm;
    bench.moved(format!("{speed:.1} r/min"));
    bench.expect("speed", Expect::Near(60.0, 1.0), "r/min", speed);
    bench.step("RPDO1: target 0 r/min");
    bench.send(Frame::new(CanId::standard(0x304), &[0, 0, 0, 0]));
    bench.run(Duration::from_millis(800));
    let speed = bench.report().velocity_rpm;
    bench.expect("speed", Expect::Near(0.0, 1.0), "r/min", speed);
    nmt(bench, "close node 4", 0x80, NODE);
    bench.step("RPDO1 after closing: invalid");
    bench.send(Frame::new(CanId::standard(0x304), &[60, 0, 0, 0]));
    let target = bench.read_f64(0x60FF, 0);
    bench.expect("60FFh", Expect::Near(0.0, 0.0), "r/min", target);
    stop(bench);
}

/// The mapping of 6.1 with some settings of the communication parameter.
fn map(bench: &mut Bench, settings: &[(&str, &str)]) {
    bench.ask("clear TPDO0 mapping", "2F 00 1A 00 00 00 00 00", "60 00 1A 00 00 00 00 00");
    bench.ask("map 606Ch", "23 00 1A 01 20 00 6C 60", "60 00 1A 01 00 00 00 00");
    for (name, request) in settings {
        let reply = format!("60 {} 00 00 00 00", &request[3..11]);
        bench.ask(*name, request, &reply);
    }
    bench.ask("enable the mapping", "2F 00 1A 00 01 00 00 00", "60 00 1A 00 00 00 00 00");
    bench.ask("save", "2B 09 20 00 02 00 00 00", "60 09 20 00 00 00 00 00");
}

fn nmt(bench: &mut Bench, name: &str, command: u8, node: u8) {
    bench.step(format!("NMT {name}"));
    bench.send(Frame::new(CanId::standard(0), &[command, node]));
}

fn silent(bench: &mut Bench) {
    let begin = bench.now();
    bench.run(Duration::from_millis(1_500));
    let sent = bench.heard_since(begin, TPDO0).len();
    bench.expect("184h after closing", Expect::Near(0.0, 0.0), "frames", sent as f64);
}
