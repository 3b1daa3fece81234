//! SDO block transfer of both sides under any frames.

use std::time::Duration;

use can::{Frame, Instant, Station};
use canopen::od::{Access, DataType, Entry, Fixed, Index, Table};
use canopen::sdo::Client;
use canopen::sdo::client::{Failure, Outcome};
use canopen::{Mux, Node, NodeId, NodeProfile, connection_set};

const NODE: NodeId = NodeId::new(4).expect("4 is a node-ID");
const DOMAIN: Mux = Mux::new(0x2000, 0);
const CAPACITY: u32 = 300;

static ROWS: [Entry; 3] = [
    Entry::new(0x1008, 0, DataType::VisibleString, Access::Const, "name", "Name")
        .text("a name of more than seven letters"),
    Entry::new(0x2000, 0, DataType::Domain, Access::ReadWrite, "domain", "Domain")
        .bytes(b"as delivered")
        .capacity(CAPACITY),
    Entry::new(0x2001, 0, DataType::Unsigned32, Access::ReadWrite, "number", "Number").range(0, 1000),
];
static INDEX: Index<3> = Index::of(&ROWS);
static TABLE: Table = Table::new(&ROWS, &INDEX);
static PROFILE: NodeProfile = NodeProfile::cia_301(&TABLE);

type Room = Fixed<3, { TABLE.byte_count() }>;

/// Bytes of a chunk: how much time passes, then a frame.
const CHUNK: usize = 9;

/// Requests, one after the other.
pub(super) const SAMPLES: &[&[u8]] = &[
    // 2000h: two segments, 14 bytes; their end has the checksum of "fourteen bytes".
    b"\0\xC6\x00\x20\0\x0E\0\0\0\0\x01fourtee\0\x82n bytes\0\xC1\xB2\x44\0\0\0\0\0",
    // A gap; the rest again; an abort.
    b"\0\xC4\x00\x20\0\0\0\0\0\0\x01aaaaaaa\0\x03ccccccc\0\x84ddddddd\0\x01bbbbbbb\0\x80\x00\x20\0\0\0\0\x08",
    // Uploads of 1008h, in blocks of two and with a threshold, and of 2001h; time-outs.
    b"\0\xA4\x08\x10\0\x02\0\0\0\0\xA3\0\0\0\0\0\0\0\0\xA2\x01\x7F\0\0\0\0\0\xFF\xA2\x04\x7F\0\0\0\0\0\0\xA1\0\0\0\0\0\0\0",
    b"\0\xA0\x08\x10\0\x7F\x40\0\0\0\x60\0\0\0\0\0\0\0\xFF\x70\0\0\0\0\0\0\0\0\xA4\x01\x20\0\x7F\0\0\0\0\xA3\0\0\0\0\0\0\0",
    // Replies to a client: what begins and ends an upload, and a download.
    b"\0\xC6\x00\x20\0\x0E\0\0\0\0\x01fourtee\0\x82n bytes\0\xC1\xB2\x44\0\0\0\0\0",
    b"\0\xA4\x00\x20\0\x02\0\0\0\0\xA2\x02\x05\0\0\0\0\0\0\xA2\x00\x7F\0\0\0\0\0\0\xA1\0\0\0\0\0\0\0",
];

/// Any frames leave a server that sends no more than a block in answer to one, whose values change with a confirmed download
/// only, and that serves the next client; and a client that ends, within its buffer.
pub(super) fn sdo_blocks(data: &[u8]) {
    server(data);
    for writes in [false, true] {
        client(data, writes);
    }
}

fn chunks(data: &[u8]) -> impl Iterator<Item = (u64, [u8; 8])> + '_ {
    let whole = data.chunks(CHUNK);
    whole.map(|chunk| {
        let frame = std::array::from_fn(|at| chunk.get(at + 1).copied().unwrap_or(0));
        (u64::from(chunk[0]) * 4_000_000, frame)
    })
}

