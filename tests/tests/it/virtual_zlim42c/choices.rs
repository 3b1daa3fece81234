//! What can be chosen of a drive beside homing (Z050) and emergency stops (Z092): `reading=Z010:power-cycle`, `defaults=eds`.

use crate::virtual_zlim42c::bench::{Bench, assert_within};

#[test]
fn a_fault_goes_with_a_reset_or_by_3_4_with_the_supply_only() {
    for (choice, resets) in [("reset", true), ("power-cycle", false)] {
        for (index, value) in [(0x6040, 0x80), (0x2011, 1)] {
            let mut bench = Bench::choosing("Z010", choice);
            bench.world("1 supply 45").run_ms(50).reads(0x603F, 0xFF01);
            bench.world("1 supply 24").run_ms(500);
            bench.set(index, value).run_ms(5);
            let expected = if resets { (0, 0x40) } else { (0xFF01, 0x08) };
            assert_eq!((bench.get(0x603F), bench.statusword() & 0x4F), expected, "{choice}, {index:04X}h");
            bench.power_cycle();
            assert_eq!((bench.get(0x603F), bench.statusword() & 0x4F), (0, 0x40), "{choice}: after a power cycle");
        }
    }
}

#[test]
fn by_the_eds_rpdo_0_carries_controlword_and_mode_and_a_drive_enabled_in_mode_3_turns_at_120_rpm() {
    let mut bench = Bench::choosing("defaults", "eds");
    bench.forget().send("000#0101").run_ms(60);
    assert_eq!(bench.heard_of("181#"), ["181#7002"], "once on entering operational");
    for frame in ["201#060003", "201#070003", "201#0F0003"] {
        bench.send(frame).run_ms(5);
    }
    bench.run_ms(500).reads(0x6061, 3);
    assert_within("r/min", bench.report().velocity_rpm, 100.0, 140.0);
}
