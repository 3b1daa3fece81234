//! An SDO download of 64 KiB over 1 Mbit/s, in virtual time: master and node of this project, on the bit-exact wire of `sim`.

use std::time::Duration;

use can::{Bitrate, Frame, INTERFRAME_SPACE_BITS, frame_bits};
use canopen::{Mux, NodeId, connection_set};
use master::Network;
use sim::machine::{Order, order};
use sim::{World, block_on};

const LENGTH: usize = 1 << 16;
const DATA: Mux = Mux::new(0x1F50, 1);
const SHEET: &[u8] = b"[DeviceInfo]\nVendorName=None\nProductName=Box\n\
[1000]\nParameterName=Device type\nDataType=7\nAccessType=ro\nDefaultValue=0\n\
[1001]\nParameterName=Error register\nDataType=5\nAccessType=ro\n\
[1F50]\nParameterName=Program data\nObjectType=8\nSubNumber=2\n\
[1F50sub0]\nParameterName=n\nDataType=5\nAccessType=ro\nDefaultValue=1\n\
[1F50sub1]\nParameterName=Program\nDataType=0xF\nAccessType=rw\n";

/// What the wire can carry is what the same bytes take in segments of blocks, seven in each, that follow each other without a pause and
/// without anything else. The bytes are not all alike, so that there are as many stuff bits as in any data.
#[test]
#[allow(clippy::print_stdout, reason = "the figures of docs/performance.md")]
fn blocks_take_at_least_92_percent_of_what_the_wire_can_carry_and_segments_less_than_half() {
    let data: Vec<u8> = (0..LENGTH as u32).map(|at| (at.wrapping_mul(0x9E37_79B1) >> 13) as u8).collect();
    let least = on_the_wire(&data).as_secs_f64();
    let [in_blocks, in_segments] = [true, false].map(|in_blocks| least / download(&data, in_blocks).as_secs_f64());
    println!(
        "{LENGTH} bytes, {:.1} ms: {:.1} % in blocks, {:.1} % in segments",
        least * 1e3,
        in_blocks * 100.0,
        in_segments * 100.0
    );
    assert!((0.92..1.0).contains(&in_blocks), "{in_blocks}");
    assert!(in_segments < 0.5, "an answer for each request: {in_segments}");
}

/// How long the segments take by their bits, stuff bits among them.
fn on_the_wire(data: &[u8]) -> Duration {
    let node = NodeId::new(9).unwrap();
    let segments = data.chunks(7).enumerate().map(|(number, part)| {
        let mut raw = [0; 8];
        raw[0] = (number % 127 + 1) as u8;
        raw[1..=part.len()].copy_from_slice(part);
        frame_bits(&Frame::full(connection_set::sdo_request(node), raw)) + INTERFRAME_SPACE_BITS
    });
    Duration::from_micros(segments.map(u64::from).sum())
}

fn download(data: &[u8], in_blocks: bool) -> Duration {
    let eds = eds::Eds::load(SHEET).unwrap().eds;
    let model = eds::keep(&eds).unwrap();
    let node = NodeId::new(9).unwrap();
    let mut world = World::new(Bitrate::M1, 1);
    let network = Network::new();
    world.add_station(network.clone());
    world.add_drive(9, order(model, &Order::new(model, node, Bitrate::M1)).unwrap()).unwrap();
    world.run_for(Duration::from_secs(1));
    if !in_blocks {
        // While it counts the SYNCs of a producer, a master does not use blocks by itself. There is none, so that nothing is on the bus.
        network.with_core(|core| {
            let now = core.now();
            core.execute(master::core::Command::FollowSync(Some(Duration::from_secs(3600))), now);
        });
    }
    let began = world.now();
    block_on(&mut world, network.node(node).download(DATA, data)).unwrap().unwrap();
    let taken = world.now() - began;
    let stored = block_on(&mut world, network.node(node).upload(DATA)).unwrap().unwrap();
    assert!(stored.as_bytes() == data, "the node has other bytes");
    taken
}
