//! Random frames against every kind of node: each virtual drive, the servo of CiA 402, inputs and outputs of CiA 401, an encoder of
//! CiA 406, and a device whose file has every service of CiA 301 that a described device acts on. Now and then an SDO block transfer or a
//! program download goes on as a client's would, so that what is random meets each state of it.
//!
//! `cargo run -p ferrodrive-tests --example random_frames -- 10000000` does it for as many frames as are said; a short form
//! is among the tests.

use std::collections::VecDeque;

use can::{Bitrate, CanId, Frame, Instant};
use canopen::NodeId;
use canopen::od::Entry;
use canopen::sdo::block::checksum;
use devices::{AxisId, Description};
use sim::VirtualDrive;
use sim::machine::{Order, models, order};

use crate::seeded::Seeded;
use crate::sheet::{DOMAIN, SheetRow, U8, U16, U32, U64, sheet};

/// After so many frames a node is replaced by another of its kind: LSS or a write may have taken it out of hearing.
const FRAMES_OF_A_NODE: u64 = 5_000;
const NODE: u8 = 5;
/// Where the second SDO server of `everything` listens, by 1201h.
const SECOND_SERVER: u16 = 0x645;
/// What one call may leave to be sent: every TPDO, EMCY, and a frame of each other service.
const MOST_AT_ONCE: usize = 64;

/// What a run saw.
#[derive(Debug, Default, Clone, Copy)]
pub struct Seen {
    /// Frames sent to nodes.
    pub frames: u64,
    /// Answers of SDO servers.
    pub answers: u64,
    /// Other frames of the nodes.
    pub others: u64,
}

/// Every kind: the models that are built in, drives and what stands beside them, and the device of `everything`.
///
/// # Panics
/// If the file makes no description.
#[must_use]
pub fn kinds() -> Vec<&'static Description> {
    let read = eds::Eds::load(&everything()).expect("the file is read");
    let described = eds::keep(&read.eds).expect("the file makes a description");
    let beside = ["io401", "encoder406"].map(|name| words::models::resolve(name).expect("it is built in"));
    models().chain(beside).chain([described]).collect()
}

/// `frames` frames to a kind of node, all from one seed.
///
/// # Panics
/// If the node panics, sends without end, or never answers.
pub fn survives(model: &'static Description, frames: u64, seed: u64) -> Seen {
    let mut seeded = Seeded::new(seed);
    let mut seen = Seen::default();
    while seen.frames < frames {
        let count = FRAMES_OF_A_NODE.min(frames - seen.frames);
        one_node(model, count, &mut seeded, &mut seen);
    }
    assert!(seen.answers > 0 && seen.others > 0, "{} is not heard: {seen:?}", model.name);
    seen
}

fn one_node(model: &'static Description, count: u64, seeded: &mut Seeded, seen: &mut Seen) {
    let node = NodeId::new(NODE).expect("a node-ID");
    let mut drive = order(model, &Order::new(model, node, Bitrate::M1)).expect("as delivered");
    let mut now = Instant::ZERO;
    drive.apply(AxisId::FIRST, &"power on".parse().expect("a stimulus"), now).expect("every machine has a supply");
    let mut coming = VecDeque::new();
    for _ in 0..count {
        // A frame of 130 bits at 1 Mbit/s, and now and then a pause.
        let pause_us = if seeded.below(200) == 0 { 5_000 } else { 130 };
        now = now.plus_nanos(pause_us * 1000);
        while let Some(due) = drive.poll_timeout().filter(|due| *due <= now) {
            drive.handle_timeout(due);
            take(&mut *drive, due, seen);
        }
        drive.advance(now);
        if coming.is_empty() && seeded.below(50) == 0 {
            coming = transfer(seeded, model.dictionary.rows());
        }
        // One of ten is lost in favour of another frame.
        let next = coming.pop_front().filter(|_| seeded.below(10) > 0);
        let frame = next.unwrap_or_else(|| frame(seeded, model.dictionary.rows()));
        seen.frames += 1;
        drive.handle_frame(&frame, now);
        take(&mut *drive, now, seen);
    }
}

fn take(drive: &mut dyn VirtualDrive, now: Instant, seen: &mut Seen) {
    for count in 0.. {
        let Some(frame) = drive.poll_transmit() else { return };
        assert!(count < MOST_AT_ONCE, "{} sends without end, at last {frame}", drive.model());
        drive.handle_transmitted(&frame, now);
        let is_answer = frame.id() == canopen::connection_set::sdo_reply(NodeId::new(NODE).expect("a node-ID"));
        *(if is_answer { &mut seen.answers } else { &mut seen.others }) += 1;
    }
}

