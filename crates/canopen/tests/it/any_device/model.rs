//! A reference model of the dictionary against the node, over random operations of three clients in every kind of transfer.
//!
//! The model is a map from objects to bytes with the rules of CiA 301, 7.2.4.3.17 written once more, as plain as can be: it knows
//! no cells, tables and transfers.

use std::collections::BTreeMap;
use std::time::Duration;

use can::{CanId, Instant, Station};
use canopen::od::{Access, DataType, Entry};
use canopen::sdo::Client;
use canopen::sdo::client::{Failure, Outcome};
use canopen::{AbortCode, Mux, Node};

use crate::any_device::channels::server;
use crate::any_device::device::{Boxed, Numbers, node, rw};

/// How the model sees an object.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// So many bytes, from the smallest to the largest value.
    Number(usize, u64, u64),
    /// Up to so many bytes.
    Bytes(usize),
}

struct Object {
    kind: Kind,
    readable: bool,
    writable: bool,
    value: Vec<u8>,
}

struct Model(BTreeMap<(u16, u8), Object>);

impl Model {
    fn missing(&self, mux: Mux) -> AbortCode {
        let known = self.0.keys().any(|(index, _)| *index == mux.index);
        if known { AbortCode::NO_SUCH_SUB_INDEX } else { AbortCode::NO_SUCH_OBJECT }
    }

    fn read(&self, mux: Mux) -> Result<Vec<u8>, AbortCode> {
        let object = self.0.get(&(mux.index, mux.sub_index)).ok_or(self.missing(mux))?;
        if object.readable { Ok(object.value.clone()) } else { Err(AbortCode::WRITE_ONLY) }
    }

    fn write(&mut self, mux: Mux, bytes: &[u8]) -> Result<(), AbortCode> {
        let missing = self.missing(mux);
        let object = self.0.get_mut(&(mux.index, mux.sub_index)).ok_or(missing)?;
        if !object.writable {
            return Err(AbortCode::READ_ONLY);
        }
        match object.kind {
            Kind::Number(size, ..) if bytes.len() > size => return Err(AbortCode::TOO_LONG),
            Kind::Number(size, ..) if bytes.len() < size => return Err(AbortCode::TOO_SHORT),
            Kind::Number(_, min, max) => match number(bytes) {
                value if value < min => return Err(AbortCode::VALUE_TOO_LOW),
                value if value > max => return Err(AbortCode::VALUE_TOO_HIGH),
                _ => {}
            },
            Kind::Bytes(most) if bytes.len() > most => return Err(AbortCode::TOO_LONG),
            Kind::Bytes(_) => {}
        }
        object.value = bytes.to_vec();
        Ok(())
    }
}

fn number(bytes: &[u8]) -> u64 {
    bytes.iter().rev().fold(0, |value, byte| value << 8 | u64::from(*byte))
}

/// Objects of both, with the same rules.
fn both(numbers: &mut Numbers) -> (Node<Boxed>, Model) {
    let mut rows: Vec<Entry> = [server(0x1201, 0), server(0x1202, 1)].concat();
    let mut model = BTreeMap::new();
    for index in 0x2000..0x2020_u16 {
        for sub_index in 0..1 + numbers.below(3) as u8 {
            let (row, kind) = match numbers.below(6) {
                0 => (rw(index, sub_index, DataType::Unsigned8), Kind::Number(1, 0, 0xFF)),
                1 => (rw(index, sub_index, DataType::Unsigned16).range(100, 60_000), Kind::Number(2, 100, 60_000)),
                2 => (rw(index, sub_index, DataType::Unsigned32).range(0, 0xFFFF), Kind::Number(4, 0, 0xFFFF)),
                3 => (rw(index, sub_index, DataType::Unsigned64), Kind::Number(8, 0, u64::MAX)),
                4 => (rw(index, sub_index, DataType::OctetString).capacity(9), Kind::Bytes(9)),
                _ => (rw(index, sub_index, DataType::Domain).capacity(1000), Kind::Bytes(1000)),
            };
            let (access, readable, writable) = match numbers.below(6) {
                0 => (Access::ReadOnly, true, false),
                1 => (Access::WriteOnly, false, true),
                _ => (Access::ReadWrite, true, true),
            };
            let value = match kind {
                Kind::Number(size, ..) => vec![0; size],
                Kind::Bytes(_) => Vec::new(),
            };
            rows.push(Entry { access, ..row });
            model.insert((index, sub_index), Object { kind, readable, writable, value });
        }
    }
    (node(rows), Model(model))
}

