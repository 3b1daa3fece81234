//! SYNC at a node (CiA 301, 7.2.5): counter and start value, production, the synchronous window.

use can::{Instant, Station};
use canopen::od::{Access, DataType, Entry};
use canopen::{Node, NodeEvent};

use crate::any_device::device::{Boxed, answer, drain, node, rw, written};

fn at_us(us: u64) -> Instant {
    Instant::from_micros(us)
}

/// Node 4 with 1005h to 1007h and 1019h, RPDO1 of type 0 into 2000h, TPDO1 and TPDO2 with 2001h and these types and start values.
fn device(tpdos: [(i64, i64); 2]) -> Node<Boxed> {
    let mut rows = vec![
        rw(0x1005, 0, DataType::Unsigned32).default(0x80),
        rw(0x1006, 0, DataType::Unsigned32),
        rw(0x1007, 0, DataType::Unsigned32),
        rw(0x1019, 0, DataType::Unsigned8),
        rw(0x1400, 1, DataType::Unsigned32).default(0x204),
        rw(0x1400, 2, DataType::Unsigned8).default(0),
        rw(0x1600, 0, DataType::Unsigned8).default(1),
        rw(0x1600, 1, DataType::Unsigned32).default(0x2000_0008),
        rw(0x2000, 0, DataType::Unsigned8).mappable(),
        Entry::new(0x2001, 0, DataType::Unsigned8, Access::ReadOnly, "input", "").mappable(),
    ];
    for (n, (transmission_type, start_value)) in (0..).zip(tpdos) {
        rows.extend([
            rw(0x1800 + n, 1, DataType::Unsigned32).default(0x184 + 0x100 * i64::from(n)),
            rw(0x1800 + n, 2, DataType::Unsigned8).default(transmission_type),
            rw(0x1800 + n, 6, DataType::Unsigned8).default(start_value),
            rw(0x1A00 + n, 0, DataType::Unsigned8).default(1),
            rw(0x1A00 + n, 1, DataType::Unsigned32).default(0x2001_0008),
        ]);
    }
    node(rows)
}

/// The answers to SYNCs with these counters.
fn at_counters(node: &mut Node<Boxed>, counters: impl IntoIterator<Item = u8>) -> Vec<(u8, Vec<String>)> {
    let sent = counters.into_iter().map(|counter| (counter, answer(node, &format!("080#{counter:02X}"))));
    sent.filter(|(_, sent)| !sent.is_empty()).collect()
}

/// What it sends until then, with the time of each in us, and its events are forgotten.
fn run(node: &mut Node<Boxed>, from_us: u64, until_us: u64) -> Vec<String> {
    let mut sent = Vec::new();
    let mut now = at_us(from_us);
    loop {
        node.handle_timeout(now);
        while node.poll_event().is_some() {}
        while let Some(frame) = node.poll_transmit() {
            node.handle_transmitted(&frame, now);
            sent.push(format!("{} {frame}", now.as_nanos() / 1000));
        }
        match node.poll_timeout().filter(|due| *due <= at_us(until_us)) {
            Some(due) => now = due.max(now),
            None => return sent,
        }
    }
}

fn write(node: &mut Node<Boxed>, request: &str) -> String {
    let answers = answer(node, &format!("604#{request}"));
    assert_eq!(answers.len(), 1, "{request}: {answers:?}");
    answers[0].clone()
}

#[test]
fn the_sync_with_the_start_value_counts_as_the_first_one() {
    // TPDO1: each second SYNC, counted from counter 3 on; TPDO2: every SYNC from 2 on.
    let mut node = device([(2, 3), (1, 2)]);
    answer(&mut node, "000#0104");
    let sent = at_counters(&mut node, [4, 1, 2, 3, 4, 1, 2, 3, 4]);
    let of = |id: &str| -> Vec<u8> {
        let with_id = sent.iter().filter(|(_, frames)| frames.iter().any(|frame| frame.starts_with(id)));
        with_id.map(|(counter, _)| *counter).collect()
    };
    assert_eq!(of("184"), [4, 2, 4]);
    assert_eq!(of("284"), [2, 3, 4, 1, 2, 3, 4]);
    // Each start of the node waits anew.
    answer(&mut node, "000#8004");
    answer(&mut node, "000#0104");
    assert!(at_counters(&mut node, [4, 1]).is_empty());
}

#[test]
fn tpdos_of_one_type_are_spread_by_their_start_values() {
    let mut node = device([(4, 1), (4, 3)]);
    answer(&mut node, "000#0104");
    let sent = at_counters(&mut node, (1..=4).cycle().take(12));
    let frames: Vec<_> = sent.iter().flat_map(|(counter, frames)| frames.iter().map(|f| (*counter, &f[..3]))).collect();
    assert_eq!(frames, [(4, "184"), (2, "284"), (4, "184"), (2, "284"), (4, "184")]);
}

#[test]
fn a_sync_without_counter_makes_the_start_value_void() {
    let mut node = device([(1, 200), (0, 0)]);
    answer(&mut node, "000#0104");
    assert_eq!(answer(&mut node, "080#"), ["184#00", "284#00"]);
}

#[test]
fn a_start_value_is_0_to_240_and_stays_while_the_tpdo_is_valid() {
    let mut node = device([(1, 0), (1, 0)]);
    // 0601 0000h while it is valid, 0609 0030h for 241.
    assert_eq!(write(&mut node, "2F00180605000000"), "584#8000180600000106");
    assert_eq!(write(&mut node, "2300180184010080"), "584#6000180100000000");
    assert_eq!(write(&mut node, "2F001806F1000000"), "584#8000180630000906");
    assert_eq!(write(&mut node, "2F001806F0000000"), "584#6000180600000000");
}

