//! PDO mappings of any entries: what a node takes is carried bit for bit, against a model that goes bit by bit (CiA 301, 7.4.7).

use can::{Frame, Instant, Station};
use canopen::od::{Access, DataType, Entry, FREE_PLACES, Kind, RowFacts, Table};
use canopen::sdo::wire::Reply;
use canopen::{AbortCode, Mux, Node, NodeId, NodeProfile};
use sim::machine::Boxed;
use std::sync::LazyLock;

/// What has an entry: three bytes each, see [`entry`]; then what an RPDO carries.
pub(super) const SAMPLES: &[&[u8]] = &[
    // Two entries: a byte and a word; a BOOLEAN, 24 bits and a dummy entry; a PDO of eight booleans.
    b"\x02\x04\0\0\x05\0\0\x11\x22\x33\x44",
    b"\x03\0\0\0\x0D\0\0\x40\0\0\xFF\xFE\xFD\xFC\xFB",
    b"\x08\x16\0\0\x17\0\0\x18\0\0\x19\0\0\x1A\0\0\x1B\0\0\x1C\0\0\x1D\0\0\xA5",
    // Multiplexed, both modes; more entries than there are.
    b"\xFF\x84\0\x20\0\x01\x02\x03\x04",
    b"\xFE\x07\0\x60\x01\x01\x02\x03\x04",
    b"\x41\0\0\0",
];

/// Objects of every type that has a length, and booleans: 2000h and on.
static TYPES: LazyLock<Vec<DataType>> = LazyLock::new(|| {
    let with_length = DataType::ALL.iter().copied().filter(|data_type| data_type.kind() != Kind::Bytes);
    with_length.chain([DataType::Boolean; 10]).collect()
});

static PROFILE: LazyLock<&'static NodeProfile> = LazyLock::new(|| {
    let rw = |index, sub_index, data_type| Entry::new(index, sub_index, data_type, Access::ReadWrite, "row", "");
    let mut rows = Vec::new();
    for (parameter, mapping, cob_id) in [(0x1400, 0x1600, 0x204), (0x1800, 0x1A00, 0x184)] {
        rows.push(rw(parameter, 1, DataType::Unsigned32).default(cob_id | 1 << 31));
        rows.push(rw(parameter, 2, DataType::Unsigned8).default(255));
        rows.push(rw(mapping, 0, DataType::Unsigned8));
        rows.extend((1..=64).map(|sub_index| rw(mapping, sub_index, DataType::Unsigned32)));
    }
    rows.push(rw(0x1FA0, 1, DataType::Unsigned32));
    rows.push(rw(0x1FD0, 1, DataType::Unsigned64));
    rows.extend((0x2000..).zip(TYPES.iter()).map(|(index, data_type)| rw(index, 0, *data_type).mappable()));
    // What cannot be mapped.
    rows.push(rw(0x3000, 0, DataType::Unsigned8));
    rows.sort_by_key(|row| row.mux().key());
    let rows: &'static [Entry] = rows.leak();
    let (facts, places) = (vec![RowFacts::NONE; rows.len()].leak(), vec![FREE_PLACES; rows.len()].leak());
    let table = Box::leak(Box::new(Table::at_run_time(rows, facts, places).expect("rows that ascend")));
    Box::leak(Box::new(NodeProfile::cia_301(table)))
});

/// An entry of a mapping: most name an object with its length.
fn entry([kind, index, bits]: [u8; 3]) -> u32 {
    let object = |position: usize| (0x2000 + position as u32) << 16 | u32::from(TYPES[position].bits());
    match kind {
        0..0x40 => object(usize::from(kind) % TYPES.len()) ^ u32::from(bits),
        // A dummy entry of a type, and anything.
        0x40..0x80 => u32::from(kind % 16) << 16 | u32::from(index) << 8 | u32::from(bits),
        _ => u32::from(kind % 0x40) << 24 | u32::from(index) << 16 | u32::from(bits),
    }
}

struct Bench(Node<Boxed>);

impl Bench {
    /// What the server answers to a download.
    fn write(&mut self, mux: Mux, data: &[u8]) -> Result<(), AbortCode> {
        let [low, high] = mux.index.to_le_bytes();
        let mut request = [0x23 | (4 - data.len() as u8) << 2, low, high, mux.sub_index, 0, 0, 0, 0];
        request[4..4 + data.len()].copy_from_slice(data);
        let sent = self.send(&Frame::full(canopen::connection_set::sdo_request(node_id()), request));
        let reply = sent.iter().find(|frame| frame.id() == canopen::connection_set::sdo_reply(node_id()));
        match Reply::parse(reply.expect("an answer").padded()) {
            Reply::Abort(_, code) => Err(code),
            _ => Ok(()),
        }
    }

