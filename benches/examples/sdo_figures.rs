//! An SDO download of 64 KiB in blocks and in segments over 1 Mbit/s, in virtual time: master and node of this project, on the bit-exact
//! wire of `sim`.
//!
//! What the wire can carry is what the same number of bytes takes in segments of blocks, seven in each, that follow each other
//! without a pause and without anything else:
//!
//! ```text
//! cargo run -p ferrodrive-benches --example sdo_figures
//! ```
#![allow(clippy::print_stdout, reason = "an example shows what it does")]

use std::error::Error;
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

fn main() -> Result<(), Box<dyn Error>> {
    let data: Vec<u8> = (0..LENGTH as u32).map(|at| (at.wrapping_mul(0x9E37_79B1) >> 13) as u8).collect();
    let least = on_the_wire(&data)?;
    println!("{LENGTH} bytes in segments without a pause: {:.1} ms", least.as_secs_f64() * 1e3);
    for (name, in_blocks) in [("in blocks", true), ("in segments", false)] {
        let taken = download(&data, in_blocks)?;
        let share = least.as_secs_f64() / taken.as_secs_f64() * 100.0;
        println!("{name}: {:.1} ms, {share:.1} % of what the wire can carry", taken.as_secs_f64() * 1e3);
    }
    Ok(())
}

/// How long the segments take by their bits, stuff bits among them.
fn on_the_wire(data: &[u8]) -> Result<Duration, Box<dyn Error>> {
    let node = NodeId::new(9).ok_or("9 is a node-ID")?;
    let segments = data.chunks(7).enumerate().map(|(number, part)| {
        let mut raw = [0; 8];
        raw[0] = (number % 127 + 1) as u8;
        raw[1..=part.len()].copy_from_slice(part);
        frame_bits(&Frame::full(connection_set::sdo_request(node), raw)) + INTERFRAME_SPACE_BITS
    });
    Ok(Duration::from_micros(segments.map(u64::from).sum()))
}

fn download(data: &[u8], in_blocks: bool) -> Result<Duration, Box<dyn Error>> {
    let eds = eds::Eds::load(SHEET)?.eds;
    let model = eds::keep(&eds)?;
    let node = NodeId::new(9).ok_or("9 is a node-ID")?;
    let mut world = World::new(Bitrate::M1, 1);
    let network = Network::new();
    world.add_station(network.clone());
    world.add_drive(9, order(model, &Order::new(model, node, Bitrate::M1))?)?;
    world.run_for(Duration::from_secs(1));
    if !in_blocks {
        // While it counts the SYNCs of a producer, a master does not use blocks by itself. There is none, so that nothing is on the bus.
        network.with_core(|core| {
            let now = core.now();
            core.execute(master::core::Command::FollowSync(Some(Duration::from_secs(3600))), now);
        });
    }
    let began = world.now();
    block_on(&mut world, network.node(node).download(DATA, data))??;
    let taken = world.now() - began;
    let stored = block_on(&mut world, network.node(node).upload(DATA))??;
    if stored.as_bytes() != data {
        return Err("the node has other bytes".into());
    }
    Ok(taken)
}
