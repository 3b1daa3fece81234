//! `defaults=eds`: the factory values of the maker's EDS, which are not those of the manual (docs/drives/zlac8030l.md, L077).

use crate::bench::{Bench, assert_within};

/// Objects whose default differs in the two documents of the maker: index, sub-index, the manual's, the EDS's.
const DIFFERENT: [(u16, u8, i64, i64); 28] = [
    (0x1600, 0, 1, 4),
    (0x1600, 2, 0, 0x6060_0008),
    (0x1601, 0, 0, 4),
    (0x1602, 0, 0, 4),
    (0x1603, 0, 0, 4),
    (0x1800, 2, 255, 254),
    (0x1801, 2, 255, 254),
    (0x1802, 2, 255, 254),
    (0x1803, 2, 255, 254),
    (0x1800, 3, 0, 100),
    (0x1801, 3, 0, 100),
    (0x1802, 3, 0, 100),
    (0x1803, 3, 0, 100),
    (0x1A00, 0, 0, 4),
    (0x1A00, 1, 0, 0x6041_0010),
    (0x1A01, 0, 0, 4),
    (0x1A02, 0, 0, 4),
    (0x1A03, 0, 0, 4),
    (0x2014, 0, 150, 300),
    (0x2015, 0, 300, 600),
    (0x201F, 0, 1000, 100),
    (0x2023, 0, 2, 4),
    (0x202A, 0, 0, 1000),
    (0x202B, 0, 0, 750),
    (0x202C, 0, 0, 350),
    (0x202D, 0, 0, 1000),
    (0x2030, 0, 16, 14),
    (0x60FF, 0, 0, 120),
];

fn eds() -> Bench {
    Bench::choosing("defaults", "eds")
}

#[test]
fn each_value_is_that_of_the_eds_after_power_on_a_reset_and_factory_settings() {
    let mut manual = Bench::new();
    let mut bench = eds();
    for (index, sub, printed, given) in DIFFERENT {
        assert_eq!((manual.get((index, sub)), bench.get((index, sub))), (printed, given), "{index:04X}h:{sub:02X}");
    }
    bench.set(0x2014, 77).set((0x1800, 3), 7).set(0x60FF, 7).let_store();
    bench.set(0x2009, 1).let_store().power_cycle();
    for (index, sub, _, given) in DIFFERENT {
        assert_eq!(bench.get((index, sub)), given, "{index:04X}h:{sub:02X} after factory settings");
    }
    bench.set(0x2010, 1).set(0x1A00, 0).send("000#8204").run_ms(10);
    assert_eq!((bench.get(0x1A00), bench.get((0x1800, 3))), (4, 100), "after NMT reset communication");
}

#[test]
fn rpdo_0_carries_controlword_and_mode_and_tpdo_0_the_statusword_at_most_every_50_ms() {
    let mut bench = eds();
    bench.set(0x2000, 0).set(0x60FF, 0).forget().send("000#0104").run_ms(60);
    assert_eq!(bench.heard_of("184#"), ["184#7006"], "once on entering operational");
    bench.send("204#060003").reads(0x6060, 3).shows(0x6F, 0x21);
    bench.run_ms(60);
    bench.forget();
    for frame in ["204#070003", "204#0F0003"] {
        bench.send(frame);
    }
    bench.run_ms(200);
    let times: Vec<_> =
        bench.heard_at().into_iter().filter(|(_, frame)| frame.standard_data_id() == Some(0x184)).collect();
    assert_eq!(times.len(), 2, "{times:?}");
    let apart_ms = times[1].0.nanos_since(times[0].0) as f64 * 1e-6;
    assert_within("ms between two TPDOs: 100 of 0.5 ms", apart_ms, 50.0, 50.6);
    assert_eq!(times[1].1.data()[0] & 0x6F, 0x27);
    // Two bytes are fewer than are mapped.
    bench.send("204#0000").shows(0x6F, 0x27);
}

#[test]
fn entries_of_zero_that_are_counted_in_carry_nothing() {
    let mut bench = eds();
    bench.map(0x1A01, &[0x606C_0020, 0, 0x6077_0010]).send("000#0104").run_ms(5);
    let sent = bench.heard_of("284#");
    assert_eq!(sent, ["284#000000000000"]);
    assert!(bench.heard_of("384#").is_empty(), "nothing but zeros is nothing");
}

#[test]
fn enabled_in_profile_velocity_it_turns_at_120_rpm_at_once_and_holds_its_speed_with_the_observer_on() {
    let mut bench = eds();
    bench.enable_in(3).run_ms(1500).turns_at(119.5, 120.5);
    bench.set_load_torque(3.0).run_ms(1500);
    assert_within("speed under 3 N m", bench.report().velocity_rpm, 119.0, 121.0);
    bench.reads(0x603F, 0);
}
