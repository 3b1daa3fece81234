//! 512 PDOs each way (CiA 301, 7.5.2.35 to 7.5.2.38).

use canopen::od::{DataType, Entry};
use canopen::pdo::PdoNumber;
use canopen::{Mux, Node, NodeEvent};

use can::{Instant, Station};

use crate::any_device::device::{Boxed, answer, drain, node, rw, upload, written};

/// RPDO n writes 2000h + n, TPDO n sends it, both of one byte. All 1024 identifiers are different: RPDO n has n, TPDO n has
/// 512 + n, but for the first four, which have those of the predefined connection set.
fn device() -> Node<Boxed> {
    let mut rows = vec![rw(0x1000, 0, DataType::Unsigned32)];
    for position in 0..512_u16 {
        let mapped = i64::from(0x2000 + u32::from(position)) << 16 | 8;
        for (base, id) in [(0x1400, position + 1), (0x1800, 513 + position)] {
            let id = match (base, position) {
                (0x1400, 0..4) => 0x204 + 0x100 * position,
                (0x1800, 0..4) => 0x184 + 0x100 * position,
                _ => id,
            };
            rows.push(rw(base + position, 1, DataType::Unsigned32).default(id.into()));
            rows.push(rw(base + position, 2, DataType::Unsigned8).default(255));
            rows.push(rw(base + position + 0x200, 0, DataType::Unsigned8).default(1));
            rows.push(rw(base + position + 0x200, 1, DataType::Unsigned32).default(mapped));
        }
        rows.push(rw(0x2000 + position, 0, DataType::Unsigned8).mappable());
    }
    node(rows)
}

fn number(number: u16) -> PdoNumber {
    PdoNumber::new(number).unwrap()
}

#[test]
fn every_one_of_512_rpdos_writes_its_object_and_every_tpdo_carries_it() {
    let mut node = device();
    answer(&mut node, "000#0104");
    for n in (5..=512_u16).filter(|n| !(0x80..=0x84).contains(n) && *n != 0x100) {
        let frame = format!("{n:03X}#{:02X}", n as u8 | 1);
        node.handle_frame(&frame.parse().unwrap(), Instant::ZERO);
        let events = written(&mut node);
        let raw = u32::from(n as u8 | 1);
        let slot = node.table().find(Mux::new(0x1FFF + n, 0)).unwrap();
        let expected = NodeEvent::Written { slot, raw, via: canopen::node::Via::Rpdo(number(n)) };
        assert_eq!(events, [expected], "{frame}");
        node.notice_changes(Instant::ZERO);
        let sent: Vec<String> = drain(&mut node).iter().map(ToString::to_string).collect();
        assert_eq!(sent, [format!("{:03X}#{:02X}", 512 + n, raw)]);
    }
    assert_eq!(upload(&mut node, Mux::new(0x21FF, 0)).unwrap(), [0x01]);
}

#[test]
fn at_start_all_512_tpdos_are_sent_in_the_order_of_their_identifiers() {
    let mut node = device();
    node.handle_frame(&"000#0104".parse().unwrap(), Instant::ZERO);
    let ids: Vec<u32> = drain(&mut node).iter().map(|frame| frame.id().raw()).collect();
    assert_eq!(ids.len(), 512);
    assert!(ids.is_sorted());
    assert_eq!(node.tpdo_id(number(1)).map(|id| id.raw()), Some(0x184));
    assert_eq!(node.tpdo_id(number(512)).map(|id| id.raw()), Some(0x400));
    assert_eq!(node.rpdo_id(number(512)).map(|id| id.raw()), Some(0x200));
}

#[test]
fn a_pdo_that_the_device_has_no_record_of_does_not_exist() {
    let mut small = node(vec![
        rw(0x1404, 1, DataType::Unsigned32).default(0x333),
        rw(0x1604, 0, DataType::Unsigned8),
        Entry { access: canopen::od::Access::Const, ..rw(0x1000, 0, DataType::Unsigned32) },
    ]);
    assert_eq!(small.rpdo_id(number(5)).map(|id| id.raw()), Some(0x333));
    assert_eq!((small.rpdo_id(number(1)), small.rpdo_id(number(6)), small.tpdo_id(number(1))), (None, None, None));
    assert_eq!(answer(&mut small, "604#4005140100000000"), ["584#8005140100000206"]);
}
