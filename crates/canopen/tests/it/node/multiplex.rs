//! Multiplexed PDOs at a node (CiA 301, 7.2.3).

use can::{Instant, Station};
use canopen::node::Via;
use canopen::od::{Access, DataType, DefaultValue, Entry};
use canopen::pdo::{MappingRules, PdoNumber};
use canopen::{Mux, Node, NodeEvent, NodeId, NodeProfile};

use crate::any_device::device::{Boxed, answer, drain, node_of, rw, table, written};

/// Node 4: RPDO1 and TPDO1 as these counts say, objects of several types, one that cannot be mapped, and these lists.
fn rows(rpdo: i64, tpdo: i64, scanning: &[u32], dispatching: &[u64]) -> Vec<Entry> {
    let mut rows = vec![
        rw(0x1400, 1, DataType::Unsigned32).default(0x204),
        rw(0x1400, 2, DataType::Unsigned8).default(255),
        rw(0x1600, 0, DataType::Unsigned8).default(rpdo),
        rw(0x1600, 1, DataType::Unsigned32),
        rw(0x1800, 1, DataType::Unsigned32).default(0x184),
        rw(0x1800, 2, DataType::Unsigned8).default(255),
        rw(0x1800, 3, DataType::Unsigned16),
        rw(0x1A00, 0, DataType::Unsigned8).default(tpdo),
        rw(0x1A00, 1, DataType::Unsigned32),
        rw(0x2000, 0, DataType::Unsigned16).mappable(),
        rw(0x2001, 1, DataType::Unsigned32).mappable(),
        rw(0x2001, 2, DataType::Unsigned8).range(0, 9).mappable(),
        rw(0x2002, 0, DataType::Unsigned8),
        rw(0x2003, 0, DataType::Unsigned64).mappable(),
        Entry::new(0x2004, 0, DataType::Integer16, Access::ReadOnly, "row", "").mappable(),
    ];
    rows.extend((1..).zip(scanning).map(|(n, entry)| rw(0x1FA0, n, DataType::Unsigned32).default((*entry).into())));
    rows.extend((1..).zip(dispatching).map(|(n, entry)| {
        let mut row = rw(0x1FD0, n, DataType::Unsigned64);
        row.default = DefaultValue::Unsigned(*entry);
        row
    }));
    rows
}

fn operational(rows: Vec<Entry>) -> Node<Boxed> {
    let mut node = node_of(NodeProfile::cia_301(table(rows)));
    node.handle_frame(&"000#0104".parse().unwrap(), Instant::ZERO);
    drain(&mut node);
    node
}

fn value(node: &Node<Boxed>, index: u16, sub_index: u8) -> u32 {
    node.dictionary().raw(node.table().find(Mux::new(index, sub_index)).unwrap())
}

/// The events of a frame to RPDO1.
fn events(node: &mut Node<Boxed>, data: &str) -> Vec<NodeEvent> {
    node.handle_frame(&format!("204#{data}").parse().unwrap(), Instant::ZERO);
    written(node)
}

#[test]
fn in_destination_address_mode_the_frame_names_the_object_of_this_node_or_of_all() {
    let mut node = operational(rows(0xFF, 0, &[], &[]));
    let via = Via::Rpdo(PdoNumber::FIRST);
    let slot = node.table().find(Mux::new(0x2000, 0)).unwrap();
    assert_eq!(events(&mut node, "8400200034127856"), [NodeEvent::Written { slot, raw: 0x1234, via }]);
    assert_eq!(events(&mut node, "8001200178563412").len(), 1, "of all");
    assert_eq!((value(&node, 0x2000, 0), value(&node, 0x2001, 1)), (0x1234, 0x1234_5678));
    for another in ["8501200100000000", "FF01200100000000", "0401200100000000"] {
        assert_eq!(events(&mut node, another), [], "{another} is for another node, or of the other mode");
    }
    assert_eq!(value(&node, 0x2001, 1), 0x1234_5678);
}

#[test]
fn a_destination_that_is_not_there_or_takes_no_such_value_is_reported_and_nothing_is_stored() {
    let mut node = operational(rows(0xFF, 0, &[], &[]));
    // Missing object, missing sub-index, not mappable, read-only, longer than four bytes, beyond its limits, communication object.
    for data in ["00300000", "01200900", "02200000", "04200000", "03200000", "0120020A", "00140102"] {
        let event = events(&mut node, &format!("84{data}000000"));
        assert_eq!(event, [NodeEvent::DestinationMissing(PdoNumber::FIRST)], "{data}");
    }
    assert_eq!((value(&node, 0x2001, 2), value(&node, 0x1400, 1)), (0, 0x204));
    // Fewer than eight bytes.
    assert_eq!(events(&mut node, "84002000341278"), [NodeEvent::RpdoTooShort(PdoNumber::FIRST)]);
    assert_eq!(value(&node, 0x2000, 0), 0);
}

