//! Several SDO servers of one node under any frames: to each client it is as if it were alone.

use std::sync::LazyLock;

use can::{CanId, Frame, Instant, Station};
use canopen::od::{Access, DataType, Entry, FREE_PLACES, RowFacts, Table};
use canopen::{Mux, Node, NodeId, NodeProfile};
use sim::machine::Boxed;

const NODE: NodeId = NodeId::new(4).expect("4 is a node-ID");
/// Identifiers of requests and replies of each server; the first is the default one.
const SERVERS: [(u16, u16); 3] = [(0x604, 0x584), (0x680, 0x690), (0x681, 0x691)];
/// The object of the first client; the next ones follow. All read the one behind them.
const OWN: u16 = 0x2000;
const COMMON: u16 = OWN + SERVERS.len() as u16;
const CAPACITY: u32 = 60;

/// Bytes of a chunk: whose frame and how much time passes before it, then the frame.
const CHUNK: usize = 9;

pub(super) const SAMPLES: &[&[u8]] = &[
    // Three downloads in segments, one frame each in turn.
    b"\0\x21\0\x20\0\x0A\0\0\0\x01\x21\0\x20\0\x0A\0\0\0\x02\x21\0\x20\0\x0A\0\0\0\0\0abcdefg\x01\0hijklmn\x02\0opqrstu\0\x19vwx\0\0\0\0\x01\x19yzA\0\0\0\0\x02\x19BCD\0\0\0\0",
    // Blocks of two clients at a time, and an upload between.
    b"\0\xC6\0\x20\0\x0A\0\0\0\x01\xC6\0\x20\0\x0A\0\0\0\x02\x40\x03\x20\0\0\0\0\0\0\x01aaaaaaa\x01\x01bbbbbbb\x02\x60\0\0\0\0\0\0\0\x01\x82bbb\0\0\0\0\0\x82aaa\0\0\0\0",
    // Uploads of blocks of all three; a time-out.
    b"\0\xA4\x03\x20\0\x02\0\0\0\x01\xA0\x03\x20\0\x7F\0\0\0\x02\xA4\x03\x20\0\x01\0\0\0\x02\xA3\0\0\0\0\0\0\0\0\xA3\0\0\0\0\0\0\0\x01\xA3\0\0\0\0\0\0\0\0\xA2\x02\x7F\0\0\0\0\0\xFD\xA2\x08\x7F\0\0\0\0\0",
];

/// The node with all servers, and the same with the default one alone.
static PROFILES: LazyLock<[&'static NodeProfile; 2]> = LazyLock::new(|| {
    let rw = |index, sub_index, data_type| Entry::new(index, sub_index, data_type, Access::ReadWrite, "row", "");
    let own = (OWN..COMMON).map(|index| rw(index, 0, DataType::Domain).bytes(b"as delivered").capacity(CAPACITY));
    let common = Entry::new(COMMON, 0, DataType::Domain, Access::ReadOnly, "common", "").capacity(CAPACITY);
    let objects: Vec<Entry> =
        own.chain([common.bytes(b"a value of some more bytes than one block of three has")]).collect();
    let records = (0x1201..).zip(&SERVERS[1..]).flat_map(|(index, (request, reply))| {
        [(1, *request), (2, *reply)].map(|(sub, id)| rw(index, sub, DataType::Unsigned32).default(id.into()))
    });
    [records.chain(objects.clone()).collect(), objects].map(|rows: Vec<Entry>| {
        let rows: &'static [Entry] = rows.leak();
        let (facts, places) = (vec![RowFacts::NONE; rows.len()].leak(), vec![FREE_PLACES; rows.len()].leak());
        let table = Box::leak(Box::new(Table::at_run_time(rows, facts, places).expect("rows that ascend")));
        &*Box::leak(Box::new(NodeProfile::cia_301(table)))
    })
});

/// Each of three clients, whose requests come in any order, gets the answers that it gets from a node that has no other; and its
/// object has the value that it has there.
pub(super) fn sdo_channels(data: &[u8]) {
    let boot = |profile| {
        let mut node: Node<Boxed> = Node::new(profile, NODE);
        node.boot(Instant::ZERO);
        drain(&mut node);
        node
    };
    let mut shared = boot(PROFILES[0]);
    let mut alone = SERVERS.map(|_| boot(PROFILES[1]));
    let mut now = Instant::ZERO;
    for chunk in data.chunks(CHUNK) {
        let client = usize::from(chunk[0] % 4) % SERVERS.len();
        now = now.plus_nanos(u64::from(chunk[0] / 4) * 20_000_000);
        shared.handle_timeout(now);
        assert_same(
            &drain(&mut shared),
            &alone.each_mut().map(|node| {
                node.handle_timeout(now);
                drain(node)
            }),
        );
        let request = request(client, &chunk[1..]);
        shared.handle_frame(&Frame::full(CanId::standard(SERVERS[client].0), request), now);
        alone[client].handle_frame(&Frame::full(CanId::standard(SERVERS[0].0), request), now);
        let mut expected = SERVERS.map(|_| Vec::new());
        expected[client] = drain(&mut alone[client]);
        assert_same(&drain(&mut shared), &expected);
        for (index, node) in (OWN..).zip(&alone) {
            assert_eq!(value(&shared, index), value(node, index), "{index:04X}h after {request:02X?}");
        }
    }
}

/// What a client sends: it knows its own object and the common one.
fn request(client: usize, bytes: &[u8]) -> [u8; 8] {
    let mut request = std::array::from_fn(|at| bytes.get(at).copied().unwrap_or(0));
    let index = u16::from_le_bytes([request[1], request[2]]);
    if (OWN..COMMON).contains(&index) || (0x1200..0x1300).contains(&index) {
        [request[1], request[2]] = (OWN + client as u16).to_le_bytes();
    }
    request
}

fn drain(node: &mut Node<Boxed>) -> Vec<Frame> {
    while node.poll_event().is_some() {}
    std::iter::from_fn(|| node.poll_transmit()).take(1000).collect()
}

/// What comes under the identifier of each server is what a node alone sends under its only one.
fn assert_same(sent: &[Frame], expected: &[Vec<Frame>; 3]) {
    let mut count = 0;
    for ((_, reply), expected) in SERVERS.iter().zip(expected) {
        let of = sent.iter().filter(|frame| frame.id() == CanId::standard(*reply)).map(Frame::padded);
        assert!(of.eq(expected.iter().map(Frame::padded)), "{sent:?} instead of {expected:?} under {reply:03X}h");
        count += expected.len();
    }
    assert_eq!(sent.len(), count, "{sent:?}");
}

fn value(node: &Node<Boxed>, index: u16) -> Vec<u8> {
    let slot = node.table().find(Mux::new(index, 0)).expect("a row");
    node.dictionary().view().long_bytes(slot).to_vec()
}
