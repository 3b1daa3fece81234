//! What a frame costs: a booted, operational node with heartbeat, event timer and inhibit time armed, over a table of
//! 201 entries. Every figure is the whole way: `handle_frame`, `poll_transmit` until empty, `poll_event` until empty.

use std::hint::black_box;
use std::time::Duration;

use can::{Frame, Instant, Station};
use canopen::node::{Node, NodeProfile};
use canopen::od::{Access, DataType, Entry, Fixed, Index, Table};
use canopen::sdo::Client;
use canopen::sdo::client::Outcome;
use canopen::{Mux, NodeId};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

use Access::{Const, ReadOnly, ReadWrite};
use DataType::{Integer8, Integer16, Integer32, Unsigned8, Unsigned16, Unsigned32, VisibleString};

const ROW_COUNT: usize = 201;

/// 1,026 bytes: 147 segments.
const TEXT: &str = {
    const BYTES: [u8; 1026] = [b'x'; 1026];
    match core::str::from_utf8(&BYTES) {
        Ok(text) => text,
        Err(_) => panic!(),
    }
};

const fn row(index: u16, sub_index: u8, data_type: DataType, access: Access) -> Entry {
    Entry::new(index, sub_index, data_type, access, "", "")
}

struct Rows {
    rows: [Entry; ROW_COUNT],
    count: usize,
}

impl Rows {
    const fn add(&mut self, row: Entry) {
        self.rows[self.count] = row;
        self.count += 1;
    }

    const fn parameter(&mut self, index: u16, base: u32, transmission_type: i64, timers: i64) {
        self.add(row(index, 0, Unsigned8, Const).default(5));
        self.add(row(index, 1, Unsigned32, ReadWrite).node_id_plus(base));
        self.add(row(index, 2, Unsigned8, ReadWrite).default(transmission_type));
        self.add(row(index, 3, Unsigned16, ReadWrite).default(timers));
        self.add(row(index, 5, Unsigned16, ReadWrite).default(timers));
    }

    const fn mapping(&mut self, index: u16, entries: &[u32]) {
        self.add(row(index, 0, Unsigned8, ReadWrite).default(entries.len() as i64));
        let mut i = 0;
        while i < 4 {
            let entry = if i < entries.len() { entries[i] as i64 } else { 0 };
            self.add(row(index, i as u8 + 1, Unsigned32, ReadWrite).default(entry));
            i += 1;
        }
    }
}

static ROWS: [Entry; ROW_COUNT] = {
    let mut all = Rows { rows: [row(0, 0, Unsigned8, Const); ROW_COUNT], count: 0 };
    all.add(row(0x1000, 0, Unsigned32, Const).default(0x0004_0192));
    all.add(row(0x1001, 0, Unsigned8, ReadOnly));
    all.add(row(0x1005, 0, Unsigned32, ReadWrite).default(0x80));
    all.add(row(0x1008, 0, VisibleString, Const).text(TEXT));
    all.add(row(0x1014, 0, Unsigned32, ReadWrite).node_id_plus(0x80));
    all.add(row(0x1017, 0, Unsigned16, ReadWrite).default(1000));
    let mut n = 0;
    while n < 4 {
        all.parameter(0x1400 + n, 0x200 + 0x100 * n as u32, 255, 0);
        n += 1;
    }
    // RPDO 1: controlword, mode, target velocity; 7 bytes.
    all.mapping(0x1600, &[0x6040_0010, 0x6060_0008, 0x60FF_0020]);
    all.mapping(0x1601, &[0x60FF_0020]);
    all.mapping(0x1602, &[]);
    all.mapping(0x1603, &[]);
    // TPDO 1: at every SYNC. TPDO 2: on change, with timers running.
    all.parameter(0x1800, 0x180, 1, 0);
    all.parameter(0x1801, 0x280, 254, 1000);
    all.parameter(0x1802, 0x380, 255, 0);
    all.parameter(0x1803, 0x480, 255, 0);
    // Statusword, mode display, velocity: 7 bytes.
    all.mapping(0x1A00, &[0x6041_0010, 0x6061_0008, 0x606C_0020]);
    all.mapping(0x1A01, &[0x6064_0020]);
    all.mapping(0x1A02, &[]);
    all.mapping(0x1A03, &[]);
    n = 0;
    while all.count < ROW_COUNT - 10 {
        all.add(row(0x2000 + n, 0, Unsigned16, ReadWrite).range(0, 30_000));
        n += 1;
    }
    all.add(row(0x6040, 0, Unsigned16, ReadWrite).mappable());
    all.add(row(0x6041, 0, Unsigned16, ReadOnly).mappable());
    all.add(row(0x6060, 0, Integer8, ReadWrite).values(&[(1, "pp"), (3, "pv"), (4, "pt")]).mappable());
    all.add(row(0x6061, 0, Integer8, ReadOnly).mappable());
    all.add(row(0x6064, 0, Integer32, ReadOnly).mappable());
    all.add(row(0x606C, 0, Integer32, ReadOnly).mappable());
    all.add(row(0x6071, 0, Integer16, ReadWrite).range(-30_000, 30_000).mappable());
    all.add(row(0x6077, 0, Integer16, ReadOnly).mappable());
    all.add(row(0x607A, 0, Integer32, ReadWrite).mappable());
    all.add(row(0x60FF, 0, Integer32, ReadWrite).range(-1000, 1000).mappable());
    assert!(all.count == ROW_COUNT);
    all.rows
};
static INDEX: Index<ROW_COUNT> = Index::of(&ROWS);
static TABLE: Table = Table::new(&ROWS, &INDEX);
static PROFILE: NodeProfile = NodeProfile::cia_301(&TABLE);

