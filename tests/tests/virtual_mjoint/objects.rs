//! The object dictionary over the bus.

use ferrodrive_tests::bench::mjoint::MJoint;
use ferrodrive_tests::object_rows::{self, INVALID_VALUE, NO_SUCH_OBJECT, NO_SUCH_SUB_INDEX, TOO_HIGH};

use ferrodrive_tests::manual::ObjectRow;
use ferrodrive_tests::mjoint::objects;

use crate::bench::Bench;

#[test]
fn every_object_is_read_with_its_width_and_its_default_after_power_on() {
    object_rows::are_read_with_their_width_and_default::<MJoint>();
}

#[test]
fn mappings_and_read_only_objects_refuse_writes() {
    object_rows::refuse_writes_where_they_are_read_only::<MJoint>();
}

#[test]
fn what_a_range_holds_is_taken_and_what_lies_beyond_is_refused_with_the_right_code() {
    object_rows::take_their_range_and_refuse_what_lies_beyond::<MJoint>();
}

#[test]
fn a_write_of_another_width_is_refused_and_changes_nothing() {
    object_rows::refuse_another_width::<MJoint>();
}

#[test]
fn refusals_are_those_of_cia_301() {
    let mut bench = Bench::new();
    for index in [0x603F, 0x6061, 0x607C, 0x6084, 0x6099, 0x609A, 0x6502, 0x1003, 0x1008, 0x1010, 0x1014, 0x1200] {
        assert_eq!(bench.write(index, 0), Err(NO_SUCH_OBJECT), "{index:04X}h");
    }
    bench.refuses((0x60F9, 3), 0, NO_SUCH_SUB_INDEX).refuses(0x6083, 65_536, TOO_HIGH);
    for (index, sub, value) in [(0x6060, 0, 2), (0x6060, 0, 8), (0x2619, 0, 5), (0x2619, 0, 29), (0x1403, 2, 255)] {
        assert_eq!(bench.write((index, sub), value), Err(INVALID_VALUE), "{index:04X}h = {value}");
    }
    assert!(bench.write(0x2614, 2).is_err(), "2 is only ever read");
}

/// Another value than the default that the joint takes; `None` for commands that read something else again.
fn other_value(row: &ObjectRow) -> Option<i64> {
    let default = row.default?;
    Some(match (row.index, row.sub) {
        // One transmission type each; an alarm code that cannot be set; the save itself.
        (0x1400..=0x1403 | 0x1800..=0x1803, 2) | (0x260E | 0x2614, _) => return None,
        (0x1400..=0x1403 | 0x1800..=0x1803, 1) => 0x8000_0000 | default,
        (0x2615, _) => 5,
        (0x6060, _) => 3,
        _ => row.other_value()?,
    })
}

#[test]
fn of_all_that_can_be_written_exactly_the_stored_outlives_a_save_and_a_power_cycle() {
    let mut asked = 0;
    for row in objects().into_iter().map(|joint| joint.row).filter(|row| row.writable) {
        let Some(other) = other_value(&row) else { continue };
        let kept = if row.stored { other } else { row.default.expect("a default") };
        for save in [false, true] {
            let mut bench = Bench::new();
            bench.set((row.index, row.sub), other);
            assert_eq!(bench.get((row.index, row.sub)), other, "{:04X}h:{:02X}", row.index, row.sub);
            if save {
                bench.save();
            }
            bench.power_cycle();
            if save && row.index == 0x2615 {
                bench.node = 5;
            }
            let expected = if save { kept } else { row.default.expect("a default") };
            assert_eq!(bench.get((row.index, row.sub)), expected, "{:04X}h:{:02X}, saved: {save}", row.index, row.sub);
        }
        asked += 1;
    }
    assert_eq!(asked, 8 + 8 + 2 + 23, "COB-IDs, inhibit times, heartbeats, and the control objects");
}

#[test]
fn what_is_stored_survives_a_power_cycle_and_what_commands_does_not() {
    let mut bench = Bench::new();
    for (index, sub, value) in [(0x6081, 0, 900), (0x6083, 0, 10_005), (0x60FB, 1, 2501), (0x1017, 0, 500)] {
        bench.set((index, sub), value);
    }
    bench.set(0x60FF, 300).power_cycle();
    assert_eq!(bench.get(0x6081), 1500, "nothing was saved yet");
    for (index, sub, value) in [(0x6081, 0, 900), (0x6083, 0, 10_005), (0x60FB, 1, 2501), (0x1017, 0, 500)] {
        bench.set((index, sub), value);
    }
    bench.set(0x60FF, 300).save().power_cycle();
    for (index, sub, value) in
        [(0x6081, 0, 900), (0x6083, 0, 10_005), (0x60FB, 1, 2501), (0x1017, 0, 500), (0x60FF, 0, 0)]
    {
        assert_eq!(bench.get((index, sub)), value, "{index:04X}h");
    }
}

#[test]
fn a_new_address_counts_after_saving_and_a_power_cycle_and_takes_the_pdos_with_it() {
    let mut bench = Bench::new();
    bench.set(0x2615, 9).save();
    bench.send("000#8101").run_ms(5);
    assert_eq!(bench.get(0x2615), 9, "NMT reset keeps the node-ID in use");
    bench.power_cycle();
    assert!(bench.heard().contains(&"709#00".to_string()));
    assert_eq!(bench.get_from(9, (0x1400, 1)), 0x209);
    bench.send("309#0000000000000000");
    assert!(bench.heard().iter().any(|frame| frame.starts_with("289#")));
}
