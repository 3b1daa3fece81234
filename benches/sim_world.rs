//! How fast a crowded bus runs: 127 stations, each with a frame of eight bytes every 20 ms at 1 Mbit/s
//! (about three quarters of what the wire carries), against their virtual time.
//!
//! The throughput is printed as elements per second, an element being a virtual millisecond:
//! 10 Kelem/s is ten times real time.

use std::hint::black_box;
use std::time::Duration;

use can::{Bitrate, CanId, Frame, Instant, Station};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use sim::World;

/// Sends at its period and counts what it hears, as a node with nothing to do with a frame would.
#[derive(Clone)]
struct Talker {
    frame: Frame,
    next: Instant,
    pending: bool,
    heard: u64,
}

const PERIOD: Duration = Duration::from_millis(20);

impl Station for Talker {
    fn handle_frame(&mut self, frame: &Frame, _: Instant) {
        self.heard += u64::from(frame.dlc());
    }

    fn handle_timeout(&mut self, now: Instant) {
        if now >= self.next {
            self.pending = true;
            self.next += PERIOD;
        }
    }

    fn poll_transmit(&mut self) -> Option<Frame> {
        std::mem::take(&mut self.pending).then_some(self.frame)
    }

    fn poll_timeout(&self) -> Option<Instant> {
        Some(self.next)
    }
}

fn crowd(stations: u16) -> World {
    let mut world = World::new(Bitrate::M1, 1);
    for node in 1..=stations {
        let frame = Frame::full(CanId::standard(0x180 + node), u64::from(node).wrapping_mul(0x9E37_79B9).to_le_bytes());
        // Spread over the period, not all at once.
        let next = Instant::from_millis(1).plus_nanos(u64::from(node) * 20_000_000 / u64::from(stations));
        world.add_station(Talker { frame, next, pending: false, heard: 0 });
    }
    world.run_until(Instant::from_millis(100));
    world
}

fn stepping(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("world");
    const SPAN_MS: u64 = 100;
    group.throughput(Throughput::Elements(SPAN_MS));
    for stations in [2, 127] {
        let world = crowd(stations);
        group.bench_function(format!("{stations} stations"), |bencher| {
            bencher.iter_batched(
                || world.clone(),
                |mut world| {
                    world.run_for(Duration::from_millis(SPAN_MS));
                    black_box(world.statistics())
                },
                criterion::BatchSize::LargeInput,
            );
        });
    }
    group.finish();
}

criterion_group!(benches, stepping);
criterion_main!(benches);
