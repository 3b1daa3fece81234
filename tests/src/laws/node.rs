//! The SDO protocol and a whole node over the ZLAC8030L's object table, under absurd frames.

use std::collections::HashMap;

use can::{CanId, Frame, Instant, Station};
use canopen::od::{Access, Fixed};
use canopen::sdo::wire;
use canopen::{Node, NodeId, NodeProfile};
use drives::zlac8030l::objects::{ROW_COUNT, TABLE};

use super::selected_frame::selected_frame;

pub(super) const SDO_WIRE_SAMPLES: &[&[u8]] = &[
    b"\x2B\x40\x60\x00\x06\x00\x00\x00",
    b"\x40\x41\x60\x00\x00\x00\x00\x00",
    b"\x80\x00\x10\x00\x01\x00\x04\x05",
    b"\x21\xFF\x60\x00\x04\x00\x00\x00",
    b"\x07\x01\x02\x03\x04\x00\x00\x00",
];

/// A chunk is a selector, a length and eight bytes: see [`selected_frame`].
pub(super) const NODE_SAMPLES: &[&[u8]] = &[
    b"\0\x08\x2B\x40\x60\x00\x06\x00\x00\x00\0\x08\x40\x41\x60\x00\x00\x00\x00\x00",
    b"\0\x08\x21\xFF\x60\x00\x04\x00\x00\x00\0\x08\x07\x01\x02\x03\x04\x00\x00\x00",
    b"\0\x08\x2F\x00\x1A\x00\x00\x00\x00\x00\0\x08\x23\x00\x1A\x01\x20\x00\x6C\x60\0\x08\x2F\x00\x1A\x00\x01\x00\x00\x00",
    b"\x01\x02\x01\x04\0\0\0\0\0\0\x02\0\0\0\0\0\0\0\0\0\x03\x02\x06\0\0\0\0\0\0\0",
    b"\0\x08\x23\x00\x14\x01\x04\x02\x00\x80\0\x08\x2F\x00\x18\x02\x01\x00\x00\x00\x01\x02\x01\x00\0\0\0\0\0\0",
];

// Blocks have a law of their own.
static PROFILE: NodeProfile = NodeProfile { sdo_block_size: 0, ..NodeProfile::cia_301(&TABLE) };
const NODE_ID: u8 = 4;

/// What a selector picks: SDO, NMT, SYNC, the four RPDOs, a heartbeat.
const IDS: [u16; 8] = [0x604, 0x000, 0x080, 0x204, 0x304, 0x404, 0x504, 0x704];

/// What a request or a reply was read as is what it reads as when it is written again.
pub(super) fn sdo_wire(data: &[u8]) {
    let Some(raw) = data.first_chunk::<8>() else { return };
    let request = wire::Request::parse(raw);
    assert_eq!(wire::Request::parse(&request.emit()), request, "{raw:02X?}");
    assert!(request.used_length() <= 8, "{raw:02X?}");
    let reply = wire::Reply::parse(raw);
    assert_eq!(wire::Reply::parse(&reply.emit()), reply, "{raw:02X?}");
}

/// Any sequence of frames leaves a node that answers an SDO request with at most one frame of eight bytes, whose
/// read-only objects have not changed and whose other objects lie within their limits.
pub(super) fn node(data: &[u8]) {
    let mut node: Node<Fixed<ROW_COUNT>> = Node::new(&PROFILE, NodeId::new(NODE_ID).expect("4 is a node-ID"));
    let mut now = Instant::ZERO;
    node.boot(now);
    drain(&mut node);
    let first = values(&node);
    for chunk in data.chunks(10) {
        now = now.plus_nanos(u64::from(chunk[0]) * 100_000);
        node.handle_timeout(now);
        drain(&mut node);
        let frame = selected_frame(chunk, &IDS);
        node.handle_frame(&frame, now);
        let sent = drain(&mut node);
        let answers: Vec<&Frame> = sent.iter().filter(|sent| sent.id() == CanId::standard(0x580 + 4)).collect();
        assert!(answers.len() <= 1, "{frame} was answered by {answers:?}");
        assert!(answers.iter().all(|answer| answer.dlc() == 8), "{frame} was answered by {answers:?}");
        judge(&node, &first, &frame);
    }
}

fn drain(node: &mut Node<Fixed<ROW_COUNT>>) -> Vec<Frame> {
    while node.poll_event().is_some() {}
    std::iter::from_fn(|| node.poll_transmit()).take(64).collect()
}

fn values(node: &Node<Fixed<ROW_COUNT>>) -> HashMap<u32, i64> {
    TABLE.iter().map(|(slot, row)| (row.mux().key(), node.dictionary().value(slot))).collect()
}

fn judge(node: &Node<Fixed<ROW_COUNT>>, first: &HashMap<u32, i64>, frame: &Frame) {
    for (slot, row) in TABLE.iter() {
        let value = node.dictionary().value(slot);
        if matches!(row.access, Access::ReadOnly | Access::Const) {
            assert_eq!(value, first[&row.mux().key()], "{frame} changed the read-only {}", row.mux());
        } else {
            assert_eq!(row.check_value(value), Ok(()), "{frame} put {value} into {}", row.mux());
        }
    }
}
