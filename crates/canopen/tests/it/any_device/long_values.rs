//! Values longer than a cell over SDO (CiA 301, 7.2.4.3).

use std::time::Duration;

use can::{Instant, Station};
use canopen::od::{DataType, Entry, Kind, Value};
use canopen::sdo::client::Failure;
use canopen::{AbortCode, Mux, Node, NodeEvent, NodeProfile};

use crate::any_device::device::{
    Boxed, Numbers, answer, download, drain, node, node_of, rw, table, talk, upload, written,
};

const CAPACITY: u32 = 20;

fn every_type() -> Vec<Entry> {
    DataType::ALL.iter().map(|data_type| rw(place(*data_type).index, 0, *data_type).capacity(CAPACITY)).collect()
}

fn place(data_type: DataType) -> Mux {
    Mux::new(0x2000 + data_type.code(), 0)
}

fn aborted(result: Result<(), Failure>) -> Option<AbortCode> {
    match result {
        Err(Failure::Aborted { code, .. }) => Some(code),
        _ => None,
    }
}

#[test]
fn values_of_every_type_travel_both_ways_in_one_frame_and_in_segments() {
    let (mut node, mut numbers) = (node(every_type()), Numbers(1));
    for round in 0..200 {
        for data_type in DataType::ALL {
            let size = match data_type.kind() {
                Kind::Bytes => numbers.below(CAPACITY as usize + 1),
                _ => data_type.size(),
            };
            let mut data = numbers.bytes(size);
            match data_type {
                DataType::Boolean => data[0] &= 1,
                DataType::UnicodeString => data.truncate(size & !1),
                _ => {}
            }
            let mux = place(*data_type);
            assert_eq!(download(&mut node, mux, &data, round % 2 == 0), Ok(()), "{data_type:?} {data:02X?}");
            let events = written(&mut node);
            assert!(matches!(events[..], [NodeEvent::Written { .. }] | [_, NodeEvent::Written { .. }]), "{events:?}");
            assert_eq!(upload(&mut node, mux).as_deref(), Ok(&data[..]), "{data_type:?}");
        }
    }
}

#[test]
fn values_of_another_length_abort_with_0607_0012_and_0607_0013_and_change_nothing() {
    let mut node = node(every_type());
    for data_type in DataType::ALL {
        let mux = place(*data_type);
        let before = upload(&mut node, mux).unwrap();
        let (most, least) = match data_type.kind() {
            Kind::Bytes => (CAPACITY as usize, 0),
            _ => (data_type.size(), data_type.size()),
        };
        for segmented in [false, true] {
            let long = download(&mut node, mux, &vec![1; most + 1], segmented);
            assert_eq!(aborted(long), Some(AbortCode::TOO_LONG), "{data_type:?}");
            if least > 1 {
                let short = download(&mut node, mux, &vec![1; least - 1], segmented);
                assert_eq!(aborted(short), Some(AbortCode::TOO_SHORT), "{data_type:?}");
            }
        }
        assert_eq!(upload(&mut node, mux).unwrap(), before);
    }
    // Half a letter.
    let half = download(&mut node, place(DataType::UnicodeString), b"abc", true);
    assert_eq!(aborted(half), Some(AbortCode::LENGTH_MISMATCH));
}

/// VISIBLE_STRING 2009h, "old text" as delivered, of up to 20 bytes; 2015h INTEGER64; 201Bh UNSIGNED64; 2011h REAL64.
fn device() -> Node<Boxed> {
    node(vec![
        rw(0x2009, 0, DataType::VisibleString).text("old text").capacity(CAPACITY),
        rw(0x200A, 0, DataType::OctetString).bytes(&[1, 2, 3, 4, 5]),
        rw(0x2011, 0, DataType::Real64).default_real(0.5).range_real(-1.0, 1.0),
        rw(0x2015, 0, DataType::Integer64).default(-5).range(-1 << 40, 1 << 40),
        rw(0x201B, 0, DataType::Unsigned64).default_unsigned(u64::MAX).range_unsigned(10, u64::MAX - 1),
        rw(0x200C, 0, DataType::TimeOfDay).bytes(&[0x00, 0x2E, 0x93, 0x02, 1, 0]),
    ])
}

#[test]
fn values_as_delivered_are_those_of_the_rows() {
    let mut node = device();
    assert_eq!(upload(&mut node, Mux::new(0x2009, 0)).unwrap(), b"old text");
    assert_eq!(upload(&mut node, Mux::new(0x2015, 0)).unwrap(), (-5_i64).to_le_bytes());
    assert_eq!(upload(&mut node, Mux::new(0x2011, 0)).unwrap(), 0.5_f64.to_le_bytes());
    let typed = |index| {
        let slot = node.table().find(Mux::new(index, 0)).unwrap();
        node.dictionary().view().typed(slot)
    };
    assert_eq!(typed(0x201B), Value::Unsigned(u64::MAX));
    assert_eq!(typed(0x200C), Value::Time { millis: 43_200_000, days: 1 });
    assert_eq!(typed(0x2009), Value::Bytes(b"old text"));
}

