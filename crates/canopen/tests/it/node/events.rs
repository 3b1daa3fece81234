//! What waits for the owner: nothing is lost of what one frame makes, and what is lost is reported.
//!
//! The device of these tests has all that CiA 301 allows: four RPDOs of eight objects.

use canopen::node::{NodeEvent, Via};
use canopen::od::{Access, DataType, Entry, Index, Table};
use canopen::pdo::PdoNumber;
use canopen::{NmtState, NodeProfile};

use crate::node::bench::Bench;

const RPDOS: usize = 4;
const OBJECTS: usize = 8;
const COUNT: usize = 1 + RPDOS * (2 + 1 + OBJECTS) + RPDOS * OBJECTS;
/// The objects of RPDO n are 2000h + n, sub-indexes 01h to 08h.
const FIRST_OBJECT: u16 = 0x2000;

static ROWS: [Entry; COUNT] = {
    use Access::ReadWrite;
    use DataType::{Unsigned8, Unsigned32};
    let sync = Entry::new(0x1005, 0, Unsigned32, ReadWrite, "cob_id_sync", "").default(0x80);
    let mut rows = [sync; COUNT];
    let (mut at, mut n) = (1, 0);
    while n < RPDOS as u16 {
        // All of them listen to 204h.
        rows[at] = Entry::new(0x1400 + n, 1, Unsigned32, ReadWrite, "cob_id", "").node_id_plus(0x200);
        rows[at + 1] = Entry::new(0x1400 + n, 2, Unsigned8, ReadWrite, "transmission_type", "").default(255);
        at += 2;
        n += 1;
    }
    n = 0;
    while n < RPDOS as u16 {
        rows[at] = Entry::new(0x1600 + n, 0, Unsigned8, ReadWrite, "mapping", "").default(OBJECTS as i64);
        at += 1;
        let mut sub = 1;
        while sub <= OBJECTS {
            let object = (FIRST_OBJECT + n) as i64;
            rows[at] = Entry::new(0x1600 + n, sub as u8, Unsigned32, ReadWrite, "object", "")
                .default(object << 16 | (sub as i64) << 8 | 8);
            at += 1;
            sub += 1;
        }
        n += 1;
    }
    n = 0;
    while n < RPDOS as u16 {
        let mut sub = 1;
        while sub <= OBJECTS {
            rows[at] = Entry::new(FIRST_OBJECT + n, sub as u8, Unsigned8, ReadWrite, "byte", "").mappable();
            at += 1;
            sub += 1;
        }
        n += 1;
    }
    rows
};
static INDEX: Index<COUNT> = Index::of(&ROWS);
static TABLE: Table = Table::new(&ROWS, &INDEX);
static PROFILE: NodeProfile = NodeProfile::cia_301(&TABLE);

fn first_four() -> [PdoNumber; 4] {
    [1, 2, 3, 4].map(|number| PdoNumber::new(number).unwrap())
}

/// Places for events in the node of these tests.
const EVENT_QUEUE_LENGTH: usize = 64;

fn operational() -> Bench {
    let mut bench = Bench::new(&PROFILE);
    bench.talk("> 000#0104");
    assert_eq!(bench.events(), [NodeEvent::Nmt(NmtState::Operational)]);
    bench
}

/// The writes that an RPDO with the bytes 1 to 8 makes.
fn written(number: PdoNumber) -> Vec<NodeEvent> {
    let write = |sub: u8| NodeEvent::Written {
        slot: TABLE.slot(FIRST_OBJECT + number.position() as u16, sub),
        raw: u32::from(sub),
        via: Via::Rpdo(number),
    };
    (1..=OBJECTS as u8).map(write).collect()
}

#[test]
fn a_sync_that_lets_four_rpdos_of_eight_objects_take_effect_loses_none_of_33_events() {
    let mut bench = operational();
    for n in 0..RPDOS as u8 {
        bench.send(&format!("604#2F{n:02X}140201000000"));
        bench.sent.clear();
    }
    bench.send("204#0102030405060708");
    bench.events();
    bench.send("080#");
    let expected: Vec<_> = std::iter::once(NodeEvent::Sync).chain(first_four().into_iter().flat_map(written)).collect();
    assert_eq!((bench.events(), expected.len()), (expected, 33));
}

#[test]
fn a_frame_that_four_rpdos_listen_to_after_they_were_too_short_loses_none_of_36_events() {
    let mut bench = operational();
    bench.talk("> 204#0102030405");
    assert_eq!(bench.events(), first_four().map(NodeEvent::RpdoTooShort));
    bench.talk("> 204#0102030405060708");
    let of_one = |number| std::iter::once(NodeEvent::RpdoFits(number)).chain(written(number));
    let expected: Vec<_> = first_four().into_iter().flat_map(of_one).collect();
    assert_eq!((bench.events(), expected.len()), (expected, 36));
}

#[test]
fn an_rpdo_that_stays_too_short_is_reported_once_and_reported_when_it_fits_again() {
    let mut bench = operational();
    // Only RPDO 1 and 2 stay valid.
    for n in 2..4_u8 {
        bench.send(&format!("604#23{n:02X}140104020080"));
        bench.sent.clear();
    }
    bench.events();
    bench.talk("> 204#01\n > 204#\n > 204#01020304050607");
    let [first, second, ..] = first_four();
    assert_eq!(bench.events(), [NodeEvent::RpdoTooShort(first), NodeEvent::RpdoTooShort(second)]);
    bench.talk("> 204#0102030405060708\n > 204#0102030405060708");
    let fits = bench.events().into_iter().filter(|event| matches!(event, NodeEvent::RpdoFits(_)));
    assert_eq!(fits.collect::<Vec<_>>(), [NodeEvent::RpdoFits(first), NodeEvent::RpdoFits(second)]);
}

#[test]
fn an_owner_that_does_not_poll_learns_that_events_are_lost_and_gets_the_newest() {
    let mut bench = operational();
    let most = EVENT_QUEUE_LENGTH / (RPDOS * OBJECTS);
    for _ in 0..most {
        bench.send("204#0102030405060708");
    }
    let full = bench.clone().events();
    assert_eq!(full.len(), EVENT_QUEUE_LENGTH, "full to the brim");
    assert!(!full.contains(&NodeEvent::EventsLost));
    bench.send("080#");
    let events = bench.events();
    assert_eq!((events.len(), events[0]), (EVENT_QUEUE_LENGTH, NodeEvent::EventsLost));
    assert_eq!(events[1..], [&full[2..], &[NodeEvent::Sync]].concat());
    bench.send("080#");
    assert_eq!(bench.events(), [NodeEvent::Sync], "reported once");
}
