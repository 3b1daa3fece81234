//! The SDO server: every kind of transfer and every abort code that it answers.

use canopen::node::Via;
use canopen::sdo::server::FrameLength;
use canopen::{NodeEvent, NodeProfile};

use crate::node::bench::Bench;
use crate::node::device::{STANDARD, TABLE};

#[track_caller]
fn talk(script: &str) {
    Bench::new(&STANDARD).talk(script);
}

#[test]
fn expedited_upload_answers_with_the_length_of_the_object() {
    talk(
        "> 604#4000100000000000
         < 584#4300100092010400
         > 604#4017100000000000
         < 584#4B17100000000000
         > 604#4001100000000000
         < 584#4F01100000000000",
    );
}

#[test]
fn upload_requests_are_known_by_their_top_three_bits() {
    talk(
        "> 604#4300100000000000
         < 584#4300100092010400
         > 604#4B00100000000000
         < 584#4300100092010400
         > 604#5F00100000000000
         < 584#4300100092010400",
    );
}

#[test]
fn expedited_download_stores_reports_to_the_owner_and_confirms() {
    let mut bench = Bench::new(&STANDARD);
    bench.talk(
        "> 604#23FF60009CFFFFFF
         < 584#60FF600000000000
         > 604#40FF600000000000
         < 584#43FF60009CFFFFFF",
    );
    let written = NodeEvent::Written { slot: bench.slot(0x60FF), raw: -100_i32 as u32, via: Via::Sdo };
    assert_eq!(bench.events(), [written]);
}

#[test]
fn a_download_without_size_takes_the_width_of_the_object() {
    let mut bench = Bench::new(&STANDARD);
    bench.talk("> 604#22406000341278FF\n < 584#6040600000000000");
    assert_eq!(bench.value(0x6040), 0x1234);
}

#[test]
fn bytes_beyond_the_declared_length_are_ignored() {
    let mut bench = Bench::new(&STANDARD);
    bench.talk("> 604#2B40600018FCFFFF\n < 584#6040600000000000");
    assert_eq!(bench.value(0x6040), 0xFC18);
}

#[test]
fn a_text_is_uploaded_in_segments() {
    // "a drive of the tests": 20 bytes = 14h.
    talk(
        "> 604#4008100000000000
         < 584#4108100014000000
         > 604#6000000000000000
         < 584#0061206472697665
         > 604#7000000000000000
         < 584#10206F6620746865
         > 604#6000000000000000
         < 584#0320746573747300",
    );
}

#[test]
fn a_short_text_is_uploaded_expedited() {
    talk("> 604#4009100000000000\n < 584#47091000312E3000");
}

#[test]
fn an_empty_text_is_uploaded_as_one_empty_segment() {
    talk(
        "> 604#400A100000000000
         < 584#410A100000000000
         > 604#6000000000000000
         < 584#0F00000000000000",
    );
}

#[test]
fn two_bytes_may_be_downloaded_in_a_segment() {
    let mut bench = Bench::new(&STANDARD);
    bench.talk(
        "> 604#2117100002000000
         < 584#6017100000000000
         > 604#0BF4010000000000
         < 584#2000000000000000
         < 704#7F",
    );
    assert_eq!(bench.value(0x1017), 500);
}

#[test]
fn a_segmented_download_may_come_byte_by_byte_and_without_a_size() {
    let mut bench = Bench::new(&STANDARD);
    bench.talk(
        "> 604#207A600000000000
         < 584#607A600000000000
         > 604#0C78000000000000
         < 584#2000000000000000
         > 604#1C56000000000000
         < 584#3000000000000000
         > 604#0C34000000000000
         < 584#2000000000000000
         > 604#1D12000000000000
         < 584#3000000000000000",
    );
    assert_eq!(bench.value(0x607A), 0x1234_5678);
    assert_eq!(bench.events().len(), 1);
}

#[test]
fn wrong_toggle_bits_abort_with_0503_0000() {
    talk(
        "> 604#4008100000000000
         < 584#4108100014000000
         > 604#7000000000000000
         < 584#8008100000000305
         > 604#2117100002000000
         < 584#6017100000000000
         > 604#1BF4010000000000
         < 584#8017100000000305",
    );
}

#[test]
fn unknown_command_specifiers_abort_with_0504_0001() {
    // Undefined, block upload, block download; the last two of a device that has neither.
    talk(
        "> 604#E000100000000000
         < 584#8000100001000405",
    );
    Bench::new(&WITHOUT_BLOCKS).talk(
        "> 604#E000100000000000
         < 584#8000100001000405
         > 604#A408100000000000
         < 584#8008100001000405
         > 604#C617100002000000
         < 584#8017100001000405",
    );
}

#[test]
fn segments_without_a_transfer_abort_with_0504_0001() {
    talk(
        "> 604#6000000000000000
         < 584#8000000001000405
         > 604#0BF4010000000000
         < 584#8000000001000405",
    );
}

#[test]
fn a_segment_of_the_other_direction_aborts_the_transfer() {
    talk(
        "> 604#4008100000000000
         < 584#4108100014000000
         > 604#0BF4010000000000
         < 584#8008100001000405
         > 604#6000000000000000
         < 584#8000000001000405",
    );
}

