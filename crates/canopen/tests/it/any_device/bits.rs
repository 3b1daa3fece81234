//! Mapping at the bit, against a model that goes bit by bit (CiA 301, 7.4.7 and 7.5.2.36).

use canopen::od::{DataType, Entry, Kind};
use canopen::{Mux, Node};

use crate::any_device::device::{Boxed, Numbers, answer, download, drain, node, rw, upload};

/// Objects that can be mapped, of every type that has a length: 2000h and on.
fn objects() -> Vec<DataType> {
    let with_length = DataType::ALL.iter().copied().filter(|data_type| data_type.kind() != Kind::Bytes);
    with_length.chain([DataType::Boolean; 40]).collect()
}

fn record(parameter: u16, mapping: u16, cob_id: i64) -> Vec<Entry> {
    let u32s = (1..=64).map(|sub_index| rw(mapping, sub_index, DataType::Unsigned32));
    let head = [
        rw(parameter, 1, DataType::Unsigned32).default(cob_id),
        rw(parameter, 2, DataType::Unsigned8).default(1),
        rw(mapping, 0, DataType::Unsigned8),
    ];
    head.into_iter().chain(u32s).collect()
}

fn device() -> Node<Boxed> {
    let objects = objects().into_iter().zip(0x2000..).map(|(data_type, index)| rw(index, 0, data_type).mappable());
    let mut rows: Vec<Entry> = objects.collect();
    rows.extend(
        record(0x1400, 0x1600, 0x204).into_iter().map(|row| if row.sub_index == 2 { row.default(255) } else { row }),
    );
    rows.extend(record(0x1800, 0x1A00, 0x184));
    rows.push(rw(0x1005, 0, DataType::Unsigned32).default(0x80));
    node(rows)
}

/// A field of a PDO: an object, or a dummy entry for a type.
#[derive(Clone, Copy, Debug)]
enum Field {
    Object(u16, DataType),
    Dummy(DataType),
}

impl Field {
    fn entry(self) -> u32 {
        let (index, data_type) = match self {
            Self::Object(index, data_type) => (index, data_type),
            Self::Dummy(data_type) => (data_type.code(), data_type),
        };
        u32::from(index) << 16 | u32::from(data_type.bits())
    }

    fn bits(self) -> usize {
        match self {
            Self::Object(_, data_type) | Self::Dummy(data_type) => data_type.bits().into(),
        }
    }
}

/// Fields that fill 64 bits more or less, each object at most once.
fn fields(numbers: &mut Numbers, with_dummies: bool) -> Vec<Field> {
    let all = objects();
    let (mut fields, mut used, mut taken) = (Vec::new(), 0, vec![false; all.len()]);
    for _ in 0..64 {
        let at = numbers.below(all.len());
        let dummy = with_dummies && numbers.below(4) == 0;
        let code = 1 + numbers.below(7) as u16;
        let field = if dummy {
            Field::Dummy(DataType::from_code(code).unwrap())
        } else {
            Field::Object(0x2000 + at as u16, all[at])
        };
        if used + field.bits() <= 64 && (dummy || !taken[at]) {
            taken[at] |= !dummy;
            used += field.bits();
            fields.push(field);
        }
    }
    fields
}

fn map(node: &mut Node<Boxed>, mapping: u16, cob_id: u32, fields: &[Field]) {
    let parameter = Mux::new(mapping - 0x200, 1);
    let mut write = |mux: Mux, data: &[u8]| assert_eq!(download(node, mux, data, false), Ok(()), "{mux} {fields:?}");
    write(parameter, &(cob_id | 1 << 31).to_le_bytes());
    write(Mux::new(mapping, 0), &[0]);
    for (field, sub_index) in fields.iter().zip(1..) {
        write(Mux::new(mapping, sub_index), &field.entry().to_le_bytes());
    }
    write(Mux::new(mapping, 0), &[fields.len() as u8]);
    write(parameter, &cob_id.to_le_bytes());
    drain(node);
}

/// Bit `n` of the data is bit `n % 8` of byte `n / 8`.
fn bit(data: &[u8], n: usize) -> bool {
    data[n / 8] >> (n % 8) & 1 == 1
}

fn hexadecimal(data: &[u8]) -> String {
    data.iter().map(|byte| format!("{byte:02X}")).collect()
}

