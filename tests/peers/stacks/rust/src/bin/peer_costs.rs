//! What a frame costs a node: ours, canopen-rs and zencan-node, with the same objects and PDOs, set up by the same frames.
//!
//! `peer_costs NODE EXCHANGE COUNT` makes the same exchange that many times and prints the processor time of one in
//! nanoseconds. Each is the whole way of a frame: in, what it does, and every frame that comes of it out.
//!
//! `peer_costs ours upload-blocks COUNT` reads 64 KiB in blocks by our SDO client that many times, `download-blocks` writes them; it
//! prints the time of both sides, the bits of the frames on the wire, and the bits of the data in segments of blocks alone.

use std::hint::black_box;
use std::time::Duration;

use can::{CanId, Frame, INTERFRAME_SPACE_BITS, Instant, Station, frame_bits};
use canopen::od::{Access, DataType, Entry, Fixed, Index, Table};
use canopen::sdo::Client;
use canopen::{Mux, NodeId, NodeProfile};
use canopen_host::eds::Eds;
use zencan_node::Callbacks;
use zencan_node::common::messages::{CanId as ZencanId, CanMessage};

use Access::{Const, ReadOnly, ReadWrite};
use DataType::{Domain, Unsigned8, Unsigned16, Unsigned32, VisibleString};

mod zencan {
    zencan_node::include_modules!(ZENCAN_CONFIG);
}