/// Any frame, most of them for a service that the node may have.
fn frame(seeded: &mut Seeded, rows: &[Entry]) -> Frame {
    let length = if seeded.below(4) == 0 { seeded.below(9) } else { 8 };
    let data = seeded.bits().to_le_bytes();
    let of = |id: u16, data: &[u8]| Frame::new(CanId::standard(id), data);
    match seeded.below(100) {
        0..45 => of(0x600 + u16::from(NODE), &request(seeded, rows)[..length]),
        45..60 => {
            let base = 0x180 + 0x80 * seeded.below(8) as u16;
            of(base + u16::from(NODE), &data[..length])
        }
        60..68 => {
            // Resets are rare, or it would never come far.
            let command = [1, 1, 1, 2, 128, 129, 130, data[0]][if seeded.below(20) == 0 { seeded.below(8) } else { 0 }];
            of(0, &[command, if seeded.below(2) == 0 { NODE } else { 0 }][..length.min(2)])
        }
        68..78 => of(0x080, &data[..length.min(1)]),
        78..84 => {
            let id = [0x185, 0x285, 0x385, 0x485, 0x705, 0x085][seeded.below(6)];
            Frame::remote(CanId::standard(id), length as u8)
        }
        84..88 => of(0x7E5, &data[..length]),
        88..92 => of([0x100, 0x701, 0x77F, 0x081, 0x082][seeded.below(5)], &data[..length]),
        92..94 => Frame::new(CanId::extended(seeded.bits() as u32 & CanId::MAX_EXTENDED), &data[..length]),
        _ => of(seeded.below(0x800) as u16, &data[..length]),
    }
}

/// The frames of an SDO client that transfers in blocks: an upload, a download, or a program (CiA 302-3: stop, clear, data, start).
fn transfer(seeded: &mut Seeded, rows: &[Entry]) -> VecDeque<Frame> {
    let row = &rows[seeded.below(rows.len())];
    // The second SDO server, where the node has it, or the default one.
    let id = if seeded.below(4) == 0 { SECOND_SERVER } else { 0x600 + u16::from(NODE) };
    let mut requests = VecDeque::new();
    match seeded.below(3) {
        0 => {
            let block_size = 1 + seeded.below(127) as u8;
            requests.push_back(initiate(0xA4, (row.index, row.sub_index), u32::from(block_size)));
            requests.push_back([0xA3, 0, 0, 0, 0, 0, 0, 0]);
            requests.extend((0..3).map(|_| [0xA2, seeded.below(128) as u8, block_size, 0, 0, 0, 0, 0]));
            requests.push_back([0xA1, 0, 0, 0, 0, 0, 0, 0]);
        }
        1 => requests.extend(download(seeded, (row.index, row.sub_index))),
        _ => {
            let control = |command| initiate(0x2F, (0x1F51, 1), command);
            requests.extend([control(0), control(3)]);
            requests.extend(download(seeded, (0x1F50, 1)));
            requests.push_back(control(1));
        }
    }
    requests.iter().map(|raw| Frame::new(CanId::standard(id), raw)).collect()
}

fn initiate(command: u8, (index, sub_index): (u16, u8), data: u32) -> [u8; 8] {
    let ([low, high], [a, b, c, d]) = (index.to_le_bytes(), data.to_le_bytes());
    [command, low, high, sub_index, a, b, c, d]
}

/// A download in one block, its size and its checksum right as a rule.
fn download(seeded: &mut Seeded, object: (u16, u8)) -> Vec<[u8; 8]> {
    let data: Vec<u8> = (0..seeded.below(60)).map(|_| seeded.bits() as u8).collect();
    let size = data.len() as u32 + u32::from(seeded.below(10) == 0);
    let mut requests = vec![initiate(0xC6, object, size)];
    let segments = data.chunks(7).len();
    for (number, bytes) in data.chunks(7).enumerate() {
        let last = if number + 1 == segments { 0x80 } else { 0 };
        let mut raw = [(number as u8 + 1) | last, 0, 0, 0, 0, 0, 0, 0];
        raw[1..=bytes.len()].copy_from_slice(bytes);
        requests.push(raw);
    }
    let unused = (7 - data.len() % 7) % 7;
    let [low, high] = (checksum(0, &data) ^ u16::from(seeded.below(10) == 0)).to_le_bytes();
    requests.push([0xC1 | (unused as u8) << 2, low, high, 0, 0, 0, 0, 0]);
    requests
}

/// An SDO request about an object that is there, as a rule.
fn request(seeded: &mut Seeded, rows: &[Entry]) -> [u8; 8] {
    const COMMANDS: [u8; 22] = [
        0x40, 0x40, 0x2F, 0x2F, 0x2B, 0x2B, 0x27, 0x23, 0x23, 0x22, 0x21, 0x20, 0x60, 0x70, 0x00, 0x0D, 0x80, 0xA4,
        0xA3, 0xA2, 0xC6, 0xC1,
    ];
    let row = &rows[seeded.below(rows.len())];
    let [low, high] = row.index.to_le_bytes();
    let mut data = seeded.bits().to_le_bytes();
    // Small values are within the limits of most objects.
    if seeded.below(2) == 0 {
        data[5..].fill(0);
    }
    let command = if seeded.below(20) == 0 { data[0] } else { COMMANDS[seeded.below(COMMANDS.len())] };
    let sub_index = if seeded.below(20) == 0 { data[3] } else { row.sub_index };
    if seeded.below(20) == 0 {
        return data;
    }
    [command, low, high, sub_index, data[4], data[5], data[6], data[7]]
}

