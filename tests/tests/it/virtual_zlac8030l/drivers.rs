//! What public drivers of real robots do with this drive, and what it does for them (docs/drives/zlac8030l.md: L024, L044 to
//! L046, L056, L075, L077, L083, L090, L093, L127, "What drivers show").

use devices::variant::Preset;

use crate::virtual_zlac8030l::bench::{Bench, assert_within};

const NOT_MAPPABLE: u32 = 0x0604_0041;

/// A driver that enables and writes 60FFh and 6071h only.
fn drives_without_a_mode(bench: &mut Bench) -> f64 {
    bench.enable().set(0x60FF, 60).run_ms(900);
    bench.report().velocity_rpm
}

#[test]
fn a_driver_that_never_writes_6060h_turns_the_wheel_of_a_drive_that_was_given_its_mode() {
    let mut bench = Bench::ordered("L090", "mode", &[Preset::new(0x6060, 0, 3)]);
    bench.reads(0x6060, 3).reads(0x6061, 3);
    assert_within("speed", drives_without_a_mode(&mut bench), 59.0, 61.0);
    assert_eq!(drives_without_a_mode(&mut Bench::new()), 0.0, "as delivered the mode is 0");
}

#[test]
fn a_save_keeps_the_mode_a_write_alone_does_not_and_factory_settings_take_it_away() {
    let mut bench = Bench::new();
    bench.set(0x6060, 3).let_store().power_cycle();
    assert_eq!(bench.get(0x6060), 0, "written, not saved");
    bench.set(0x6060, 3).set(0x2009, 2).let_store().power_cycle().reads(0x6060, 3).reads(0x6061, 3);
    bench.send("000#8104").run_ms(10);
    assert_within("speed", drives_without_a_mode(&mut bench), 59.0, 61.0);
    bench.set(0x6040, 0).run_ms(2000);
    bench.set(0x2009, 1).let_store().reads(0x6060, 0).reads(0x6061, 0);
    bench.power_cycle().reads(0x6060, 0);
}

#[test]
fn with_l090_marked_neither_a_save_nor_factory_settings_are_about_the_mode() {
    let mut bench = Bench::choosing("L090", "marked");
    bench.set(0x6060, 3).set(0x2009, 1).let_store().reads(0x6060, 3);
    bench.set(0x2009, 2).let_store().power_cycle().reads(0x6060, 0).reads(0x6061, 0);
}

/// -1.0 A of 6077h mapped with 32 bits were seen as F6 FF 00 00.
#[test]
fn an_object_mapped_with_more_bits_than_it_has_is_sent_with_zeros_above_and_with_fewer_is_refused() {
    let mut bench = Bench::open();
    bench.enable_in(4);
    bench.motor().rig.load.locked = true;
    bench.set(0x6087, 0).set(0x6071, -1000).run_ms(200);
    bench.map(0x1A00, &[0x6077_0020, 0x6041_0010]).reads(0x6077, -10);
    bench.forget().send("000#0104").run_ms(5);
    let sent = bench.heard_of("184#");
    assert!(sent[0].starts_with("184#F6FF0000") && sent[0].len() == "184#F6FF0000".len() + 4, "{sent:?}");
    bench.set(0x1A00, 0);
    for entry in [0x6077_0008, 0x606C_0010, 0x6041_0011, 0x6041_0000] {
        assert_eq!(bench.write((0x1A00, 1), entry), Err(NOT_MAPPABLE), "{entry:08X}h");
    }
}

#[test]
fn an_rpdo_entry_with_more_bits_than_its_object_gives_it_the_lowest_of_them() {
    let mut bench = Bench::new();
    bench.map(0x1601, &[0x6071_0020, 0x6060_0008]).send("000#0104").send("304#18FCFFFF03");
    bench.reads(0x6071, -1000).reads(0x6060, 3);
    bench.send("304#E803345604").reads(0x6071, 1000).reads(0x6060, 4);
}

#[test]
fn nothing_is_sent_after_nmt_start_with_the_mapping_as_delivered() {
    let mut bench = Bench::new();
    bench.forget().send("000#0104").run_ms(500);
    let heard: Vec<_> = bench.heard_of("").into_iter().filter(|frame| !frame.starts_with("000#")).collect();
    assert!(heard.is_empty(), "{heard:?}");
}

#[test]
fn a_cob_id_is_rewritten_without_bit_31_and_a_mapping_while_the_pdo_is_valid() {
    let mut bench = Bench::new();
    bench.set((0x1800, 1), 0x185).map(0x1A00, &[0x606C_0020]).send("000#0104").run_ms(5);
    bench.hears_of("185#", &["185#00000000"]);
}

#[test]
fn the_mode_may_come_after_0fh_80h_without_a_fault_does_nothing_and_0_frees_the_wheel() {
    let mut bench = Bench::new();
    bench.set(0x2000, 0);
    assert_eq!(bench.statusword() & 0x6F, 0x60, "switch on disabled");
    bench.set(0x6040, 0x80).shows(0x6F, 0x60);
    bench.enable().set(0x6060, 3).set(0x60FF, 60).run_ms(900).turns_at(59.0, 61.0);
    bench.set(0x6040, 0x80).run_ms(100);
    assert_eq!(bench.statusword() & 0x6F, 0x27, "nothing to reset");
    bench.turns_at(59.0, 61.0);
    bench.set(0x6040, 0).run_ms(100);
    assert_within("it coasts", bench.report().velocity_rpm, 45.0, 59.0);
}
