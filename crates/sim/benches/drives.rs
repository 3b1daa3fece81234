//! How fast whole virtual drives run: CANopen, protection, control loops, motor, load, supply and heat, on one bus.
//!
//! The throughput is printed as elements per second, an element being a virtual millisecond: 1 Melem/s is a thousand
//! times real time.

use std::hint::black_box;
use std::time::Duration;

use can::{Bitrate, CanId, Frame};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use sim::World;
use sim::machine::zlac8030l;

/// A bus of drives that all turn at 100 r/min.
fn turning(drives: u8) -> World {
    let mut world = World::new(Bitrate::M1, 1);
    let tap = world.add_tap();
    for node in 1..=drives {
        world.add_drive(node, Box::new(zlac8030l(node, 0))).expect("numbers differ");
    }
    world.run_for(Duration::from_millis(20));
    while world.poll_received(tap).is_some() {} // boot-up messages
    let mut write = |node: u8, data: [u8; 8]| {
        let request = Frame::full(CanId::standard(0x600 + u16::from(node)), data);
        world.send(tap, request).expect("the tap has room");
        world.run_for(Duration::from_millis(1));
        let answer = world.poll_received(tap).expect("the drive answers").1;
        assert_eq!(answer.data().first(), Some(&0x60), "{request} -> {answer}");
    };
    for node in 1..=drives {
        // No watch over the host, profile velocity, enabled, 100 r/min.
        write(node, [0x2B, 0x00, 0x20, 0, 0, 0, 0, 0]);
        write(node, [0x2F, 0x60, 0x60, 0, 3, 0, 0, 0]);
        for command in [0x06, 0x07, 0x0F] {
            write(node, [0x2B, 0x40, 0x60, 0, command, 0, 0, 0]);
        }
        write(node, [0x23, 0xFF, 0x60, 0, 100, 0, 0, 0]);
    }
    world.run_for(Duration::from_secs(1));
    let speed = world.report(1).map(|report| report.velocity_rpm);
    assert!(speed.as_ref().is_ok_and(|rpm| (rpm - 100.0).abs() < 3.0), "{speed:?}");
    world
}

fn running(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("drives");
    const SPAN_MS: u64 = 200;
    group.throughput(Throughput::Elements(SPAN_MS));
    for drives in [1, 3, 127] {
        let mut world = turning(drives);
        group.bench_function(format!("{drives} turning"), |bencher| {
            bencher.iter(|| {
                world.run_for(Duration::from_millis(SPAN_MS));
                black_box(world.now())
            });
        });
    }
    let mut world = World::new(Bitrate::M1, 1);
    // Somebody who acknowledges: alone it would repeat its boot-up message for ever.
    world.add_tap();
    world.add_drive(1, Box::new(zlac8030l(1, 0))).expect("numbers differ");
    group.bench_function("1 not enabled", |bencher| {
        bencher.iter(|| {
            world.run_for(Duration::from_millis(SPAN_MS));
            black_box(world.now())
        });
    });
    group.finish();
}

criterion_group!(benches, running);
criterion_main!(benches);
