//! The laws of [`ferrodrive_tests::laws`] under seeded input. The fuzz targets call the same laws.

use ferrodrive_tests::{laws, seeded};

/// A test for each row: what holds, the name of the law, and how many inputs are tried if not as many as usual.
macro_rules! laws_hold {
    ($($sentence:ident: $name:literal $($runs:expr)?;)+) => {$(
        #[test]
        fn $sentence() {
            let law = laws::ALL.iter().find(|law| law.name == $name).expect("a law of that name");
            let runs = [$($runs,)? seeded::RUNS][0];
            seeded::check(runs, law.samples, law.holds);
        }
    )+};
}

/// How many inputs are tried where each is a device, or a file with devices, of its own. The fuzz targets look further.
const DEVICES: u64 = 6_000;

laws_hold! {
    candump_text_is_read_or_refused_and_reads_back_as_printed: "frame_text";
    a_frame_is_never_shorter_than_its_bits_nor_longer_than_with_all_stuff_bits: "frame_length";
    a_candump_line_is_read_or_refused_and_reads_back_as_written: "candump_line";
    an_asc_log_is_read_or_reported_and_is_written_again_as_read: "log_asc";
    a_trc_log_is_read_or_reported_and_is_written_again_as_read: "log_trc";
    a_blf_log_is_read_or_reported_and_is_written_again_as_read: "log_blf";
    a_pcap_log_is_read_or_reported_and_is_written_again_as_read: "log_pcap";
    a_pcapng_log_is_read_or_reported_and_is_written_again_as_read: "log_pcapng";
    a_socketcand_stream_decodes_alike_however_it_is_cut: "socketcand";
    an_slcan_stream_decodes_alike_however_it_is_cut: "slcan";
    sdo_bytes_read_back_as_written: "sdo_wire";
    // Each run is two boots.
    a_program_belongs_to_its_identification_and_is_there_after_a_power_failure_whatever_is_requested: "program_download" 1_500;
    a_block_transfer_under_any_frames_changes_only_what_it_confirms_and_ends: "sdo_blocks" DEVICES;
    to_each_client_of_several_servers_it_is_as_if_it_were_alone: "sdo_channels" DEVICES;
    a_node_under_any_frames_keeps_its_dictionary_lawful: "node" DEVICES;
    a_pdo_carries_the_bits_of_its_objects_or_its_mapping_is_refused: "pdo_mapping";
    lss_requests_get_their_answers_and_read_back_as_written: "lss";
    an_mjoint_under_any_frames_and_sensors_keeps_its_objects_lawful_and_its_duty_cycles_shares: "mjoint" DEVICES;
    modbus_bytes_get_well_formed_responses_or_silence_and_the_next_request_its_answer: "modbus";
    a_zlac8030l_under_any_frames_and_sensors_keeps_its_objects_lawful: "zlac8030l" DEVICES;
    a_zlim42c_under_any_frames_and_sensors_keeps_its_objects_lawful: "zlim42c" DEVICES;
    any_bytes_are_kept_as_they_are_and_what_they_say_can_be_written_and_read_again: "eds";
    a_concise_dcf_is_refused_at_its_place_or_is_written_again_as_read: "concise_dcf";
    any_scenario_is_taken_and_can_be_begun_or_is_refused_at_a_place_that_it_has: "scenario" DEVICES;
    // A run that is whole boots a bus.
    any_bus_yml_is_taken_or_refused_and_what_is_found_says_where_and_what_to_do: "bus_yml" 1_500;
    any_memory_image_boots_to_values_within_their_limits: "eeprom" DEVICES;
    // Each run is a world of three drives that turn.
    any_world_command_is_answered_and_leaves_every_measurement_a_number: "world_command" 1_500;
    any_line_of_a_control_client_is_answered_once_and_every_line_sent_is_an_object: "control" 1_500;
    the_masters_requests_all_end_once_whatever_the_bus_brings: "master_core" DEVICES;
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