#[test]
fn in_source_address_mode_the_dispatching_list_leads_to_the_object() {
    // Node 7, 6000h:03 and :04 to 2001h:01 and :02; node 8, 6000h:01 to 2000h.
    let entry = |count: u64, here: u64, sub_index: u64, first: u64, node: u64| {
        count << 56 | here << 40 | sub_index << 32 | 0x6000 << 16 | first << 8 | node
    };
    let list = [entry(2, 0x2001, 1, 3, 7), entry(0, 0x2000, 0, 1, 8), entry(1, 0x2001, 1, 1, 10)];
    let mut node = operational(rows(0xFE, 0, &[], &list));
    assert_eq!(events(&mut node, "0700600344332211").len(), 1);
    assert_eq!(events(&mut node, "0700600405000000").len(), 1);
    assert_eq!(events(&mut node, "08006001CDAB0000").len(), 1);
    assert_eq!((value(&node, 0x2001, 1), value(&node, 0x2001, 2), value(&node, 0x2000, 0)), (0x1122_3344, 5, 0xABCD));
    // Below and above the block, another index, another node, the other mode; and a value that is refused is not reported.
    // Of node 10 one sub-index is listed: the next one is not, though there is an object where it would lead.
    for other in ["07006002", "07006005", "07016003", "09006003", "87006003", "00006003", "0A006002"] {
        assert_eq!(events(&mut node, &format!("{other}01000000")), [], "{other}");
    }
    assert_eq!(events(&mut node, "070060040A000000"), []);
    assert_eq!((value(&node, 0x2001, 1), value(&node, 0x2001, 2)), (0x1122_3344, 5));
}

#[test]
fn a_multiplexed_rpdo_is_not_applied_before_operational() {
    let mut node = operational(rows(0xFF, 0, &[], &[]));
    for (command, is_taken) in [("000#8004", false), ("000#0204", false), ("000#0104", true)] {
        answer(&mut node, command);
        assert_eq!(!events(&mut node, "8400200034120000").is_empty(), is_taken, "{command}");
    }
}

#[test]
fn the_owner_sends_by_source_and_to_destinations() {
    let mut node = operational(rows(0, 0xFE, &[0x0120_0400], &[]));
    let slot = node.table().find(Mux::new(0x2004, 0)).unwrap();
    node.dictionary_mut().set_raw(slot, 0xFFFE);
    assert!(node.send_by_source(slot, Instant::ZERO) && !node.send_by_source(slot, Instant::ZERO), "one waits");
    assert_eq!(drain(&mut node), ["184#04042000FEFF0000".parse().unwrap()]);
    let to = |node: &mut Node<Boxed>, id| {
        node.send_to_destination(PdoNumber::FIRST, id, Mux::new(0x6040, 0), [6, 0, 0, 0], Instant::ZERO)
    };
    assert!(!to(&mut node, None), "it is of the other mode");
    answer(&mut node, "000#8004");
    assert!(!node.send_by_source(slot, Instant::ZERO), "not before operational");
    assert_eq!(drain(&mut node), []);

    let mut node = operational(rows(0, 0xFF, &[], &[]));
    let slot = node.table().find(Mux::new(0x2004, 0)).unwrap();
    assert!(to(&mut node, NodeId::new(7)));
    assert_eq!(drain(&mut node), ["184#8740600006000000".parse().unwrap()]);
    assert!(to(&mut node, None) && !node.send_by_source(slot, Instant::ZERO));
    assert_eq!(drain(&mut node), ["184#8040600006000000".parse().unwrap()]);
}

/// CiA 301, 7.2.3: events alone send it. What it is while it does not exist is its host's affair.
#[test]
fn a_valid_multiplexed_tpdo_is_of_type_254_or_255() {
    let mut node = node_of(NodeProfile::cia_301(table(rows(0xFF, 0xFF, &[], &[]))));
    let mut refused = |request: &str| answer(&mut node, &format!("604#{request}"))[0].starts_with("584#80");
    for (kind, is_refused) in [(0, true), (1, true), (240, true), (252, true), (253, true), (254, false), (255, false)]
    {
        assert_eq!(refused(&format!("2F001802{kind:02X}000000")), is_refused, "{kind}");
        // An RPDO takes effect at once, whatever its type is.
        assert_eq!(refused(&format!("2F001402{kind:02X}000000")), matches!(kind, 252 | 253), "{kind}");
    }
    assert!(!refused("2300180184010080"), "it does not exist any more");
    assert!(!refused("2F00180201000000") && refused("2300180184010000"), "type 1 does not begin to exist");
    assert!(!refused("2F001802FE000000") && !refused("2300180184010000"));
}

#[test]
fn feh_needs_its_list_and_a_device_may_have_no_multiplexed_pdos() {
    let refused = |node: &mut Node<Boxed>, index: u16, count: u8| {
        let [low, high] = index.to_le_bytes();
        let cob_id = if index < 0x1800 { "230014010402008" } else { "230018018401008" };
        assert_eq!(answer(node, &format!("604#{cob_id}0")).len(), 1);
        let answers = answer(node, &format!("604#2F{low:02X}{high:02X}00{count:02X}000000"));
        // 0604 0042h.
        answers == [format!("584#80{low:02X}{high:02X}0042000406")]
    };
    let of = |rules, rows| node_of(NodeProfile { mapping: rules, ..NodeProfile::cia_301(table(rows)) });
    let without_lists = || rows(0, 0, &[], &[]);
    let mut node = of(MappingRules::CIA_301, without_lists());
    let all = [(0x1600, 0xFE), (0x1600, 0xFF), (0x1A00, 0xFE), (0x1A00, 0xFF)];
    assert_eq!(all.map(|(index, count)| refused(&mut node, index, count)), [true, false, true, false]);
    let mut node = of(MappingRules::CIA_301, rows(0, 0, &[1], &[1]));
    assert_eq!(all.map(|(index, count)| refused(&mut node, index, count)), [false; 4]);
    let rules = MappingRules { multiplexed: false, ..MappingRules::CIA_301 };
    let mut node = of(rules, rows(0, 0, &[1], &[1]));
    assert_eq!(all.map(|(index, count)| refused(&mut node, index, count)), [true; 4]);
}
