//! SDO servers beside the default one (CiA 301, 7.5.2.33) against frames that are written out.

use std::time::Duration;

use can::{Instant, Station};
use canopen::node::{SdoClient, Via};
use canopen::od::{Condition, Conditions, DataType, Entry};
use canopen::sdo::client::{Failure, Outcome};
use canopen::{AbortCode, Mux, Node, NodeEvent, NodeProfile};

use crate::any_device::device::{Boxed, answer, drain, node, node_of, rw, table, talk, upload, written};

/// The record of a server: requests under 680h + `low`, replies 10h above.
pub(super) fn server(index: u16, low: u32) -> [Entry; 4] {
    [
        rw(index, 0, DataType::Unsigned8).default(3),
        rw(index, 1, DataType::Unsigned32).default(0x680 + i64::from(low)),
        rw(index, 2, DataType::Unsigned32).default(0x690 + i64::from(low)),
        rw(index, 3, DataType::Unsigned8).default(1),
    ]
}

fn rows() -> Vec<Entry> {
    let mut rows = [server(0x1201, 0), server(0x1205, 1)].concat();
    rows.extend([
        rw(0x2000, 0, DataType::Unsigned16).default(7),
        rw(0x2001, 0, DataType::VisibleString).text("a text of letters").capacity(40),
    ]);
    rows
}

fn value(node: &Node<Boxed>, index: u16) -> i64 {
    node.dictionary().view().value(Mux::new(index, 0)).unwrap()
}

fn text(node: &mut Node<Boxed>) -> Vec<u8> {
    upload(node, Mux::new(0x2001, 0)).unwrap()
}

#[test]
fn each_server_answers_its_client_under_its_own_identifiers() {
    let mut node = node(rows());
    talk(
        &mut node,
        &[
            ("604#4000200000000000", "584#4B00200007000000"),
            ("680#4000200000000000", "690#4B00200007000000"),
            ("681#2B00200008000000", "691#6000200000000000"),
            ("680#4000200000000000", "690#4B00200008000000"),
            ("681#4000300000000000", "691#8000300000000206"),
            ("680#A401200007000000", "690#C601200011000000"),
        ],
    );
    assert_eq!(answer(&mut node, "682#4000200000000000"), [""; 0]);
    assert_eq!(answer(&mut node, "690#4000200000000000"), [""; 0]);
}

#[test]
fn downloads_of_three_clients_into_one_text_do_not_mix() {
    let mut node = node(rows());
    let clients = [("604", "584", '1'), ("680", "690", '2'), ("681", "691", '3')];
    let begin =
        |(to, from, _): (&str, &str, char)| (format!("{to}#210120000A000000"), format!("{from}#6001200000000000"));
    let segment = |(to, from, letter): (&str, &str, char), command: u8, bytes: usize| {
        let data = format!("{:02X}", letter as u32).repeat(bytes) + &"00".repeat(7 - bytes);
        (format!("{to}#{command:02X}{data}"), format!("{from}#{:02X}00000000000000", 0x20 | command & 0x10))
    };
    for (request, reply) in clients.map(begin) {
        talk(&mut node, &[(&request, &reply)]);
    }
    for (request, reply) in clients.map(|client| segment(client, 0x00, 7)) {
        talk(&mut node, &[(&request, &reply)]);
    }
    assert_eq!(
        node.dictionary().view().long_bytes(node.table().find(Mux::new(0x2001, 0)).unwrap()),
        b"a text of letters"
    );
    for client in [clients[1], clients[2], clients[0]] {
        let (request, reply) = segment(client, 0x19, 3);
        talk(&mut node, &[(&request, &reply)]);
        let slot = node.table().find(Mux::new(0x2001, 0)).unwrap();
        assert_eq!(node.dictionary().view().long_bytes(slot), String::from(client.2).repeat(10).as_bytes());
    }
}