#[test]
fn access_violations_abort_with_0601_0001_and_0601_0002() {
    talk(
        "> 604#4000200000000000
         < 584#8000200001000106
         > 604#2300100001000000
         < 584#8000100002000106
         > 604#2B41600001000000
         < 584#8041600002000106
         > 604#2108100014000000
         < 584#8008100002000106",
    );
}

#[test]
fn missing_objects_abort_with_0602_0000() {
    talk(
        "> 604#4004100000000000
         < 584#8004100000000206
         > 604#2316100100000000
         < 584#8016100100000206
         > 604#40FFFFFF00000000
         < 584#80FFFFFF00000206
         > 604#4000000000000000
         < 584#8000000000000206",
    );
}

#[test]
fn missing_sub_indices_abort_with_0609_0011() {
    talk(
        "> 604#4000100100000000
         < 584#8000100111000906
         > 604#4018100500000000
         < 584#8018100511000906
         > 604#401810FF00000000
         < 584#801810FF11000906
         > 604#4005200000000000
         < 584#8005200011000906",
    );
}

#[test]
fn too_many_bytes_abort_with_0607_0012() {
    talk(
        "> 604#2317100001000000
         < 584#8017100012000706
         > 604#2117100003000000
         < 584#8017100012000706
         > 604#2017100000000000
         < 584#6017100000000000
         > 604#09F4010000000000
         < 584#8017100012000706",
    );
}

#[test]
fn too_few_bytes_abort_with_0607_0013() {
    talk(
        "> 604#2F17100001000000
         < 584#8017100013000706
         > 604#2117100001000000
         < 584#8017100013000706
         > 604#2017100000000000
         < 584#6017100000000000
         > 604#0DF4000000000000
         < 584#8017100013000706",
    );
}

#[test]
fn fewer_bytes_than_declared_abort_with_0607_0010() {
    talk(
        "> 604#2117100002000000
         < 584#6017100000000000
         > 604#0DF4000000000000
         < 584#8017100010000706",
    );
}

#[test]
fn values_outside_their_limits_abort_with_0609_003x_and_store_nothing() {
    let mut bench = Bench::new(&STANDARD);
    bench.talk(
        "> 604#23FF6000E9030000
         < 584#80FF600031000906
         > 604#23FF600017FCFFFF
         < 584#80FF600032000906
         > 604#2F60600006000000
         < 584#8060600030000906
         > 604#2381600000000000
         < 584#8081600032000906",
    );
    assert_eq!((bench.value(0x60FF), bench.value(0x6060), bench.value(0x6081)), (0, 0, 120));
    assert_eq!(bench.events(), []);
}

#[test]
fn the_check_of_a_row_refuses_with_its_own_code() {
    talk(
        "> 604#2F03200001000000
         < 584#6003200000000000
         > 604#2F01200001000000
         < 584#6001200000000000
         > 604#2F03200002000000
         < 584#8003200022000008",
    );
}

#[test]
fn a_client_abort_ends_the_transfer_without_an_answer() {
    talk(
        "> 604#4008100000000000
         < 584#4108100014000000
         > 604#8008100000000408
         > 604#6000000000000000
         < 584#8000000001000405",
    );
}

#[test]
fn a_new_request_replaces_an_unfinished_transfer() {
    talk(
        "> 604#4008100000000000
         < 584#4108100014000000
         > 604#4000100000000000
         < 584#4300100092010400
         > 604#6000000000000000
         < 584#8000000001000405",
    );
}

#[test]
fn a_silent_client_is_aborted_with_0504_0000_after_a_second() {
    talk(
        "> 604#4008100000000000
         < 584#4108100014000000
         wait 900ms
         > 604#6000000000000000
         < 584#0061206472697665
         1900ms < 584#8008100000000405
         silence 5000ms",
    );
}

#[test]
fn a_confirmed_transfer_leaves_no_timeout_behind() {
    talk(
        "> 604#4009100000000000
         < 584#47091000312E3000
         silence 5000ms",
    );
}

#[test]
fn frames_of_another_length_are_ignored_by_the_standard() {
    talk(
        "> 604#
         > 604#40001000
         > 604#40001000000000
         > 604#R8
         silence 10ms",
    );
}

static WITHOUT_BLOCKS: NodeProfile = NodeProfile { sdo_block_size: 0, ..NodeProfile::cia_301(&TABLE) };
static SHORT_FRAMES: NodeProfile = NodeProfile { sdo_frame_length: FrameLength::Used, ..NodeProfile::cia_301(&TABLE) };

#[test]
fn a_profile_may_hear_frames_that_are_as_long_as_they_need_be() {
    let mut bench = Bench::new(&SHORT_FRAMES);
    bench.talk(
        "> 604#40001000
         < 584#4300100092010400
         > 604#400010
         > 604#
         > 604#2B4060000F00
         < 584#6040600000000000
         > 604#2B4060000F
         silence 10ms",
    );
    assert_eq!(bench.value(0x6040), 0xF);
}

#[test]
fn a_request_is_not_answered_while_stopped_and_the_transfer_is_gone_afterwards() {
    talk(
        "> 604#4008100000000000
         < 584#4108100014000000
         > 000#0204
         > 604#4000100000000000
         > 000#8004
         > 604#6000000000000000
         < 584#8000000001000405",
    );
}