/// Up to 1,100 bytes, most often as many as the object has, or about.
fn some_bytes(model: &Model, mux: Mux, numbers: &mut Numbers) -> Vec<u8> {
    let length = match (model.0.get(&(mux.index, mux.sub_index)).map(|object| object.kind), numbers.below(8)) {
        (Some(Kind::Number(size, ..)), lot) if lot > 1 => size,
        (Some(Kind::Bytes(most)), lot) if lot > 3 => numbers.below(most + 1),
        (Some(Kind::Bytes(most)), 3) => most + 1,
        (_, 0) => numbers.below(1100),
        _ => 1 + numbers.below(9),
    };
    numbers.bytes(length)
}

fn run(client: &mut Client, node: &mut Node<Boxed>, buffer: &mut [u8]) -> Result<Outcome, Failure> {
    loop {
        while let Some(request) = client.poll_transmit(buffer) {
            node.handle_frame(&request, Instant::ZERO);
        }
        while let Some(reply) = node.poll_transmit() {
            while node.poll_event().is_some() {}
            if let Some(result) = client.handle_frame(&reply, buffer, Instant::ZERO) {
                while let Some(last) = client.poll_transmit(buffer) {
                    node.handle_frame(&last, Instant::ZERO);
                }
                while node.poll_transmit().is_some() {}
                return result;
            }
        }
    }
}

fn refused(failure: &Failure) -> AbortCode {
    match failure {
        Failure::Aborted { code, .. } => *code,
        other => panic!("{other:?}"),
    }
}

#[test]
fn the_node_does_what_a_plain_model_of_its_dictionary_does() {
    let mut numbers = Numbers(0xD1C7);
    let (mut reads, mut writes) = ([0; 2], [0; 2]);
    for _ in 0..20 {
        let (mut node, mut model) = both(&mut numbers);
        let mut clients = [(0x604, 0x584), (0x680, 0x690), (0x681, 0x691)].map(|(request, reply)| {
            Client::on(CanId::standard(request), CanId::standard(reply), Duration::from_secs(1))
        });
        for operation in 0..1000 {
            let mux = Mux::new(0x2000 + numbers.below(0x21) as u16, numbers.below(3) as u8);
            let client = &mut clients[numbers.below(3)];
            if numbers.below(2) == 0 {
                let expected = model.read(mux);
                match numbers.below(3) {
                    0 => client.upload_blocks(mux, 0, Instant::ZERO),
                    1 => client.upload_blocks(mux, 21, Instant::ZERO),
                    _ => client.upload(mux, Instant::ZERO),
                }
                let mut buffer = vec![0xEE; 1000];
                let found = match run(client, &mut node, &mut buffer) {
                    Ok(Outcome::Uploaded { length, .. }) => Ok(buffer[..length].to_vec()),
                    Ok(other) => panic!("{other:?}"),
                    Err(failure) => Err(refused(&failure)),
                };
                reads[usize::from(found.is_ok())] += 1;
                assert_eq!(found, expected, "operation {operation}: read {mux}");
            } else {
                let mut bytes = some_bytes(&model, mux, &mut numbers);
                let expected = model.write(mux, &bytes);
                match numbers.below(3) {
                    0 => client.download_blocks(mux, &bytes, Instant::ZERO),
                    1 => client.download_segmented(mux, &bytes, Instant::ZERO),
                    _ => client.download(mux, &bytes, Instant::ZERO),
                }
                let found = run(client, &mut node, &mut bytes).map(|_| ()).map_err(|failure| refused(&failure));
                writes[usize::from(found.is_ok())] += 1;
                assert_eq!(found, expected, "operation {operation}: write {} bytes to {mux}", bytes.len());
            }
        }
        for ((index, sub_index), object) in &model.0 {
            let view = node.dictionary().view();
            let mut stored = vec![0; 1000];
            let length = view.copy(node.table().find(Mux::new(*index, *sub_index)).unwrap(), &mut stored);
            assert_eq!(stored[..length], object.value, "{index:04X}h:{sub_index:02X}");
        }
    }
    assert!(reads.iter().chain(&writes).all(|count| *count > 1500), "{reads:?} {writes:?}");
}