type BenchNode = Node<Fixed<256>>;

fn node_id() -> NodeId {
    NodeId::new(4).unwrap()
}

fn frame(text: &str) -> Frame {
    text.parse().unwrap()
}

fn operational() -> BenchNode {
    let mut node = BenchNode::new(&PROFILE, node_id());
    node.boot(Instant::ZERO);
    node.handle_frame(&frame("000#0104"), Instant::ZERO);
    drain(&mut node, Instant::ZERO);
    node
}

#[inline]
fn drain(node: &mut BenchNode, now: Instant) -> u64 {
    let mut sum = 0;
    while let Some(frame) = node.poll_transmit() {
        sum += u64::from_le_bytes(*frame.padded());
        node.handle_transmitted(&frame, now);
    }
    while let Some(event) = node.poll_event() {
        black_box(event);
    }
    sum
}

/// One frame in, everything out.
fn exchange(criterion: &mut Criterion, name: &str, text: &str) {
    let mut node = operational();
    let (frame, now) = (frame(text), Instant::from_micros(1));
    criterion.bench_function(name, |bencher| {
        bencher.iter(|| {
            node.handle_frame(black_box(&frame), now);
            drain(&mut node, now)
        });
    });
}

fn frames(criterion: &mut Criterion) {
    exchange(criterion, "sdo expedited upload", "604#4064600000000000");
    exchange(criterion, "sdo expedited download", "604#23FF600064000000");
    exchange(criterion, "sdo abort, missing object", "604#4003100000000000");
    exchange(criterion, "rpdo, 3 objects", "204#0F000364000000");
    exchange(criterion, "rpdo, 1 object", "304#64000000");
    exchange(criterion, "tpdo on SYNC, 3 objects", "080#");
    exchange(criterion, "a frame not for this node", "185#1122334455667788");
}

fn idle(criterion: &mut Criterion) {
    let mut node = operational();
    let now = Instant::from_micros(1);
    criterion.bench_function("idle", |bencher| {
        bencher.iter(|| {
            node.handle_timeout(black_box(now));
            (node.poll_transmit().is_some(), node.poll_event().is_some(), node.poll_timeout())
        });
    });
    criterion.bench_function("notice_changes, nothing changed", |bencher| {
        bencher.iter(|| node.notice_changes(black_box(now)));
    });
}

fn tpdo_on_change(criterion: &mut Criterion) {
    let position = TABLE.object::<i32>(0x6064, 0);
    let mut node = operational();
    let mut now = Instant::ZERO;
    criterion.bench_function("tpdo on change, inhibited in between", |bencher| {
        let mut value = 0_i32;
        bencher.iter(|| {
            now = now.plus_nanos(100_000_000);
            value = value.wrapping_add(1);
            node.dictionary_mut().set(position, value);
            node.notice_changes(now);
            drain(&mut node, now)
        });
    });
}

fn segmented_upload(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("segmented upload, server");
    group.throughput(Throughput::Bytes(TEXT.len() as u64));
    let mut node = operational();
    let now = Instant::from_micros(1);
    let initiate = frame("604#4008100000000000");
    let segments = [frame("604#6000000000000000"), frame("604#7000000000000000")];
    group.bench_function("1026 bytes", |bencher| {
        bencher.iter(|| {
            node.handle_frame(&initiate, now);
            let mut sum = drain(&mut node, now);
            for segment in 0..TEXT.len().div_ceil(7) {
                node.handle_frame(black_box(&segments[segment & 1]), now);
                sum ^= drain(&mut node, now);
            }
            sum
        });
    });
    group.finish();
}

fn round_trip(criterion: &mut Criterion) {
    let mut node = operational();
    let mut client = Client::new(node_id(), Duration::from_millis(20));
    let mut buffer = [0; 8];
    let now = Instant::from_micros(1);
    let mux = Mux::new(0x6064, 0);
    criterion.bench_function("client and server round trip, upload", |bencher| {
        bencher.iter(|| {
            client.upload(black_box(mux), now);
            let request = client.poll_transmit(&buffer).unwrap();
            node.handle_frame(&request, now);
            let reply = node.poll_transmit().unwrap();
            node.handle_transmitted(&reply, now);
            let outcome = client.handle_frame(&reply, &mut buffer, now);
            assert_eq!(outcome, Some(Ok(Outcome::Uploaded { mux, length: 4 })));
        });
    });
}

criterion_group!(benches, frames, idle, tpdo_on_change, segmented_upload, round_trip);
criterion_main!(benches);
