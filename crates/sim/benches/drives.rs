//! How fast whole virtual drives run: CANopen, protection, control loops, motor, load, supply and heat, on one bus.
//!
//! The throughput is printed as elements per second, an element being a virtual millisecond: 1 Melem/s is a thousand
//! times real time.

use std::hint::black_box;
use std::time::Duration;

use can::{Bitrate, CanId, Frame};
use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion, Throughput, criterion_group, criterion_main};
use drives::mjoint::Model;
use sim::machine::{mjoint, zlac8030l, zlim42c};
use sim::{StationId, VirtualDrive, World};

/// Virtual time of one iteration.
const SPAN: Duration = Duration::from_millis(200);

/// Drives by their node-ID.
type Drives = Vec<(u8, Box<dyn VirtualDrive>)>;

fn hub_servos(count: u8) -> Drives {
    (1..=count).map(|node| (node, Box::new(zlac8030l(node, 0)) as Box<dyn VirtualDrive>)).collect()
}

fn joint(node: u8) -> (u8, Box<dyn VirtualDrive>) {
    (node, Box::new(mjoint(Model::named("m4230e17b50").expect("a model"), node, Bitrate::M1)))
}

fn stepper(node: u8) -> (u8, Box<dyn VirtualDrive>) {
    (node, Box::new(zlim42c(node, 0)))
}

/// A bus of drives that all turn at 100 r/min.
fn turning(drives: Drives) -> World {
    let mut world = World::new(Bitrate::M1, 1);
    let tap = world.add_tap();
    let nodes: Vec<u8> = drives.iter().map(|(node, _)| *node).collect();
    for (node, drive) in drives {
        world.add_drive(node, drive).expect("numbers differ");
    }
    world.run_for(Duration::from_millis(20));
    while world.poll_received(tap).is_some() {} // boot-up messages
    for node in &nodes {
        turn(&mut world, tap, *node);
    }
    world.run_for(Duration::from_secs(1));
    for node in nodes {
        let speed = world.report(node).map(|report| report.velocity_rpm);
        // The stepper's rotor swings with its steps.
        assert!(speed.as_ref().is_ok_and(|rpm| (rpm - 100.0).abs() < 40.0), "node {node}: {speed:?}");
    }
    world
}

/// Profile velocity at 100 r/min, enabled as each of the drives can be; no watch over the host where there is one.
fn turn(world: &mut World, tap: StationId, node: u8) {
    let mut write = |data: [u8; 8], may_refuse: bool| {
        let request = Frame::full(CanId::standard(0x600 + u16::from(node)), data);
        world.send(tap, request).expect("the tap has room");
        world.run_for(Duration::from_millis(1));
        let answers = std::iter::from_fn(|| world.poll_received(tap)).map(|(_, frame)| frame);
        let answer = answers.filter(|frame| frame.id() == CanId::standard(0x580 + u16::from(node))).last();
        let first = answer.and_then(|frame| frame.data().first().copied());
        assert!(first == Some(0x60) || (may_refuse && first == Some(0x80)), "{request} -> {answer:?}");
    };
    write([0x2B, 0x00, 0x20, 0, 0, 0, 0, 0], true);
    write([0x2F, 0x60, 0x60, 0, 3, 0, 0, 0], false);
    for command in [0x06, 0x07, 0x0F] {
        write([0x2B, 0x40, 0x60, 0, command, 0, 0, 0], false);
    }
    write([0x23, 0xFF, 0x60, 0, 100, 0, 0, 0], false);
}

fn run(group: &mut BenchmarkGroup<'_, WallTime>, name: &str, mut world: World) {
    group.bench_function(name, |bencher| {
        bencher.iter(|| {
            world.run_for(SPAN);
            black_box(world.now())
        });
    });
}

fn running(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("drives");
    group.throughput(Throughput::Elements(SPAN.as_millis() as u64));
    for count in [1, 3, 127] {
        run(&mut group, &format!("{count} turning"), turning(hub_servos(count)));
    }
    run(&mut group, "1 joint turning", turning(vec![joint(1)]));
    run(&mut group, "1 stepper turning", turning(vec![stepper(2)]));
    let mut one_of_each = hub_servos(1);
    one_of_each.extend([stepper(2), joint(3)]);
    run(&mut group, "one of each, turning", turning(one_of_each));
    let mut world = World::new(Bitrate::M1, 1);
    // Somebody who acknowledges: alone it would repeat its boot-up message for ever.
    world.add_tap();
    world.add_drive(1, Box::new(zlac8030l(1, 0))).expect("numbers differ");
    run(&mut group, "1 not enabled", world);
    group.finish();
}

criterion_group!(benches, running);
criterion_main!(benches);
