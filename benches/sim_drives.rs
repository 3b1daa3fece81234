//! How fast whole virtual drives run: CANopen, protection, control loops, motor, load, supply and heat, on one bus.
//!
//! A silent bus carries next to no frame. A busy one is about three quarters full of SYNC, RPDOs and TPDOs. The
//! throughput is printed as elements per second, an element being a virtual millisecond: 1 Melem/s is a thousand times
//! real time.

#[path = "workload/worlds.rs"]
mod workload;

use std::hint::black_box;
use std::time::Duration;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};

use workload::{WORLDS, world};

/// Virtual time of one iteration.
const SPAN: Duration = Duration::from_millis(200);

fn running(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("drives");
    group.throughput(Throughput::Elements(SPAN.as_millis() as u64));
    for name in WORLDS {
        let mut made = None;
        group.bench_function(name, |bencher| {
            let world = made.get_or_insert_with(|| world(name).expect("it is listed"));
            bencher.iter(|| {
                world.run_for(SPAN);
                black_box(world.now())
            });
        });
    }
    group.finish();
}

criterion_group!(benches, running);
criterion_main!(benches);