fn server(data: &[u8]) {
    let mut node: Node<Room> = Node::new(&PROFILE, NODE);
    let mut now = Instant::ZERO;
    node.boot(now);
    drain(&mut node);
    let mut before = values(&node);
    for (wait_ns, raw) in chunks(data) {
        now = now.plus_nanos(wait_ns);
        node.handle_timeout(now);
        let unasked = drain(&mut node);
        assert!(unasked.len() <= 1, "{unasked:?}");
        assert_eq!(values(&node), before, "time changes no value");
        node.handle_frame(&Frame::full(connection_set::sdo_request(NODE), raw), now);
        let sent = drain(&mut node);
        assert!(sent.len() <= 127, "{} frames after {raw:02X?}", sent.len());
        let after = values(&node);
        let confirmed = sent.iter().any(|frame| matches!(frame.data(), [0x60 | 0x20 | 0x30 | 0xA1, ..]));
        assert!(after == before || confirmed, "{raw:02X?} changed a value and was answered by {sent:?}");
        before = after;
    }
    // The client of the next transfer begins it with an abort of what may be left.
    node.handle_frame(&Frame::full(connection_set::sdo_request(NODE), [0x80, 0, 0x20, 0, 0, 0, 0, 8]), now);
    drain(&mut node);
    let value: Vec<u8> = (0..CAPACITY as usize).map(|at| at as u8).collect();
    let mut writer = Client::new(NODE, Duration::from_secs(1));
    writer.download_blocks(DOMAIN, &value, now);
    assert_eq!(run(writer, &mut node, &mut value.clone(), now), Ok(Outcome::Downloaded { mux: DOMAIN }));
    let (mut reader, mut buffer) = (Client::new(NODE, Duration::from_secs(1)), vec![0; CAPACITY as usize]);
    reader.upload_blocks(DOMAIN, 0, now);
    let length = value.len();
    assert_eq!(run(reader, &mut node, &mut buffer, now), Ok(Outcome::Uploaded { mux: DOMAIN, length }));
    assert_eq!(buffer, value);
}

fn values(node: &Node<Room>) -> (Vec<u8>, u32) {
    let slot = |mux| TABLE.find(mux).expect("a row");
    let number = node.dictionary().raw(slot(Mux::new(0x2001, 0)));
    assert!(number <= 1000, "{number}");
    (node.dictionary().view().long_bytes(slot(DOMAIN)).to_vec(), number)
}

fn drain(node: &mut Node<Room>) -> Vec<Frame> {
    while node.poll_event().is_some() {}
    let sent: Vec<Frame> = std::iter::from_fn(|| node.poll_transmit()).take(200).collect();
    assert!(sent.iter().all(|frame| frame.dlc() == 8 || frame.id() == connection_set::heartbeat(NODE)));
    sent
}

fn run(mut client: Client, node: &mut Node<Room>, buffer: &mut [u8], now: Instant) -> Result<Outcome, Failure> {
    for _ in 0..100 {
        while let Some(request) = client.poll_transmit(buffer) {
            node.handle_frame(&request, now);
        }
        while let Some(reply) = node.poll_transmit() {
            if let Some(result) = client.handle_frame(&reply, buffer, now) {
                while let Some(last) = client.poll_transmit(buffer) {
                    node.handle_frame(&last, now);
                }
                return result;
            }
        }
    }
    panic!("a transfer that does not end");
}

fn client(data: &[u8], writes: bool) {
    let mut client = Client::new(NODE, Duration::from_millis(500));
    let (mut buffer, mut now) = (vec![7; 100], Instant::ZERO);
    if writes {
        client.download_blocks(DOMAIN, &buffer, now);
    } else {
        client.upload_blocks(DOMAIN, 0, now);
    }
    for (wait_ns, raw) in chunks(data) {
        let sent = std::iter::from_fn(|| client.poll_transmit(&buffer)).take(200).count();
        assert!(sent <= 128, "{sent} frames at once");
        now = now.plus_nanos(wait_ns);
        let reply = Frame::full(connection_set::sdo_reply(NODE), raw);
        let mut ended = client.handle_timeout(now).map(Err);
        if ended.is_none() {
            let needed = client.needed_room(&reply).unwrap_or(0);
            if needed > buffer.len() && needed < 2000 {
                buffer.resize(needed, 0);
            }
            ended = client.handle_frame(&reply, &mut buffer, now);
        }
        match ended {
            Some(Ok(Outcome::Uploaded { length, .. })) => assert!(length <= buffer.len() && !writes),
            Some(Ok(Outcome::Downloaded { .. })) => assert!(writes),
            Some(Err(_)) | None => {}
        }
        if ended.is_some() {
            assert!(!client.is_busy() && client.poll_timeout().is_none());
            return;
        }
    }
    // Nothing comes any more: it ends by its time.
    for _ in 0..1000 {
        let Some(due) = client.poll_timeout() else { return };
        while client.poll_transmit(&buffer).is_some() {}
        client.handle_timeout(due);
    }
    panic!("it waits for ever");
}
