//! The object dictionary over the bus.

use ferrodrive_tests::manual::ObjectRow;
use ferrodrive_tests::mjoint::objects;

use crate::virtual_mjoint::bench::Bench;

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