#[test]
fn an_upload_gives_the_value_of_its_first_frame_whatever_another_client_writes() {
    let mut node = node(rows());
    talk(
        &mut node,
        &[
            ("680#4001200000000000", "690#4101200011000000"),
            ("604#2301200078797A00", "584#6001200000000000"),
            ("681#4001200000000000", "691#4301200078797A00"),
            ("680#6000000000000000", "690#0061207465787420"),
            ("680#7000000000000000", "690#106F66206C657474"),
            ("680#6000000000000000", "690#0965727300000000"),
        ],
    );
    assert_eq!(text(&mut node), b"xyz\0");
}

/// Two uploads of blocks at a time: the more urgent identifier first, and every segment once.
#[test]
fn two_uploads_of_blocks_are_sent_by_their_identifiers() {
    let mut node = node(rows());
    for (to, from) in [("681", "691"), ("680", "690"), ("604", "584")] {
        let (begin, agreed) = (format!("{to}#A001200007000000"), format!("{from}#C201200011000000"));
        talk(&mut node, &[(&begin, &agreed)]);
    }
    for to in ["681", "680", "604"] {
        node.handle_frame(&format!("{to}#A300000000000000").parse().unwrap(), Instant::ZERO);
    }
    let sent: Vec<String> = drain(&mut node).iter().map(|frame| frame.to_string()[..6].to_owned()).collect();
    let expected = ["584#01", "584#02", "584#83", "690#01", "690#02", "690#83", "691#01", "691#02", "691#83"];
    assert_eq!(sent, expected);
}

#[test]
fn an_identifier_moves_only_while_its_cob_id_is_invalid() {
    let mut node = node(rows());
    talk(
        &mut node,
        &[
            // Valid: another identifier, and 29 bits.
            ("604#23011201A2060000", "584#8001120130000906"),
            ("604#2301120180060020", "584#8001120130000906"),
            ("604#2301120180060000", "584#6001120100000000"),
            ("604#2301120180060080", "584#6001120100000000"),
        ],
    );
    assert_eq!(
        answer(&mut node, "680#4000200000000000"),
        [""; 0],
        "a server of which one COB-ID is invalid does not exist"
    );
    talk(
        &mut node,
        &[
            // Restricted: 604h is the default server's.
            ("604#2301120104060000", "584#8001120130000906"),
            ("604#23011201A2060000", "584#6001120100000000"),
            ("6A2#4000200000000000", "690#4B00200007000000"),
            // Bit 30 is a note for the store alone.
            ("604#23011202900600C0", "584#6001120200000000"),
            ("604#23011202A3060040", "584#6001120200000000"),
            ("6A2#4000200000000000", "6A3#4B00200007000000"),
            ("604#2F01120300000000", "584#8001120330000906"),
            ("604#2F0112037F000000", "584#6001120300000000"),
        ],
    );
}

#[test]
fn what_ends_a_server_through_itself_is_confirmed_and_the_last_answer() {
    let mut node = node(rows());
    talk(&mut node, &[("680#2301120190060080", "690#6001120100000000")]);
    assert_eq!(answer(&mut node, "680#4000200000000000"), [""; 0]);
    talk(&mut node, &[("681#4000200000000000", "691#4B00200007000000")]);
}

#[test]
fn another_server_that_changes_leaves_what_is_under_way() {
    let mut node = node(rows());
    talk(
        &mut node,
        &[
            ("681#4001200000000000", "691#4101200011000000"),
            ("604#2301120180060080", "584#6001120100000000"),
            ("681#6000000000000000", "691#0061207465787420"),
            ("604#2305120181060080", "584#6005120100000000"),
            ("604#2305120181060000", "584#6005120100000000"),
            // It has begun anew.
            ("681#7000000000000000", "691#8000000001000405"),
        ],
    );
}

