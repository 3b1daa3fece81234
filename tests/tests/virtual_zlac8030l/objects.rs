//! Every row of the manual's object table on the running drive: width, default, access, range and store.

use ferrodrive_tests::bench::zlac8030l::Zlac8030l;
use ferrodrive_tests::object_rows::{self, Memory};

use crate::bench::Bench;

pub(crate) const MEMORY: Memory = Memory {
    switch: 0x2010,
    command: 0x2009,
    // The bit rate: see `network`. The others do something and read 0 again.
    without: &[0x200E, 0x2005, 0x2006, 0x2009],
    node_id: Some(0x200D),
};

#[test]
fn each_object_is_read_with_its_width_and_its_default() {
    object_rows::are_read_with_their_width_and_default::<Zlac8030l>();
}

#[test]
fn a_read_only_object_refuses_every_write() {
    object_rows::refuse_writes_where_they_are_read_only::<Zlac8030l>();
}

#[test]
fn what_a_range_holds_is_taken_and_what_lies_beyond_is_refused_with_the_right_code() {
    object_rows::take_their_range_and_refuse_what_lies_beyond::<Zlac8030l>();
}

#[test]
fn a_value_between_the_listed_ones_is_refused() {
    // 6060h: no mode 2 (velocity mode), and 6 is homing in CiA 402 (docs/drives/zlac8030l.md, L020).
    let modes = [2, 5, 6, 7, 8, 9, 10, -1].map(|mode| (0x6060, mode));
    let options = [(0x605A, 4), (0x605A, 8), (0x605D, 0), (0x605D, 4), (0x605B, 2), (0x605C, -1)];
    object_rows::refuse_values_between_the_listed::<Zlac8030l>(&[&modes[..], &options].concat());
}

#[test]
fn a_write_of_another_width_is_refused_and_changes_nothing() {
    object_rows::refuse_another_width::<Zlac8030l>();
}

#[test]
fn a_missing_object_and_a_missing_sub_index_are_told_apart() {
    let objects = [0x1003, 0x1006, 0x1008, 0x100C, 0x1010, 0x1011, 0x1016, 0x2024, 0x2031, 0x6098, 0x60C2, 0x6502];
    let beyond = [(0x1000, 1), (0x1018, 4), (0x1400, 6), (0x1A00, 5), (0x2026, 3), (0x202F, 6)];
    let unused = (0x06..=0x0B).chain([0x10]).map(|sub| (0x2030, sub));
    let sub_indexes: Vec<_> = beyond.into_iter().chain(unused).collect();
    object_rows::are_missed_by_object_or_by_sub_index::<Zlac8030l>(&objects, &sub_indexes);
}

#[test]
fn what_is_live_reads_what_a_resting_drive_has() {
    let expected = [
        (0x2003, 0, 0..=0),
        (0x2004, 0, 0..=0),
        (0x2026, 1, 245..=255),
        (0x2026, 2, 245..=255),
        (0x2027, 0, 0..=0),
        (0x2028, 0, 1..=6),
        (0x2029, 0, 4790..=4800),
        (0x6041, 0, 0x0670..=0x0670),
        (0x6064, 0, 0..=0),
        (0x606C, 0, 0..=0),
        (0x6074, 0, 0..=0),
        (0x6077, 0, 0..=0),
    ];
    object_rows::read_at_rest::<Zlac8030l>(&expected, &[0x1009, 0x100A, 0x2025]);
    let mut bench = Bench::new();
    assert_eq!(bench.get(0x2025), bench.get(0x100A), "the software version in both places");
}

#[test]
fn with_2010h_0_a_write_outlives_a_power_cycle_if_and_only_if_the_object_is_stored() {
    object_rows::outlive_a_power_cycle_if_and_only_if_stored::<Zlac8030l>(&MEMORY);
}

#[test]
fn with_2010h_1_nothing_is_kept_until_2009h_is_2_and_2009h_1_restores_it() {
    object_rows::are_kept_and_restored_only_on_command::<Zlac8030l>(&MEMORY);
}

#[test]
fn clearing_a_position_reads_zero_again_and_zeroes_the_position() {
    for index in [0x2005, 0x2006] {
        let mut bench = Bench::new();
        bench.enable_in(3).set(0x60FF, 60).run_ms(1000);
        bench.set(0x60FF, 0).run_ms(1000);
        assert!(bench.get(0x6064) > 1000);
        bench.set(index, 0);
        assert!(bench.get(0x6064) > 1000, "0 is invalid");
        bench.set(index, 1);
        assert_eq!((bench.get(0x6064), bench.get(index)), (0, 0), "{index:04X}h");
    }
}
