//! `defaults=eds`: the factory values of the maker's EDS, which are not those of the manual (docs/drives/zlac8030l.md, L077).

use crate::virtual_zlac8030l::bench::{Bench, assert_within};

fn eds() -> Bench {
    Bench::choosing("defaults", "eds")
}

#[test]
fn after_nmt_reset_communication_the_records_are_those_of_the_eds_too() {
    let mut bench = eds();
    bench.set((0x1800, 3), 7).set(0x2009, 1).let_store().set(0x2010, 1).set(0x1A00, 0).send("000#820n").run_ms(10);
    bench.reads(0x1A00, 4).reads((0x1800, 3), 100);
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
