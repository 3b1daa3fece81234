//! What a frame and a control period cost in the ZLAC8030L's firmware.
//!
//! `node` is CANopen alone over the drive's full dictionary, operational, with heartbeat and event timer armed: the
//! whole way of `handle_frame`, `poll_transmit` until empty, `poll_event` until empty. `firmware` is the same frame
//! through the whole drive, with what the written object does to it. `tick` is one control period of 50 µs.

#[path = "workload/firmware.rs"]
mod workload;

use std::hint::black_box;

use can::Station;
use criterion::{Criterion, criterion_group, criterion_main};
use drives::Firmware;
use drives::zlac8030l::Sensors;

use workload::{FRAMES, NOW, drain, exchange_with_firmware, exchange_with_node, firmware, frame, idle, node};

fn frames(criterion: &mut Criterion) {
    for (name, text) in FRAMES {
        let (mut node, frame) = (node(), frame(text));
        criterion.bench_function(&format!("node: {name}"), |bencher| {
            bencher.iter(|| exchange_with_node(&mut node, &frame));
        });
    }
    let mut node = node();
    criterion.bench_function("node: idle", |bencher| bencher.iter(|| idle(&mut node)));
    for (name, text) in FRAMES {
        let (mut drive, frame) = (firmware(), frame(text));
        criterion.bench_function(&format!("firmware: {name}"), |bencher| {
            bencher.iter(|| exchange_with_firmware(&mut drive, &frame));
        });
    }
}

fn ticks(criterion: &mut Criterion) {
    let enable = ["604#2F60600003000000", "604#2B40600006000000", "604#2B40600007000000", "604#2B4060000F000000"];
    for (name, frames) in [("off", &enable[..0]), ("modulating", &enable[..])] {
        let mut drive = firmware();
        for text in frames {
            drive.handle_frame(&frame(text), NOW);
            drain(&mut drive);
        }
        let sensors = Sensors::default();
        criterion.bench_function(&format!("tick: {name}"), |bencher| {
            bencher.iter(|| drive.tick(black_box(&sensors), NOW));
        });
    }
}

criterion_group!(benches, frames, ticks);
criterion_main!(benches);
