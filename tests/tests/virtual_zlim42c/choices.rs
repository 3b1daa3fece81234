//! What can be chosen of a drive beside homing (Z050) and emergency stops (Z092): `reading=Z010:power-cycle`, `defaults=eds`.

use crate::bench::{Bench, assert_within};

/// Object, the manual's default (5.4) and the EDS's; of its mappings those entries that map something.
const DIFFERENT: [(u16, u8, i64, i64); 13] = [
    (0x1600, 0, 1, 2),
    (0x1600, 2, 0, 0x6060_0008),
    (0x1800, 2, 255, 254),
    (0x1800, 3, 0, 100),
    (0x1801, 2, 255, 254),
    (0x1801, 3, 0, 100),
    (0x1803, 2, 255, 254),
    (0x1803, 3, 0, 100),
    (0x1A00, 0, 0, 1),
    (0x1A00, 1, 0, 0x6041_0010),
    (0x2030, 0, 16, 14),
    (0x6081, 0, 120, 60),
    (0x60FF, 0, 0, 120),
];

#[test]
fn a_fault_goes_with_a_reset_or_by_3_4_with_the_supply_only() {
    for (choice, resets) in [("reset", true), ("power-cycle", false)] {
        for (index, value) in [(0x6040, 0x80), (0x2011, 1)] {
            let mut bench = Bench::choosing("Z010", choice);
            bench.tell("1 supply 45").run_ms(50).reads(0x603F, 0xFF01);
            bench.tell("1 supply 24").run_ms(500);
            bench.set(index, value).run_ms(5);
            let expected = if resets { (0, 0x40) } else { (0xFF01, 0x08) };
            assert_eq!((bench.get(0x603F), bench.statusword() & 0x4F), expected, "{choice}, {index:04X}h");
            bench.power_cycle();
            assert_eq!((bench.get(0x603F), bench.statusword() & 0x4F), (0, 0x40), "{choice}: after a power cycle");
        }
    }
}

#[test]
fn each_factory_value_is_the_manuals_or_that_of_the_eds_also_after_a_restore() {
    let (mut manual, mut bench) = (Bench::new(), Bench::choosing("defaults", "eds"));
    for (index, sub, printed, given) in DIFFERENT {
        assert_eq!((manual.get((index, sub)), bench.get((index, sub))), (printed, given), "{index:04X}h:{sub:02X}");
    }
    bench.set((0x1800, 3), 7).set(0x60FF, 7).set(0x2010, 2).let_store().power_cycle();
    assert_eq!((bench.get((0x1800, 3)), bench.get(0x60FF)), (7, 120), "what is stored, and what is not");
    bench.set(0x2010, 1).let_store().power_cycle();
    for (index, sub, _, given) in DIFFERENT {
        assert_eq!(bench.get((index, sub)), given, "{index:04X}h:{sub:02X} after factory settings");
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
