//! The application has its word before a download commits.

use std::time::Duration;

use can::{Instant, Station};
use canopen::node::{Ticket, Via};
use canopen::od::{Condition, Conditions, DataType, Slot};
use canopen::pdo::PdoNumber;
use canopen::{AbortCode, Mux, Node, NodeEvent, NodeProfile};

use crate::any_device::device::{Boxed, answer, drain, node_of, rw, table, talk, written};

/// 2000h, UNSIGNED16 up to 1000, and 2001h, a text, are asked about; RPDO 1 maps 2000h.
fn device() -> Node<Boxed> {
    under(Condition::Ask)
}

/// The same device with another condition on both.
fn under(condition: Condition) -> Node<Boxed> {
    let table = table(vec![
        rw(0x1400, 1, DataType::Unsigned32).default(0x204),
        rw(0x1400, 2, DataType::Unsigned8).default(255),
        rw(0x1600, 0, DataType::Unsigned8).default(1),
        rw(0x1600, 1, DataType::Unsigned32).default(0x2000_0010),
        rw(0x2000, 0, DataType::Unsigned16).default(7).range(0, 1000).mappable(),
        rw(0x2001, 0, DataType::VisibleString).text("old").capacity(20),
        rw(0x2002, 0, DataType::Unsigned8),
    ]);
    let asked: Vec<(Slot, Condition)> =
        [0x2000, 0x2001].map(|index| (table.find(Mux::new(index, 0)).unwrap(), condition)).into();
    let mut numbers = vec![0; table.rows().len()];
    asked.iter().zip(1..).for_each(|((slot, _), number)| numbers[slot.position()] = number);
    let conditions = Box::leak(Box::new(Conditions::new(asked.leak(), numbers.leak())));
    node_of(NodeProfile { conditions, ..NodeProfile::cia_301(table) })
}

fn value(node: &Node<Boxed>) -> i64 {
    node.dictionary().view().value(Mux::new(0x2000, 0)).unwrap()
}

/// Asks for 2000h = 500, which gets no answer yet.
fn asked(node: &mut Node<Boxed>) -> (Slot, Ticket) {
    node.handle_frame(&"604#2B002000F4010000".parse().unwrap(), Instant::ZERO);
    let Some(NodeEvent::Asked { slot, raw: 500, ticket }) = node.poll_event() else { panic!("not asked") };
    assert_eq!((node.poll_event(), node.poll_transmit()), (None, None));
    assert_eq!(value(node), 7);
    (slot, ticket)
}

fn sent(node: &mut Node<Boxed>) -> Vec<String> {
    drain(node).iter().map(ToString::to_string).collect()
}

#[test]
fn what_the_owner_accepts_is_stored_reported_and_confirmed() {
    let mut node = device();
    let (slot, ticket) = asked(&mut node);
    assert!(node.answer(ticket, Ok(()), Instant::from_millis(30)));
    assert_eq!(written(&mut node), [NodeEvent::Written { slot, raw: 500, via: Via::Sdo }]);
    assert_eq!((sent(&mut node), value(&node)), (vec!["584#6000200000000000".into()], 500));
    assert!(!node.answer(ticket, Ok(()), Instant::from_millis(31)), "answered once");
}

#[test]
fn what_the_owner_refuses_gets_its_abort_code_and_changes_nothing() {
    let mut node = device();
    let (_, ticket) = asked(&mut node);
    assert!(node.answer(ticket, Err(AbortCode::LOCAL_CONTROL), Instant::ZERO));
    assert_eq!(written(&mut node), []);
    assert_eq!((sent(&mut node), value(&node)), (vec!["584#8000200021000008".into()], 7));
}

#[test]
fn what_the_row_refuses_is_not_asked_about() {
    let mut node = device();
    talk(
        &mut node,
        &[("604#2B002000E9030000", "584#8000200031000906"), ("604#2F00200001000000", "584#8000200013000706")],
    );
}

#[test]
fn a_new_request_and_the_client_s_abort_end_the_question() {
    for (frame, expected) in [
        ("604#4000200000000000", Some("584#4B00200007000000")),
        ("604#2F02200001000000", Some("584#6002200000000000")),
        ("604#8000200000000405", None),
    ] {
        let mut node = device();
        let (_, ticket) = asked(&mut node);
        assert_eq!(answer(&mut node, frame), expected.into_iter().collect::<Vec<_>>(), "{frame}");
        assert!(!node.answer(ticket, Ok(()), Instant::ZERO), "{frame}");
        assert_eq!((sent(&mut node), value(&node)), (vec![], 7), "{frame}");
    }
}

