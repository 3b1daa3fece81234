//! Every row of the manual's object table on the running drive: width, default, access, range and store.

use ferrodrive_tests::bench::zlim42c::Zlim42c;
use ferrodrive_tests::object_rows::{self, Memory};

use crate::bench::Bench;

pub(crate) const MEMORY: Memory = Memory {
    switch: 0x200C,
    command: 0x2010,
    // The bit rate: see `address`. The others do something and read 0 again.
    without: &[0x2009, 0x2010, 0x2011, 0x2012],
    // The address switches are set, and go before 2008h.
    node_id: None,
};

#[test]
fn each_object_is_read_with_its_width_and_its_default() {
    object_rows::are_read_with_their_width_and_default::<Zlim42c>();
}

#[test]
fn a_read_only_object_refuses_every_write() {
    object_rows::refuse_writes_where_they_are_read_only::<Zlim42c>();
}

#[test]
fn what_a_range_holds_is_taken_and_what_lies_beyond_is_refused_with_the_right_code() {
    object_rows::take_their_range_and_refuse_what_lies_beyond::<Zlim42c>();
}

#[test]
fn a_value_between_the_listed_ones_is_refused() {
    // 6060h: no mode 2 (velocity mode), whatever 5.3.3 prints (docs/drives/zlim42c.md, Z036), and no torque.
    let modes = [2, 4, 5, 7, 8, 9, 10, -1].map(|mode| (0x6060, mode));
    let options = [(0x605A, 4), (0x605A, 8), (0x605D, 0), (0x605D, 4), (0x605B, 2), (0x605C, -1)];
    object_rows::refuse_values_between_the_listed::<Zlim42c>(&[&modes[..], &options].concat());
}

#[test]
fn a_write_of_another_width_is_refused_and_changes_nothing() {
    object_rows::refuse_another_width::<Zlim42c>();
}

#[test]
fn a_missing_object_and_a_missing_sub_index_are_told_apart() {
    let objects =
        [0x1003, 0x1006, 0x1007, 0x1015, 0x1016, 0x1010, 0x1011, 0x200D, 0x200F, 0x6071, 0x6077, 0x6087, 0x6502];
    let beyond = [(0x1000, 1), (0x1018, 4), (0x1400, 6), (0x1A00, 5), (0x6099, 3)];
    let unused = (0x06..=0x0B).chain([0x0F, 0x10]).map(|sub| (0x2030, sub));
    let sub_indexes: Vec<_> = beyond.into_iter().chain(unused).collect();
    object_rows::are_missed_by_object_or_by_sub_index::<Zlim42c>(&objects, &sub_indexes);
}

#[test]
fn what_is_live_reads_what_a_resting_drive_has() {
    let expected = [
        (0x1001, 0, 0..=0),
        (0x2000, 0, 1..=1),
        (0x2001, 0, 0..=0),
        (0x2002, 0, 0..=0),
        (0x2003, 0, 0..=0),
        (0x2004, 0, 0..=0),
        (0x2069, 0, 24..=24),
        (0x603F, 0, 0..=0),
        (0x6041, 0, 0x0270..=0x0270),
        (0x6061, 0, 0..=0),
        (0x6064, 0, 0..=0),
        (0x606C, 0, 0..=0),
    ];
    object_rows::read_at_rest::<Zlim42c>(&expected, &[0x1009, 0x100A, 0x2088]);
    let mut bench = Bench::new();
    assert_eq!(bench.get(0x2088), bench.get(0x100A), "the software version in both places");
}

#[test]
fn with_200ch_0_a_write_outlives_a_power_cycle_if_and_only_if_the_object_is_stored() {
    object_rows::outlive_a_power_cycle_if_and_only_if_stored::<Zlim42c>(&MEMORY);
}

#[test]
fn with_200ch_1_nothing_is_kept_until_2010h_is_2_and_2010h_1_restores_it() {
    object_rows::are_kept_and_restored_only_on_command::<Zlim42c>(&MEMORY);
}

#[test]
fn clearing_the_position_reads_zero_again_and_zeroes_the_position() {
    let mut bench = Bench::new();
    bench.enable_in(1).move_by(1000).run_ms(1000).reads(0x6064, 1000);
    bench.set(0x2012, 0);
    assert_eq!(bench.get(0x6064), 1000, "0 is invalid");
    bench.set(0x2012, 1);
    assert_eq!((bench.get(0x6064), bench.get(0x2012)), (0, 0));
    bench.run_ms(100);
    let report = bench.report();
    assert_eq!((report.position, report.rotor_position), (0, Some(0)), "the numbers move, not the shaft");
}