#[test]
fn limits_of_64_bits_and_of_reals_are_held() {
    let mut node = device();
    let mut try_write = |index, data: [u8; 8]| aborted(download(&mut node, Mux::new(index, 0), &data, false));
    let (high, low) = (Some(AbortCode::VALUE_TOO_HIGH), Some(AbortCode::VALUE_TOO_LOW));
    assert_eq!(try_write(0x2015, (1_i64 << 40).to_le_bytes()), None);
    assert_eq!(try_write(0x2015, ((1_i64 << 40) + 1).to_le_bytes()), high);
    assert_eq!(try_write(0x2015, (-(1_i64 << 40) - 1).to_le_bytes()), low);
    assert_eq!(try_write(0x201B, (u64::MAX - 1).to_le_bytes()), None);
    assert_eq!(try_write(0x201B, u64::MAX.to_le_bytes()), high);
    assert_eq!(try_write(0x201B, 9_u64.to_le_bytes()), low);
    assert_eq!(try_write(0x2011, 1.0_f64.to_le_bytes()), None);
    assert_eq!(try_write(0x2011, 1.5_f64.to_le_bytes()), high);
    assert_eq!(try_write(0x2011, f64::NEG_INFINITY.to_le_bytes()), low);
    assert_eq!(try_write(0x2011, f64::NAN.to_le_bytes()), Some(AbortCode::INVALID_VALUE));
}

#[test]
fn a_constant_string_is_read_and_not_written() {
    let mut node = device();
    assert_eq!(upload(&mut node, Mux::new(0x200A, 0)).unwrap(), [1, 2, 3, 4, 5]);
    let write = download(&mut node, Mux::new(0x200A, 0), &[1], false);
    assert_eq!(aborted(write), Some(AbortCode::READ_ONLY));
}

/// The first frames of a download of "twelve bytes" to 2009h, and their answers.
const HALF: [(&str, &str); 2] =
    [("604#210920000C000000", "584#6009200000000000"), ("604#007477656C766520", "584#2000000000000000")];

#[test]
fn a_download_that_ends_half_way_leaves_the_old_value() {
    // The client gives up; the toggle bit stays; a new request comes in between; more bytes than declared; fewer.
    let ends: [(&str, &[&str]); 5] = [
        ("604#8009200000000008", &[]),
        ("604#0062797465732020", &["584#8009200000000305"]),
        ("604#4009200000000000", &["584#4109200008000000"]),
        ("604#1062797465732020", &["584#8009200012000706"]),
        ("604#1D62000000000000", &["584#8009200010000706"]),
    ];
    for (frame, expected) in ends {
        let mut node = device();
        talk(&mut node, &HALF);
        assert_eq!(answer(&mut node, frame), expected, "{frame}");
        assert_eq!(upload(&mut node, Mux::new(0x2009, 0)).unwrap(), b"old text", "after {frame}");
        // Nothing is left of it: a further segment belongs to no transfer.
        assert_eq!(answer(&mut node, "604#1562797465732020"), ["584#8000000001000405"]);
    }
    let mut node = device();
    talk(&mut node, &HALF);
    node.handle_timeout(Instant::ZERO + Duration::from_secs(1));
    assert_eq!(drain(&mut node).iter().map(ToString::to_string).collect::<Vec<_>>(), ["584#8009200000000405"]);
    assert_eq!(upload(&mut node, Mux::new(0x2009, 0)).unwrap(), b"old text");
    talk(&mut node, &HALF);
    assert_eq!(answer(&mut node, "604#1562797465730000"), ["584#3000000000000000"]);
    assert_eq!(upload(&mut node, Mux::new(0x2009, 0)).unwrap(), b"twelve bytes"[..]);
}

#[test]
fn an_upload_gives_the_value_of_its_first_frame() {
    let mut node = device();
    talk(
        &mut node,
        &[("604#4009200000000000", "584#4109200008000000"), ("604#6000000000000000", "584#006F6C6420746578")],
    );
    let slot = node.table().find(Mux::new(0x2009, 0)).unwrap();
    node.dictionary_mut().set_bytes(slot, b"another").unwrap();
    talk(&mut node, &[("604#7000000000000000", "584#1D74000000000000")]);
    assert_eq!(upload(&mut node, Mux::new(0x2009, 0)).unwrap(), b"another");
}

#[test]
fn block_transfer_is_answered_with_0504_0001_by_a_device_without_it() {
    let rows = vec![rw(0x2009, 0, DataType::VisibleString).text("old text").capacity(CAPACITY)];
    let mut node = node_of(NodeProfile { sdo_block_size: 0, ..NodeProfile::cia_301(table(rows)) });
    talk(
        &mut node,
        &[("604#C209200014000000", "584#8009200001000405"), ("604#A009200014000000", "584#8009200001000405")],
    );
}