#[test]
fn an_answer_to_an_older_question_is_not_taken_for_the_new_one_s() {
    let mut node = device();
    let (_, first) = asked(&mut node);
    let (_, second) = asked(&mut node);
    assert_ne!(first, second);
    assert!(!node.answer(first, Ok(()), Instant::ZERO));
    assert_eq!(value(&node), 7);
    assert!(node.answer(second, Ok(()), Instant::ZERO));
    assert_eq!(value(&node), 500);
}

#[test]
fn an_owner_that_stays_silent_lets_the_sdo_time_out() {
    let mut node = device();
    let (_, ticket) = asked(&mut node);
    let deadline = Instant::ZERO + Duration::from_nanos(NodeProfile::SDO_TIMEOUT_NS);
    assert_eq!(node.poll_timeout(), Some(deadline));
    node.handle_timeout(deadline);
    assert_eq!(sent(&mut node), ["584#8000200000000405"]);
    assert!(!node.answer(ticket, Ok(()), deadline));
}

#[test]
fn a_reset_ends_the_question_without_an_answer() {
    let mut node = device();
    let (_, ticket) = asked(&mut node);
    node.handle_frame(&"000#8204".parse().unwrap(), Instant::ZERO);
    assert_eq!(written(&mut node), [NodeEvent::ResetCommunication]);
    node.reset_communication(Instant::ZERO);
    assert!(!node.answer(ticket, Ok(()), Instant::ZERO));
    assert_eq!(sent(&mut node), ["704#00"]);
}

#[test]
fn rpdos_do_not_ask() {
    let mut node = device();
    answer(&mut node, "000#0104");
    node.handle_frame(&"204#6400".parse().unwrap(), Instant::ZERO);
    let slot = node.table().find(Mux::new(0x2000, 0)).unwrap();
    let via = Via::Rpdo(PdoNumber::FIRST);
    assert_eq!(written(&mut node), [NodeEvent::Written { slot, raw: 100, via }]);
    assert_eq!(value(&node), 100);
}

#[test]
fn what_is_there_is_taken_and_another_value_has_to_pass_the_check() {
    let mut node = under(Condition::Change(|_, _| Err(AbortCode::READ_ONLY)));
    talk(
        &mut node,
        &[
            ("604#2B00200007000000", "584#6000200000000000"),
            ("604#2B00200008000000", "584#8000200002000106"),
            // Beyond the row's range, which comes first.
            ("604#2B002000E9030000", "584#8000200031000906"),
            // "old", and "new", which is as long.
            ("604#2101200003000000", "584#6001200000000000"),
            ("604#096F6C6400000000", "584#2000000000000000"),
            ("604#2101200003000000", "584#6001200000000000"),
            ("604#096E657700000000", "584#8001200002000106"),
        ],
    );
    let text = node.table().find(Mux::new(0x2001, 0)).unwrap();
    assert_eq!(node.dictionary().view().long_bytes(text), b"old");
    answer(&mut node, "000#0104");
    written(&mut node);
    for (frame, events) in [("204#6400", 0), ("204#0700", 1)] {
        node.handle_frame(&frame.parse().unwrap(), Instant::ZERO);
        assert_eq!((written(&mut node).len(), value(&node)), (events, 7), "{frame}");
    }
}

#[test]
fn the_owner_sees_a_long_value_before_it_is_stored() {
    let mut node = device();
    talk(
        &mut node,
        &[("604#2101200008000000", "584#6001200000000000"), ("604#006E657720746578", "584#2000000000000000")],
    );
    node.handle_frame(&"604#1D74000000000000".parse().unwrap(), Instant::ZERO);
    let Some(NodeEvent::Asked { slot, raw: 8, ticket }) = node.poll_event() else { panic!("not asked") };
    assert_eq!(node.asked_bytes(ticket), b"new text");
    assert_eq!(node.dictionary().view().long_bytes(slot), b"old");
    assert!(node.answer(ticket, Ok(()), Instant::ZERO));
    assert_eq!(sent(&mut node), ["584#3000000000000000"]);
    assert_eq!(node.dictionary().view().long_bytes(slot), b"new text");
    assert_eq!(node.asked_bytes(ticket), b"");
}