#[test]
fn a_silent_client_is_aborted_on_its_own_server() {
    let mut node = node(rows());
    talk(
        &mut node,
        &[("680#4001200000000000", "690#4101200011000000"), ("604#4001200000000000", "584#4101200011000000")],
    );
    let half = Instant::ZERO.plus_nanos(NodeProfile::SDO_TIMEOUT_NS / 2);
    node.handle_frame(&"604#6000000000000000".parse().unwrap(), half);
    assert_eq!(drain(&mut node).len(), 1);
    let over = Instant::ZERO.plus_nanos(NodeProfile::SDO_TIMEOUT_NS);
    assert_eq!(node.poll_timeout(), Some(over));
    node.handle_timeout(over);
    let sent: Vec<String> = drain(&mut node).iter().map(ToString::to_string).collect();
    assert_eq!(sent, ["690#8001200000000405"]);
}

#[test]
fn no_server_answers_a_stopped_node_and_a_reset_brings_the_defaults_back() {
    let mut node = node(rows());
    talk(&mut node, &[("680#4001200000000000", "690#4101200011000000")]);
    assert_eq!(answer(&mut node, "000#0204"), [""; 0]);
    assert_eq!(answer(&mut node, "680#4000200000000000"), [""; 0]);
    assert_eq!(answer(&mut node, "000#8004"), [""; 0]);
    talk(&mut node, &[("680#6000000000000000", "690#8000000001000405")]);
    talk(&mut node, &[("680#2301120180060080", "690#6001120100000000")]);
    assert_eq!(answer(&mut node, "000#8204"), [""; 0]);
    assert_eq!(answer(&mut node, "680#4000200000000000"), [""; 0], "down");
    node.reset_communication(Instant::ZERO);
    drain(&mut node);
    talk(&mut node, &[("680#4000200000000000", "690#4B00200007000000")]);
}

/// CiA 301, 7.5.2.34: identifiers as those of a server, and the default server of a node may be asked (table 41).
#[test]
fn the_record_of_a_client_follows_the_same_rules() {
    let mut rows = server(0x1280, 4).to_vec();
    rows.push(rw(0x2000, 0, DataType::Unsigned16));
    let mut node = node(rows);
    let (taken, refused) = ("584#6080120100000000", "584#8080120130000906");
    talk(
        &mut node,
        &[
            // Valid: another identifier. Bits 11 and 29. Not valid: NMT, replies for requests, another service; in the end one that is.
            ("604#2380120185060000", refused),
            ("604#23801201840E0000", refused),
            ("604#2380120184060020", refused),
            ("604#2380120105060000", refused),
            ("604#2380120184060080", taken),
            ("604#2380120100000000", refused),
            ("604#2380120185050000", refused),
            ("604#2380120105070000", refused),
            ("604#2380120185060000", taken),
            ("604#2380120185060080", taken),
            ("604#2380120105060000", taken),
            ("604#2380120106060000", refused),
            ("604#2F80120380000000", "584#8080120330000906"),
            ("604#2F8012037F000000", "584#6080120300000000"),
        ],
    );
    for id in ["684", "685", "694", "605", "585"] {
        assert_eq!(answer(&mut node, &format!("{id}#4000200000000000")), [""; 0]);
    }
}

/// Node 4 with a client, which has asked node 5 for a text that comes in three segments, and has its first reply.
fn asking() -> (Node<Boxed>, SdoClient, Vec<u8>) {
    let mut rows = server(0x1280, 0x8000_0000).to_vec();
    rows.extend(server(0x1281, 4));
    let mut node = node(rows);
    let mut client = SdoClient::new(0x1280, Duration::from_millis(50));
    assert_eq!(client.on(&node).err(), Some(AbortCode::RESOURCE_NOT_AVAILABLE));
    talk(
        &mut node,
        &[("604#2380120105060000", "584#6080120100000000"), ("604#2380120285050000", "584#6080120200000000")],
    );
    let mut buffer = vec![0; 40];
    client.on(&node).unwrap().upload(Mux::new(0x2001, 0), Instant::ZERO);
    assert_eq!(sent(&mut client, &node, &buffer), ["605#4001200000000000"]);
    for foreign in ["586#4101200011000000", "605#4101200011000000", "694#4101200011000000"] {
        assert!(!client.hears(&foreign.parse().unwrap()));
    }
    let reply = "585#4101200011000000".parse().unwrap();
    assert!(client.hears(&reply));
    assert_eq!(client.on(&node).unwrap().handle_frame(&reply, &mut buffer, Instant::ZERO), None);
    assert_eq!(sent(&mut client, &node, &buffer), ["605#6000000000000000"]);
    (node, client, buffer)
}