#[test]
fn a_producer_sends_each_period_with_its_counter_and_begins_its_own_cycles() {
    let mut node = device([(2, 0), (255, 0)]);
    assert_eq!(write(&mut node, "2F19100003000000"), "584#6019100000000000");
    assert_eq!(write(&mut node, "23061000E8030000"), "584#6006100000000000");
    assert_eq!(write(&mut node, "2F19100004000000"), "584#8019100022000008", "while 1006h is not 0");
    assert_eq!(run(&mut node, 0, 5_000), [""; 0], "bit 30 of 1005h is not set");
    node.handle_frame(&"604#2305100080000040".parse().unwrap(), at_us(5_000));
    let expected = ["5000 584#6005100000000000", "6000 080#01", "7000 080#02", "8000 080#03", "9000 080#01"];
    assert_eq!(run(&mut node, 5_000, 9_500), expected);
    node.handle_frame(&"000#0104".parse().unwrap(), at_us(9_500));
    let expected =
        ["9500 284#00", "10000 080#02", "11000 080#03", "11000 184#00", "12000 080#01", "13000 080#02", "13000 184#00"];
    assert_eq!(run(&mut node, 9_500, 13_000), expected);
}

#[test]
fn a_producer_rests_while_it_is_stopped_and_its_counter_begins_at_1_again() {
    let mut node = device([(255, 0), (255, 0)]);
    for request in ["2F19100004000000", "23061000E8030000", "2305100080000040"] {
        write(&mut node, request);
    }
    assert_eq!(run(&mut node, 0, 2_000), ["1000 080#01", "2000 080#02"]);
    node.handle_frame(&"000#0204".parse().unwrap(), at_us(2_500));
    assert_eq!(run(&mut node, 2_500, 9_500), [""; 0]);
    node.handle_frame(&"000#8004".parse().unwrap(), at_us(9_500));
    assert_eq!(run(&mut node, 9_500, 11_000), ["10500 080#01"]);
    node.handle_frame(&"604#2306100000000000".parse().unwrap(), at_us(11_000));
    assert_eq!(run(&mut node, 11_000, 50_000), ["11000 584#6006100000000000"], "a period of 0 is off");
}

#[test]
fn the_identifier_stays_while_sync_is_produced() {
    let mut node = device([(1, 0), (1, 0)]);
    assert_eq!(write(&mut node, "2305100080000040"), "584#6005100000000000");
    for value in ["81000040", "81000000"] {
        assert_eq!(write(&mut node, &format!("23051000{value}")), "584#8005100030000906", "{value}");
    }
    assert_eq!(write(&mut node, "2305100080000000"), "584#6005100000000000");
    assert_eq!(write(&mut node, "2305100081000000"), "584#6005100000000000");
    assert_eq!(write(&mut node, "2305100081000040"), "584#6005100000000000");
}

/// CiA 301, 7.5.2.7.
#[test]
fn a_synchronous_tpdo_that_the_window_ends_before_is_not_sent() {
    let mut node = device([(1, 0), (1, 0)]);
    write(&mut node, "23071000F4010000");
    answer(&mut node, "000#0104");
    node.handle_frame(&"080#".parse().unwrap(), at_us(1_000));
    // The wire takes the first frame within the window, and has no room for the second.
    assert_eq!(node.poll_transmit().map(|frame| frame.to_string()).as_deref(), Some("184#00"));
    assert_eq!(node.poll_timeout(), Some(at_us(1_500)));
    node.handle_timeout(at_us(1_499));
    let mut in_time = node.clone();
    assert!(in_time.poll_transmit().is_some());
    node.handle_timeout(at_us(1_500));
    assert_eq!(node.poll_transmit(), None);
    node.handle_frame(&"080#".parse().unwrap(), at_us(2_000));
    assert_eq!(drain(&mut node).len(), 2, "the next SYNC opens a new window");
}

#[test]
fn a_synchronous_rpdo_after_the_window_is_discarded_until_the_next_sync() {
    let mut node = device([(255, 0), (255, 0)]);
    write(&mut node, "23071000F4010000");
    answer(&mut node, "000#0104");
    let value = |node: &Node<Boxed>| node.dictionary().raw(node.table().find(canopen::Mux::new(0x2000, 0)).unwrap());
    let frame = |node: &mut Node<Boxed>, text: &str, us| {
        node.handle_timeout(at_us(us));
        node.handle_frame(&text.parse().unwrap(), at_us(us));
        written(node).into_iter().filter(|event| matches!(event, NodeEvent::Written { .. })).count()
    };
    frame(&mut node, "080#", 1_000);
    frame(&mut node, "204#11", 1_499);
    assert_eq!((frame(&mut node, "080#", 2_000), value(&node)), (1, 0x11));
    frame(&mut node, "204#22", 2_500);
    assert_eq!((frame(&mut node, "080#", 3_000), value(&node)), (0, 0x11));
    frame(&mut node, "204#33", 3_001);
    assert_eq!((frame(&mut node, "080#", 4_000), value(&node)), (1, 0x33));
    // What came within the window stays; what comes after it does not replace it.
    frame(&mut node, "204#44", 4_100);
    frame(&mut node, "204#55", 4_600);
    assert_eq!((frame(&mut node, "080#", 5_000), value(&node)), (1, 0x44));
}