/// A frame, and the frame that a node answers with, if any.
type Exchange = (&'static str, u16, &'static [u8], Option<(u16, &'static [u8])>);

/// 2000h is a byte with 15 in it, 2001h a word.
const EXCHANGES: &[Exchange] = &[
    ("upload", 0x605, &[0x40, 0, 0x20, 0, 0, 0, 0, 0], Some((0x585, &[0x4F, 0, 0x20, 0, 15, 0, 0, 0]))),
    ("download", 0x605, &[0x2B, 1, 0x20, 0, 0x34, 0x12, 0, 0], Some((0x585, &[0x60, 1, 0x20, 0, 0, 0, 0, 0]))),
    ("rpdo", 0x205, &[0x34, 0x12], None),
    ("tpdo", 0x080, &[], Some((0x185, &[15]))),
    ("foreign", 0x123, &[0, 1, 2, 3, 4, 5, 6, 7], None),
];

/// RPDO 1 carries 2001h, TPDO 1 carries 2000h with each SYNC; then NMT start.
const SET_UP: &[(u16, [u8; 8])] = &[
    (0x605, [0x23, 0x00, 0x14, 1, 0x05, 0x02, 0, 0x80]),
    (0x605, [0x2F, 0x00, 0x16, 0, 0, 0, 0, 0]),
    (0x605, [0x23, 0x00, 0x16, 1, 0x10, 0x00, 0x01, 0x20]),
    (0x605, [0x2F, 0x00, 0x16, 0, 1, 0, 0, 0]),
    (0x605, [0x2F, 0x00, 0x14, 2, 255, 0, 0, 0]),
    (0x605, [0x23, 0x00, 0x14, 1, 0x05, 0x02, 0, 0]),
    (0x605, [0x23, 0x00, 0x18, 1, 0x85, 0x01, 0, 0x80]),
    (0x605, [0x2F, 0x00, 0x1A, 0, 0, 0, 0, 0]),
    (0x605, [0x23, 0x00, 0x1A, 1, 0x08, 0x00, 0x00, 0x20]),
    (0x605, [0x2F, 0x00, 0x1A, 0, 1, 0, 0, 0]),
    (0x605, [0x2F, 0x00, 0x18, 2, 1, 0, 0, 0]),
    (0x605, [0x23, 0x00, 0x18, 1, 0x85, 0x01, 0, 0]),
];

/// What goes out, to be looked at.
type Sent = Vec<(u16, Vec<u8>)>;

/// A node of some stack.
trait Peer {
    /// A frame goes in; what comes out is given to `out`.
    fn exchange(&mut self, id: u16, data: &[u8], out: &mut dyn FnMut(u16, &[u8]));

    /// The value of 2001h.
    fn word(&mut self) -> u16 {
        let mut sent: Sent = Vec::new();
        self.exchange(0x605, &[0x40, 1, 0x20, 0, 0, 0, 0, 0], &mut |id, data| sent.push((id, data.to_vec())));
        u16::from_le_bytes([sent[0].1[4], sent[0].1[5]])
    }
}

const fn row(index: u16, sub_index: u8, data_type: DataType, access: Access) -> Entry {
    Entry::new(index, sub_index, data_type, access, "", "")
}

const LENGTH: usize = 1 << 16;
const LONG: &str = {
    const BYTES: [u8; LENGTH] = {
        let mut bytes = [0; LENGTH];
        let mut at = 0;
        while at < LENGTH {
            bytes[at] = b'0' + ((at as u32).wrapping_mul(0x9E37_79B1) >> 26) as u8;
            at += 1;
        }
        bytes
    };
    match core::str::from_utf8(&BYTES) {
        Ok(text) => text,
        Err(_) => panic!(),
    }
};

/// The objects of stack.eds, the identifier of SYNC, without which a node of ours hears none, and two objects that are long.
static ROWS: [Entry; 31] = [
    row(0x1000, 0, Unsigned32, ReadOnly),
    row(0x1001, 0, Unsigned8, ReadOnly),
    row(0x1005, 0, Unsigned32, ReadWrite).default(0x80),
    row(0x1008, 0, VisibleString, Const).text("A stack under test"),
    row(0x1014, 0, Unsigned32, ReadOnly).node_id_plus(0x80),
    row(0x1017, 0, Unsigned16, ReadWrite),
    row(0x1018, 0, Unsigned8, Const).default(4),
    row(0x1018, 1, Unsigned32, ReadOnly),
    row(0x1018, 2, Unsigned32, ReadOnly).default(1),
    row(0x1018, 3, Unsigned32, ReadOnly).default(1),
    row(0x1018, 4, Unsigned32, ReadOnly).default(1),
    row(0x1400, 0, Unsigned8, Const).default(2),
    row(0x1400, 1, Unsigned32, ReadWrite).node_id_plus(0x200),
    row(0x1400, 2, Unsigned8, ReadWrite).default(255),
    row(0x1600, 0, Unsigned8, ReadWrite).default(1),
    row(0x1600, 1, Unsigned32, ReadWrite).default(0x2001_0010),
    row(0x1600, 2, Unsigned32, ReadWrite),
    row(0x1800, 0, Unsigned8, Const).default(5),
    row(0x1800, 1, Unsigned32, ReadWrite).node_id_plus(0x180),
    row(0x1800, 2, Unsigned8, ReadWrite).default(255),
    row(0x1800, 3, Unsigned16, ReadWrite),
    row(0x1800, 5, Unsigned16, ReadWrite),
    row(0x1A00, 0, Unsigned8, ReadWrite).default(1),
    row(0x1A00, 1, Unsigned32, ReadWrite).default(0x2000_0008),
    row(0x1A00, 2, Unsigned32, ReadWrite),
    row(0x2000, 0, Unsigned8, ReadWrite).default(15).range(10, 20).mappable(),
    row(0x2001, 0, Unsigned16, ReadWrite).mappable(),
    row(0x2002, 0, Unsigned8, Access::WriteOnly),
    row(0x2003, 0, Unsigned16, ReadOnly).default(7).mappable(),
    row(0x2004, 0, VisibleString, Const).text(LONG),
    row(0x2005, 0, Domain, ReadWrite).capacity(LENGTH as u32),
];
static INDEX: Index<31> = Index::of(&ROWS);
static TABLE: Table = Table::new(&ROWS, &INDEX);
static PROFILE: NodeProfile = NodeProfile::cia_301(&TABLE);

struct Ours(canopen::Node<Fixed<31, { TABLE.byte_count() }, 1, 8>>);

impl Peer for Ours {
    fn exchange(&mut self, id: u16, data: &[u8], out: &mut dyn FnMut(u16, &[u8])) {
        let now = Instant::from_micros(1);
        self.0.handle_frame(&Frame::new(CanId::standard(id), data), now);
        while let Some(frame) = self.0.poll_transmit() {
            out(frame.id().raw() as u16, frame.data());
            self.0.handle_transmitted(&frame, now);
        }
        while let Some(event) = self.0.poll_event() {
            black_box(event);
        }
    }
}

struct CanopenRs(canopen_rs::node::Node<32>);

impl Peer for CanopenRs {
    fn exchange(&mut self, id: u16, data: &[u8], out: &mut dyn FnMut(u16, &[u8])) {
        if let Some(frame) = self.0.on_frame(id, data) {
            out(frame.cob_id, frame.data());
        }
        if self.0.take_written_object().is_some_and(|object| (0x1400..0x1C00).contains(&object.index)) {
            self.0.configure_pdos_from_od();
        }
        if id == 0x80 {
            self.0.sync_tpdos().iter().for_each(|frame| out(frame.cob_id, frame.data()));
        }
    }
}

struct Zencan(zencan_node::Node<'static>);

impl Peer for Zencan {
    fn exchange(&mut self, id: u16, data: &[u8], out: &mut dyn FnMut(u16, &[u8])) {
        // What the stack does not want it gives back.
        let _ = zencan::NODE_MBOX.store_message(CanMessage::new(ZencanId::Std(id), data));
        self.0.process(1);
        while let Some(message) = zencan::NODE_MBOX.next_transmit_message() {
            if let ZencanId::Std(id) = message.id {
                out(id, message.data());
            }
        }
    }
}

fn peer(name: &str) -> Box<dyn Peer> {
    match name {
        "ours" => {
            let mut node = canopen::Node::new(&PROFILE, NodeId::new(5).expect("a node-ID"));
            node.boot(Instant::ZERO);
            Box::new(Ours(node))
        }
        "canopen-rs" => {
            let sheet = format!("{}\n[DeviceComissioning]\nNodeID=5\n", include_str!("../../../stack.eds"));
            let dictionary = Eds::parse(&sheet).expect("an EDS").object_dictionary().expect("at most 32 objects");
            let mut node = canopen_rs::node::Node::new(canopen_rs::NodeId::new(5).expect("a node-ID"), dictionary);
            node.boot();
            Box::new(CanopenRs(node))
        }
        "zencan-node" => {
            let id = zencan_node::common::NodeId::new(5).expect("a node-ID");
            let (mailbox, state, table) = (&zencan::NODE_MBOX, &zencan::NODE_STATE, &zencan::OD_TABLE);
            Box::new(Zencan(zencan_node::Node::new(id, Callbacks::new(), mailbox, state, table)))
        }
        other => panic!("expected ours, canopen-rs or zencan-node, got '{other}'"),
    }
}

/// Operational, with its PDOs set up, and answering as it should.
fn ready(name: &str) -> Box<dyn Peer> {
    let mut node = peer(name);
    node.exchange(0x7FF, &[], &mut |_, _| ());
    for (id, data) in SET_UP {
        let mut sent: Sent = Vec::new();
        node.exchange(*id, data, &mut |id, data| sent.push((id, data.to_vec())));
        assert_eq!(sent[0].1[0], 0x60, "{name}: {data:02X?} is answered with {sent:02X?}");
    }
    node.exchange(0, &[1, 5], &mut |_, _| ());
    for (exchange, id, data, answer) in EXCHANGES {
        for _ in 0..3 {
            let mut sent: Sent = Vec::new();
            node.exchange(*id, data, &mut |id, data| sent.push((id, data.to_vec())));
            let expected: Sent = answer.iter().map(|(id, data)| (*id, data.to_vec())).collect();
            assert_eq!(sent, expected, "{name}: {exchange}");
        }
    }
    assert_eq!(node.word(), 0x1234, "{name}: download and RPDO are written");
    node
}

/// A whole transfer in blocks, which `begin` begins; each frame is shown to `on_the_wire`.
fn in_blocks(node: &mut Ours, begin: &Begin, buffer: &mut [u8], mut on_the_wire: impl FnMut(&Frame)) {
    let now = Instant::from_micros(1);
    let server = NodeId::new(5).expect("a node-ID");
    let mut client = Client::new(server, Duration::from_secs(1));
    begin(&mut client, buffer, now);
    loop {
        while let Some(frame) = client.poll_transmit(buffer) {
            on_the_wire(&frame);
            node.0.handle_frame(&frame, now);
        }
        while let Some(frame) = node.0.poll_transmit() {
            on_the_wire(&frame);
            node.0.handle_transmitted(&frame, now);
            if let Some(outcome) = client.handle_frame(&frame, buffer, now) {
                outcome.expect("the transfer");
                while let Some(frame) = client.poll_transmit(buffer) {
                    on_the_wire(&frame);
                    node.0.handle_frame(&frame, now);
                }
                while node.0.poll_event().is_some() {}
                return;
            }
        }
    }
}

/// Begins a transfer in blocks.
type Begin = dyn Fn(&mut Client, &[u8], Instant);

const UPLOADED: Mux = Mux::new(0x2004, 0);
const DOWNLOADED: Mux = Mux::new(0x2005, 0);

fn blocks(is_upload: bool, count: u32) {
    let mut node = canopen::Node::new(&PROFILE, NodeId::new(5).expect("a node-ID"));
    node.boot(Instant::ZERO);
    let mut node = Ours(node);
    node.exchange(0x7FF, &[], &mut |_, _| ());
    let (begin, mut buffer): (&Begin, _) = if is_upload {
        (&|client, _, now| client.upload_blocks(UPLOADED, 0, now), vec![0; LENGTH])
    } else {
        (&|client, data, now| client.download_blocks(DOWNLOADED, data, now), LONG.as_bytes().to_vec())
    };
    let mut bits = 0;
    in_blocks(&mut node, begin, &mut buffer, |frame| bits += frame_bits(frame) + INTERFRAME_SPACE_BITS);
    let stored = node.0.dictionary().view().long_bytes(TABLE.find(DOWNLOADED).expect("it is of the table"));
    assert_eq!(if is_upload { &buffer } else { stored }, LONG.as_bytes());
    let began = processor_time();
    for _ in 0..count {
        in_blocks(black_box(&mut node), begin, &mut buffer, |frame| _ = black_box(frame));
    }
    let taken = processor_time() - began;
    let sender = CanId::standard(if is_upload { 0x585 } else { 0x605 });
    let segments = LONG.as_bytes().chunks(7).enumerate().map(|(number, part)| {
        let mut raw = [0; 8];
        raw[0] = (number % 127 + 1) as u8;
        raw[1..=part.len()].copy_from_slice(part);
        frame_bits(&Frame::full(sender, raw)) + INTERFRAME_SPACE_BITS
    });
    println!("{:.0} {bits} {}", taken.as_nanos() as f64 / f64::from(count.max(1)), segments.sum::<u32>());
}

fn processor_time() -> Duration {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: `time` is a place for one.
    unsafe { libc::clock_gettime(libc::CLOCK_PROCESS_CPUTIME_ID, &mut time) };
    Duration::new(time.tv_sec as u64, time.tv_nsec as u32)
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [name, exchange, count] = &arguments[..] else { panic!("expected NODE EXCHANGE COUNT") };
    if let "upload-blocks" | "download-blocks" = exchange.as_str() {
        return blocks(exchange == "upload-blocks", count.parse().expect("a count"));
    }
    let (_, id, data, _) = EXCHANGES.iter().find(|(name, ..)| name == exchange).expect("an exchange");
    let count: u32 = count.parse().expect("a count");
    let mut node = ready(name);
    let began = processor_time();
    for _ in 0..count {
        black_box(&mut node).exchange(black_box(*id), black_box(data), &mut |id, data| _ = black_box((id, data)));
    }
    let taken = processor_time() - began;
    println!("{:.1}", taken.as_nanos() as f64 / f64::from(count.max(1)));
}