/// Every service that a described device has by its objects, with PDOs of every sort: synchronous, on request, at the bit,
/// multiplexed both ways.
fn everything() -> Vec<u8> {
    let mut rows: Vec<SheetRow> = vec![(0x1000, 0, U32, "ro", 0x0003_0191, false), (0x1001, 0, U8, "ro", 0, true)];
    rows.extend([(0x1002, 0, U32, "ro", 0, true), (0x1003, 0, U8, "rw", 0, false), (0x1003, 1, U32, "ro", 0, false)]);
    let numbers = [
        (0x1005, U32, 0x80),
        (0x1006, U32, 0),
        (0x1007, U32, 0),
        (0x100C, U16, 0),
        (0x100D, U8, 0),
        (0x1012, U32, 0x100),
        (0x1014, U32, 0x85),
        (0x1015, U16, 0),
        (0x1017, U16, 0),
        (0x1019, U8, 0),
    ];
    rows.extend(numbers.map(|(index, data_type, default)| (index, 0, data_type, "rw", default, false)));
    for (index, entries, data_type, default) in [
        (0x1010, 3, U32, 1),
        (0x1011, 3, U32, 1),
        (0x1016, 3, U32, 0),
        (0x1020, 2, U32, 0),
        (0x1028, 3, U32, 0x8000_0081),
        (0x1029, 1, U8, 0),
        (0x1FA0, 2, U32, 0x0260_0001),
        (0x1FD0, 2, U64, 0x0162_0001_6000_0101),
    ] {
        rows.push((index, 0, U8, "ro", u64::from(entries), false));
        rows.extend((1..=entries).map(|sub_index| (index, sub_index, data_type, "rw", default, false)));
    }
    rows.push((0x1201, 0, U8, "ro", 3, false));
    rows.extend(
        [(1, U32, 0x645), (2, U32, 0x5C5), (3, U8, 0)].map(|(sub, of, value)| (0x1201, sub, of, "rw", value, false)),
    );
    for (index, data_type, access) in
        [(0x1F50, DOMAIN, "rw"), (0x1F51, U8, "rw"), (0x1F56, U32, "ro"), (0x1F57, U32, "ro")]
    {
        rows.push((index, 0, U8, "ro", 1, false));
        rows.push((index, 1, data_type, access, 0, false));
    }
    for (n, (transmission_type, mapped)) in [(255, 2), (1, 3), (255, 0xFF), (255, 0xFE)].into_iter().enumerate() {
        pdo(&mut rows, [0x1400, 0x1600], n as u16, 0x205, transmission_type, mapped, 0x6200_0108);
    }
    for (n, (transmission_type, mapped)) in [(254, 1), (2, 3), (252, 2), (254, 0xFE)].into_iter().enumerate() {
        pdo(&mut rows, [0x1800, 0x1A00], n as u16, 0x185, transmission_type, mapped, 0x6000_0108);
    }
    for (index, access) in [(0x6000, "ro"), (0x6200, "rw")] {
        rows.push((index, 0, U8, "ro", 4, false));
        rows.extend((1..=4).map(|sub_index| (index, sub_index, U8, access, 0, true)));
    }
    rows.sort_by_key(|row| (row.0, row.1));
    let text = String::from_utf8(sheet(&rows)).expect("a text");
    text.replacen("[DeviceInfo]\n", "[DeviceInfo]\nLSS_Supported=1\n", 1).into_bytes()
}

fn pdo(
    rows: &mut Vec<SheetRow>,
    [parameter, mapping]: [u16; 2],
    n: u16,
    cob_id: u64,
    transmission_type: u64,
    mapped: u64,
    first: u64,
) {
    let (parameter, mapping) = (parameter + n, mapping + n);
    rows.push((parameter, 0, U8, "ro", 6, false));
    rows.push((parameter, 1, U32, "rw", cob_id + 0x100 * u64::from(n), false));
    rows.push((parameter, 2, U8, "rw", transmission_type, false));
    rows.push((parameter, 3, U16, "rw", 0, false));
    rows.push((parameter, 5, U16, "rw", 0, false));
    rows.push((parameter, 6, U8, "rw", 0, false));
    rows.push((mapping, 0, U8, "rw", mapped, false));
    rows.extend((0..4).map(|entry| (mapping, entry as u8 + 1, U32, "rw", first + (entry << 8), false)));
}