    fn send(&mut self, frame: &Frame) -> Vec<Frame> {
        self.0.handle_frame(frame, Instant::ZERO);
        while self.0.poll_event().is_some() {}
        std::iter::from_fn(|| self.0.poll_transmit()).collect()
    }

    fn bytes(&self, index: u16) -> Vec<u8> {
        let view = self.0.dictionary().view();
        let mut bytes = [0; 8];
        let length = view.copy(view.table().find(Mux::new(index, 0)).expect("an object"), &mut bytes);
        bytes[..length].to_vec()
    }
}

fn node_id() -> NodeId {
    NodeId::new(4).expect("4 is a node-ID")
}

/// A mapping is refused with a code of the standard, or it has at most 64 bits and every PDO carries every object's bits at their place and
/// changes no other object.
pub(super) fn pdo_mapping(data: &[u8]) {
    let Some((count, data)) = data.split_first() else { return };
    let mut bench = Bench(Node::new(*PROFILE, node_id()));
    bench.0.boot(Instant::ZERO);
    bench.send(&Frame::new(canopen::connection_set::NMT, &[1, 4]));
    let mut chunks = data.chunks_exact(3);
    let entries: Vec<u32> =
        chunks.by_ref().take((*count).min(64).into()).map(|of| entry([of[0], of[1], of[2]])).collect();
    let rest: Vec<u8> = data.iter().copied().skip(entries.len() * 3).chain([0x5A; 8]).take(8).collect();
    for (mapping, cob_id) in [(0x1600, 0x204_u32), (0x1A00, 0x184)] {
        let mut fields = Vec::new();
        for (sub_index, entry) in (1..).zip(&entries) {
            match bench.write(Mux::new(mapping, sub_index), &entry.to_le_bytes()) {
                Ok(()) => fields.push(*entry),
                Err(code) => return refused(code),
            }
        }
        match bench.write(Mux::new(mapping, 0), &[*count]) {
            Err(code) => return refused(code),
            Ok(()) => assert_eq!(bench.write(Mux::new(mapping - 0x200, 1), &cob_id.to_le_bytes()), Ok(())),
        }
        if usize::from(*count) == fields.len() && !fields.is_empty() {
            carries(&mut bench, mapping, &fields, &rest);
        } else {
            // Multiplexed, or nothing.
            bench.send(&Frame::new(can::CanId::standard(cob_id as u16), &rest));
        }
    }
}

fn refused(code: AbortCode) {
    let of_mapping = [AbortCode::NO_SUCH_OBJECT, AbortCode::NOT_MAPPABLE, AbortCode::PDO_TOO_LONG];
    assert!(of_mapping.contains(&code) || code == AbortCode::NO_SUCH_SUB_INDEX, "{code}");
}

fn bit(data: &[u8], n: usize) -> bool {
    data[n / 8] >> (n % 8) & 1 == 1
}

fn carries(bench: &mut Bench, mapping: u16, fields: &[u32], data: &[u8]) {
    let length = fields.iter().map(|field| (field & 0xFF) as usize).sum::<usize>();
    assert!((1..=64).contains(&length), "{length} bits were taken: {fields:08X?}");
    if mapping == 0x1600 {
        let before: Vec<Vec<u8>> = (0x2000..).zip(TYPES.iter()).map(|(index, _)| bench.bytes(index)).collect();
        // Short by one byte: nothing of it is used.
        bench.send(&Frame::new(can::CanId::standard(0x204), &data[..length.div_ceil(8) - 1]));
        assert!((0x2000..).zip(&before).all(|(index, before)| bench.bytes(index) == *before), "half applied");
        bench.send(&Frame::new(can::CanId::standard(0x204), &data[..length.div_ceil(8)]));
        let mut expected = before;
        let mut at = 0;
        for field in fields {
            let (index, bits) = (field >> 16, (field & 0xFF) as usize);
            if let Some(value) = index.checked_sub(0x2000).and_then(|position| expected.get_mut(position as usize)) {
                value.fill(0);
                (0..bits).for_each(|n| value[n / 8] |= u8::from(bit(data, at + n)) << (n % 8));
            }
            at += bits;
        }
        for (index, expected) in (0x2000..).zip(expected) {
            assert_eq!(bench.bytes(index), expected, "{index:04X}h of {fields:08X?}");
        }
    } else {
        let sent = bench.send(&Frame::remote(can::CanId::standard(0x184), 8));
        let pdo = sent.iter().find(|frame| frame.id() == can::CanId::standard(0x184)).expect("it answers");
        assert_eq!(usize::from(pdo.dlc()), length.div_ceil(8));
        let mut at = 0;
        for field in fields {
            let value = bench.bytes((field >> 16) as u16);
            for n in 0..(field & 0xFF) as usize {
                assert_eq!(bit(pdo.data(), at + n), bit(&value, n), "bit {n} of {field:08X}h in {pdo}");
            }
            at += (field & 0xFF) as usize;
        }
    }
}