#[test]
fn rpdos_set_the_bits_of_their_objects_and_of_no_other() {
    let mut numbers = Numbers(7);
    for _ in 0..300 {
        let mut node = device();
        let fields = fields(&mut numbers, true);
        map(&mut node, 0x1600, 0x204, &fields);
        answer(&mut node, "000#0104");
        let length = fields.iter().map(|field| field.bits()).sum::<usize>().div_ceil(8);
        let data = numbers.bytes(length);
        answer(&mut node, &format!("204#{}", hexadecimal(&data)));
        let mut at = 0;
        let mut mapped = Vec::new();
        for field in &fields {
            if let Field::Object(index, data_type) = *field {
                let mut expected = vec![0; data_type.size()];
                for n in 0..field.bits() {
                    expected[n / 8] |= u8::from(bit(&data, at + n)) << (n % 8);
                }
                assert_eq!(upload(&mut node, Mux::new(index, 0)).unwrap(), expected, "{index:04X}h of {fields:?}");
                mapped.push(index);
            }
            at += field.bits();
        }
        for (index, data_type) in (0x2000..).zip(objects()).filter(|(index, _)| !mapped.contains(index)) {
            assert_eq!(
                upload(&mut node, Mux::new(index, 0)).unwrap(),
                vec![0; data_type.size()],
                "{index:04X}h is not mapped"
            );
        }
    }
}

#[test]
fn tpdos_carry_the_bits_of_their_objects_one_after_the_other() {
    let mut numbers = Numbers(11);
    for _ in 0..300 {
        let mut node = device();
        let fields = fields(&mut numbers, false);
        map(&mut node, 0x1A00, 0x184, &fields);
        let mut expected = Vec::new();
        for field in &fields {
            let Field::Object(index, data_type) = *field else { continue };
            let mut value = numbers.bytes(data_type.size());
            if data_type == DataType::Boolean {
                value[0] &= 1;
            }
            assert_eq!(download(&mut node, Mux::new(index, 0), &value, false), Ok(()));
            expected.extend((0..field.bits()).map(|n| bit(&value, n)));
        }
        answer(&mut node, "000#0104");
        let mut data = vec![0; expected.len().div_ceil(8)];
        for (n, _) in expected.iter().enumerate().filter(|(_, set)| **set) {
            data[n / 8] |= 1 << (n % 8);
        }
        assert_eq!(answer(&mut node, "080#"), [format!("184#{}", hexadecimal(&data))], "{fields:?}");
    }
}

#[test]
fn a_pdo_has_at_most_64_entries_and_64_bits_and_booleans_take_one_each() {
    let mut node = device();
    let booleans: Vec<Field> = (0..64).map(|_| Field::Dummy(DataType::Boolean)).collect();
    map(&mut node, 0x1600, 0x204, &booleans);
    // 65 entries, and 64 entries of which one has eight bits.
    let mut write = |mux, data: &[u8]| download(&mut node, mux, data, false).is_ok();
    assert!(write(Mux::new(0x1400, 1), &(0x204_u32 | 1 << 31).to_le_bytes()));
    assert!(write(Mux::new(0x1600, 0), &[0]));
    assert!(!write(Mux::new(0x1600, 0), &[65]));
    assert!(write(Mux::new(0x1600, 64), &0x0005_0008_u32.to_le_bytes()));
    assert!(!write(Mux::new(0x1600, 0), &[64]));
    assert!(write(Mux::new(0x1600, 0), &[63]));
}

#[test]
fn a_dummy_entry_has_the_length_of_its_type() {
    let mut node = device();
    let mut write = |mux, data: u32| download(&mut node, mux, &data.to_le_bytes(), false).is_ok();
    assert!(write(Mux::new(0x1400, 1), 0x204 | 1 << 31));
    for code in 1..=7 {
        let bits = u32::from(DataType::from_code(code).unwrap().bits());
        let entry = u32::from(code) << 16;
        assert!(write(Mux::new(0x1600, 1), entry | bits), "type {code}");
        assert!(!write(Mux::new(0x1600, 1), entry | (bits + 8)), "type {code}");
        assert!(!write(Mux::new(0x1600, 1), entry | 1 << 8 | bits), "type {code} has no sub-index 1");
    }
}
