//! What holds for the data files of every drive, before they judge it. What only one drive's files have is in
//! `data_of_the_DRIVE`.

use std::collections::HashSet;

use ferrodrive_tests::bench::BenchSubject;
use ferrodrive_tests::bench::cia402::Cia402;
use ferrodrive_tests::bench::mjoint::MJoint;
use ferrodrive_tests::bench::zlac8030l::Zlac8030l;
use ferrodrive_tests::bench::zlim42c::Zlim42c;
use ferrodrive_tests::manual::ObjectRow;
use ferrodrive_tests::power_states::PowerSubject;
use ferrodrive_tests::{mjoint, zlac8030l, zlim42c};

fn object_tables() -> [&'static [ObjectRow]; 3] {
    [Zlac8030l::rows().all(), Zlim42c::rows().all(), MJoint::rows().all()]
}

#[test]
fn each_object_table_has_the_manuals_rows_and_those_that_it_lost_or_the_standard_adds_in_order() {
    // 194 printed and 1018h:03; 151 printed, six lost at page breaks, 1018h:03; 93 printed, 1001h, the counts of ten records.
    assert_eq!(object_tables().map(<[_]>::len), [194 + 1, 151 + 7, 93 + 11]);
    for rows in object_tables() {
        assert!(rows.is_sorted_by(|one, next| one.key() < next.key()), "in order, none twice");
    }
}

#[test]
fn defaults_lie_within_their_limits_and_limits_within_their_types() {
    for row in object_tables().concat() {
        row.check();
    }
}

#[test]
fn every_sdo_datagram_names_an_object_carries_its_size_and_is_answered_as_the_standard_demands() {
    let [servo, stepper, joint] = object_tables();
    for (datagrams, printed, rows, node) in [
        (zlac8030l::datagrams(), 98, servo, 4),
        (zlim42c::datagrams(), 37, stepper, 1),
        (mjoint::datagrams(), 41, joint, 1),
    ] {
        assert_eq!(datagrams.len(), printed);
        let requests: Vec<_> = datagrams.iter().filter(|it| it.sdo_server() == Some(node)).collect();
        assert!(requests.len() > printed / 3, "{} requests", requests.len());
        requests.iter().for_each(|it| it.check_sdo(rows, node));
    }
}

#[test]
fn what_is_stored_can_be_written_but_for_the_joints_position_that_is_recorded_at_power_off() {
    let read_only = object_tables().concat().into_iter().filter(|row| row.stored && !row.writable);
    assert_eq!(read_only.map(|row| row.index).collect::<Vec<_>>(), [0x6063]);
}

#[test]
fn each_power_state_table_is_full_and_only_fault_reset_leaves_fault() {
    for cells in [Zlac8030l::power_states(), Zlim42c::power_states(), Cia402::power_states()] {
        let states: HashSet<_> = cells.iter().map(|(cell, _)| cell.state.as_str()).collect();
        let events: HashSet<_> = cells.iter().map(|(cell, _)| cell.event.as_str()).collect();
        assert_eq!((states.len(), events.len(), cells.len()), (8, 11, 88));
        assert!(cells.iter().all(|(cell, _)| states.contains(cell.state_after.as_str())));
        let leaves = cells.iter().filter(|(cell, _)| cell.state == "fault" && cell.state_after != "fault");
        assert_eq!(leaves.map(|(cell, _)| cell.event.as_str()).collect::<Vec<_>>(), ["fault_reset"]);
    }
}

#[test]
fn the_low_nibble_of_the_statusword_is_the_one_that_the_manuals_print_after_each_command() {
    // ZLAC8030L, 7.1, ZLIM42-C, 5.3.2, and CiA 402-2, 8.4.2: 6040h = 0, 6, 7, Fh give the low nibbles 0, 1, 3, 7.
    for cells in [Zlac8030l::power_states(), Zlim42c::power_states(), Cia402::power_states()] {
        let mut state = "switch_on_disabled";
        for (controlword, nibble) in [(0x0, 0x0), (0x6, 0x1), (0x7, 0x3), (0xF, 0x7)] {
            let found = cells.iter().find(|(cell, _)| cell.state == state && cell.controlword == Some(controlword));
            let (cell, _) = found.expect("the table is full");
            assert_eq!(cell.low_byte_after & 0xF, nibble, "{cell:?}");
            state = &cell.state_after;
        }
    }
}