fn sent(client: &mut SdoClient, node: &Node<Boxed>, buffer: &[u8]) -> Vec<String> {
    let client = client.on(node).unwrap();
    std::iter::from_fn(|| client.poll_transmit(buffer).map(|frame| frame.to_string())).collect()
}

#[test]
fn a_client_asks_the_server_that_its_record_names() {
    let (node, mut client, mut buffer) = asking();
    let mut result = None;
    for reply in ["585#0061207465787420", "585#106F66206C657474", "585#0965727300000000"] {
        assert_eq!(result, None);
        result = client.on(&node).unwrap().handle_frame(&reply.parse().unwrap(), &mut buffer, Instant::ZERO);
        sent(&mut client, &node, &buffer);
    }
    let mux = Mux::new(0x2001, 0);
    assert_eq!(result, Some(Ok(Outcome::Uploaded { mux, length: 17 })));
    assert_eq!(&buffer[..17], b"a text of letters");
    assert!(client.poll_timeout().is_none() && !client.hears(&"585#0965727300000000".parse().unwrap()));

    client.on(&node).unwrap().download(mux, b"abcd", Instant::ZERO);
    assert_eq!(sent(&mut client, &node, b"abcd"), ["605#2301200061626364"]);
    let silent = Instant::ZERO.plus_nanos(50_000_000);
    assert_eq!(client.poll_timeout(), Some(silent));
    assert_eq!(client.on(&node).unwrap().handle_timeout(silent), Some(Failure::TimedOut { mux }));
    assert_eq!(sent(&mut client, &node, b"abcd"), ["605#8001200000000405"]);
}

#[test]
fn a_client_whose_channel_changes_under_a_transfer_says_so_once() {
    let changes = [
        &["604#2380120105060080"][..],
        &["604#2380120105060080", "604#2380120184060000"],
        &["000#0204"],
        &["604#2380120285050080", "604#2380120286050000"],
    ];
    for (change, is_there_after) in changes.into_iter().zip([false, true, false, true]) {
        let (mut node, mut client, _) = asking();
        change.iter().for_each(|frame| drop(answer(&mut node, frame)));
        assert_eq!(client.on(&node).err(), Some(AbortCode::RESOURCE_NOT_AVAILABLE), "{change:?}");
        assert_eq!(client.on(&node).is_ok(), is_there_after, "{change:?}");
        assert!(client.on(&node).map_or(true, |client| !client.is_busy()));
    }
    // Another record does not concern it, nor does 1280h:03.
    let (mut node, mut client, _) = asking();
    for frame in ["604#2381120184060080", "604#2F8012037F000000"] {
        assert_eq!(answer(&mut node, frame).len(), 1);
    }
    assert!(client.on(&node).unwrap().is_busy());
}

