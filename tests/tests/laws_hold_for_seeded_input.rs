//! The laws of [`ferrodrive_tests::laws`] under seeded input. The fuzz targets call the same laws.

use ferrodrive_tests::{laws, seeded};

fn check(name: &str) {
    let law = law(name);
    seeded::check(law.samples, law.holds);
}

fn law(name: &str) -> &'static laws::Law {
    laws::ALL.iter().find(|law| law.name == name).expect("a law of that name")
}

#[test]
fn candump_text_is_read_or_refused_and_reads_back_as_printed() {
    check("frame_text");
}

#[test]
fn a_frame_is_never_shorter_than_its_bits_nor_longer_than_with_all_stuff_bits() {
    check("frame_length");
}

#[test]
fn a_candump_line_is_read_or_refused_and_reads_back_as_written() {
    check("candump_line");
}

#[test]
fn a_socketcand_stream_decodes_alike_however_it_is_cut() {
    check("socketcand");
}

#[test]
fn an_slcan_stream_decodes_alike_however_it_is_cut() {
    check("slcan");
}

#[test]
fn sdo_bytes_read_back_as_written() {
    check("sdo_wire");
}

#[test]
fn a_node_under_any_frames_keeps_its_dictionary_lawful() {
    check("node");
}

#[test]
fn a_joint_under_any_frames_and_sensors_keeps_its_objects_lawful_and_its_duty_cycles_shares() {
    check("mjoint");
}

#[test]
fn modbus_bytes_get_well_formed_responses_or_silence_and_the_next_request_its_answer() {
    check("modbus");
}

#[test]
fn a_zlac8030l_under_any_frames_and_sensors_keeps_its_objects_lawful() {
    check("zlac8030l");
}

#[test]
fn a_zlim42c_under_any_frames_and_sensors_keeps_its_objects_lawful() {
    check("zlim42c");
}

#[test]
fn any_bytes_are_kept_as_they_are_and_what_they_say_can_be_written_and_read_again() {
    check("eds");
}

#[test]
fn any_memory_image_boots_to_values_within_their_limits() {
    check("eeprom");
}

#[test]
fn any_world_command_is_answered_and_leaves_every_measurement_a_number() {
    // Each run is a world of three drives that turn.
    let law = law("world_command");
    seeded::check_some(1_500, law.samples, law.holds);
}

#[test]
fn the_masters_requests_all_end_once_whatever_the_bus_brings() {
    check("master_core");
}

#[test]
fn every_law_has_a_fuzz_target_and_every_fuzz_target_a_law() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../fuzz/fuzz_targets");
    let files = std::fs::read_dir(folder).expect("the folder of fuzz targets");
    let mut targets: Vec<String> = files
        .map(|file| file.expect("a readable folder").path().file_stem().expect("a name").to_string_lossy().into_owned())
        .collect();
    let mut laws: Vec<&str> = laws::ALL.iter().map(|law| law.name).collect();
    targets.sort();
    laws.sort_unstable();
    assert_eq!(targets, laws);
}
