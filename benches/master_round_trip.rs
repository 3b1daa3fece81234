//! The master's core against a CANopen node in the same process: what one request costs both sides together.
//!
//! Heartbeat watch, SYNC and the process image are armed, as on a real bus.

use std::hint::black_box;
use std::time::Duration;

use can::{Frame, Instant, Station};
use canopen::NodeId;
use canopen::pdo::{MappingRecord, PdoNumber};
use cia402::object::STATUSWORD;
use criterion::{Criterion, criterion_group, criterion_main};
use master::core::{Command, Core, PdoMap};

const NODE: NodeId = NodeId::MIN;

/// Answers every upload of 6041h as a server does, in the fewest steps: the rest is the master's.
fn answer(request: &Frame) -> Option<Frame> {
    let reply = [0x4B, 0x41, 0x60, 0x00, 0x37, 0x02, 0x00, 0x00];
    (request.standard_data_id() == Some(0x601)).then(|| Frame::full(can::CanId::standard(0x581), reply))
}

fn armed_core() -> Core {
    let mut core = Core::new();
    for node in NodeId::all().take(16) {
        core.execute(Command::WatchHeartbeat(node, Some(Duration::from_secs(1))), Instant::ZERO);
    }
    core.execute(Command::Sync(Some(Duration::from_secs(1))), Instant::ZERO);
    let map = PdoMap(vec![MappingRecord::from_raw(0x6041_0010), MappingRecord::from_raw(0x6064_0020)]);
    core.image_mut().set_tpdo(NODE, PdoNumber::FIRST, 0x181, map);
    core
}

fn round_trip(criterion: &mut Criterion) {
    let mut core = armed_core();
    let mut now = Instant::ZERO;
    criterion.bench_function("expedited upload, master core", |bencher| {
        bencher.iter(|| {
            now = now.plus_nanos(1_000);
            core.upload(NODE, STATUSWORD, Duration::from_millis(500), now);
            while let Some(frame) = core.poll_transmit() {
                if let Some(reply) = answer(&frame) {
                    core.handle_frame(&reply, now);
                }
            }
            black_box(core.poll_timeout());
            black_box(core.poll_finished())
        });
    });
}

fn tpdo(criterion: &mut Criterion) {
    let mut core = armed_core();
    let frame: Frame = "181#370200010000".parse().expect("a frame");
    let mut now = Instant::ZERO;
    criterion.bench_function("TPDO into the process image", |bencher| {
        bencher.iter(|| {
            now = now.plus_nanos(1_000);
            core.handle_frame(black_box(&frame), now);
        });
    });
    let other: Frame = "3F1#370200010000".parse().expect("a frame");
    criterion.bench_function("a frame for no station", |bencher| {
        bencher.iter(|| core.handle_frame(black_box(&other), now));
    });
    criterion.bench_function("idle call", |bencher| {
        bencher.iter(|| {
            core.handle_timeout(black_box(now));
            black_box(core.poll_timeout())
        });
    });
}

criterion_group!(benches, round_trip, tpdo);
criterion_main!(benches);