#[test]
fn the_owner_may_be_asked_by_several_clients_at_a_time() {
    let table = table(rows());
    let slots = [0x2000, 0x2001].map(|index| table.find(Mux::new(index, 0)).unwrap());
    let mut numbers = vec![0; table.rows().len()];
    slots.iter().zip(1..).for_each(|(slot, number)| numbers[slot.position()] = number);
    let asked = slots.map(|slot| (slot, Condition::Ask)).to_vec();
    let conditions = Box::leak(Box::new(Conditions::new(asked.leak(), numbers.leak())));
    let mut node = node_of(NodeProfile { conditions, ..NodeProfile::cia_301(table) });
    let mut ask = |frame: &str| {
        node.handle_frame(&frame.parse().unwrap(), Instant::ZERO);
        let Some(NodeEvent::Asked { ticket, .. }) = node.poll_event() else { panic!("not asked") };
        assert_eq!(node.poll_transmit(), None);
        ticket
    };
    let (first, second) = (ask("680#2301200061626364"), ask("604#2301200065666768"));
    let third = ask("681#2B00200009000000");
    assert_eq!((node.asked_bytes(first), node.asked_bytes(second)), (&b"abcd"[..], &b"efgh"[..]));
    assert!(node.answer(third, Ok(()), Instant::ZERO));
    assert_eq!(written(&mut node), [NodeEvent::Written { slot: slots[0], raw: 9, via: Via::Sdo }]);
    assert_eq!(node.poll_transmit().unwrap().to_string(), "691#6000200000000000");
    assert!(node.answer(second, Err(AbortCode::INVALID_VALUE), Instant::ZERO));
    assert_eq!(node.poll_transmit().unwrap().to_string(), "584#8001200030000906");
    assert!(node.answer(first, Ok(()), Instant::ZERO) && !node.answer(first, Ok(()), Instant::ZERO));
    assert_eq!(node.poll_transmit().unwrap().to_string(), "690#6001200000000000");
    assert_eq!((value(&node, 0x2000), node.asked_bytes(first)), (9, &b""[..]));
    assert_eq!(node.dictionary().view().long_bytes(slots[1]), b"abcd");
}

/// The RPDO of the same identifier is first; another one of CiA's 127 servers is at the end of the records.
#[test]
fn as_many_servers_as_the_table_has_records_for() {
    let mut rows: Vec<Entry> = (0x1201..=0x127F).flat_map(|index| server(index, 0x8000_0000)).collect();
    rows.push(rw(0x2000, 0, DataType::Unsigned16).default(7));
    rows.push(rw(0x2001, 0, DataType::Domain).bytes(b"0123456789").capacity(10));
    let mut node = node(rows);
    for (number, index) in (0..12_u16).zip((0x1201..=0x127F_u16).rev()) {
        let [low, high] = index.to_le_bytes();
        let (request, reply) = (0xA0 + number, 0xB0 + number);
        for (sub_index, id) in [(1, request), (2, reply)] {
            let write = format!("604#23{low:02X}{high:02X}{sub_index:02X}{id:02X}060000");
            talk(&mut node, &[(&write, &format!("584#60{low:02X}{high:02X}{sub_index:02X}00000000"))]);
        }
        talk(&mut node, &[(&format!("6{request:02X}#4001200000000000"), &format!("6{reply:02X}#410120000A000000"))]);
    }
    for number in 0..12 {
        let (request, reply) = (0xA0 + number, 0xB0 + number);
        talk(&mut node, &[(&format!("6{request:02X}#6000000000000000"), &format!("6{reply:02X}#0030313233343536"))]);
    }
}

/// CiA 301, table 41: an EDS that delivers such a record would have the requests of node 5, or NMT, taken for its own.
#[test]
fn a_delivered_record_with_restricted_identifiers_is_not_served() {
    for (request, reply) in [(0x605, 0x690), (0x680, 0x585), (0x000, 0x690)] {
        let mut node = node(vec![
            rw(0x1201, 1, DataType::Unsigned32).default(request),
            rw(0x1201, 2, DataType::Unsigned32).default(reply),
            rw(0x2000, 0, DataType::Unsigned16).default(7),
        ]);
        assert_eq!(answer(&mut node, &format!("{request:03X}#4000200000000000")), [""; 0]);
        assert_eq!(answer(&mut node, "604#4000200000000000"), ["584#4B00200007000000"]);
    }
}
