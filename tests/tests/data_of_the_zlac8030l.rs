//! The data files agree with themselves and with CiA 301: before they judge a drive, they are judged.

use std::collections::HashSet;

use ferrodrive_tests::zlac8030l::{datagrams, objects, power_states};

#[test]
fn the_object_table_has_the_manuals_rows_and_the_revision_in_order() {
    let objects = objects();
    assert_eq!(objects.len(), 195, "194 printed rows and 1018h:03");
    assert!(objects.is_sorted_by(|one, next| one.key() < next.key()), "in order, none twice");
}

#[test]
fn defaults_lie_within_their_limits_and_limits_within_their_types() {
    for row in objects() {
        row.check();
        assert!(row.limits.is_none_or(|(low, high)| low < high), "{row:?}");
    }
}

#[test]
fn what_is_stored_can_be_written_and_what_cannot_be_written_is_not_stored() {
    let wrong: Vec<_> = objects().into_iter().filter(|row| row.stored && !row.writable).collect();
    assert!(wrong.is_empty(), "{wrong:?}");
}

#[test]
fn every_printed_answer_is_the_answer_that_the_standard_demands() {
    let datagrams = datagrams();
    assert_eq!(datagrams.len(), 98);
    for datagram in datagrams.iter().filter(|datagram| datagram.request.is_some()) {
        if let Some((cob, data)) = &datagram.response {
            assert_eq!(*cob, 0x584, "{datagram:?}");
            let printed: Vec<_> = data.iter().copied().map(Some).collect();
            assert_eq!(printed, datagram.answer, "{datagram:?}");
        }
    }
}

#[test]
fn every_sdo_datagram_names_an_object_of_the_table_and_carries_its_size() {
    let (objects, datagrams) = (objects(), datagrams());
    let requests: Vec<_> = datagrams.iter().filter(|it| matches!(it.request, Some((0x604, _)))).collect();
    assert!(!requests.is_empty());
    for datagram in requests {
        datagram.check_sdo_request(&objects, 4);
    }
}

#[test]
fn the_power_state_table_is_full_and_only_fault_reset_leaves_fault() {
    let cells = power_states();
    let states: HashSet<_> = cells.iter().map(|cell| cell.state.as_str()).collect();
    let events: HashSet<_> = cells.iter().map(|cell| cell.event.as_str()).collect();
    assert_eq!((states.len(), events.len(), cells.len()), (8, 11, 88));
    assert!(cells.iter().all(|cell| states.contains(cell.state_after.as_str())));
    let leaving: Vec<_> = cells.iter().filter(|cell| cell.state == "fault" && cell.state_after != "fault").collect();
    assert_eq!(leaving.iter().map(|cell| cell.event.as_str()).collect::<Vec<_>>(), ["fault_reset"]);
}

#[test]
fn the_low_nibble_of_the_statusword_is_the_one_that_the_manual_prints_after_each_command() {
    // Manual 7.1: 6040h = 0, 6, 7, Fh give the low nibbles 0, 1, 3, 7.
    let after = |state: &str, controlword: u16| {
        let cells = power_states();
        let cell = cells.iter().find(|cell| cell.state == state && cell.controlword == Some(controlword));
        cell.expect("the table is full").low_byte_after & 0x0F
    };
    assert_eq!(after("switch_on_disabled", 0x0000), 0x0);
    assert_eq!(after("switch_on_disabled", 0x0006), 0x1);
    assert_eq!(after("ready_to_switch_on", 0x0007), 0x3);
    assert_eq!(after("switched_on", 0x000F), 0x7);
}
