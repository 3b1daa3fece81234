//! SDO (CiA 301, 7.2.4): the protocol on the running drive. Which objects there are and what they take is asked row by row
//! in [`object_rows`](crate::object_rows).

use crate::bench::{Bench, BenchSubject, assert_within, head};
use crate::power_states::PowerSubject;

/// Abort code 0504 0001h: command specifier not valid or unknown.
const UNKNOWN_COMMAND: [u8; 4] = [0x01, 0x00, 0x04, 0x05];

/// Frames cut short, an unknown command, a remote frame: nothing of them is used.
pub fn malformed_requests_are_survived_and_change_nothing<S: PowerSubject>() {
    let mut bench = Bench::<S>::new();
    for request in ["60n#", "60n#40", "60n#2F6060", "60n#2B4060000F", "60n#FFFFFFFFFFFFFFFF", "60n#E041600000000000"] {
        bench.send(request).run_ms(5);
    }
    bench.send("60n#R8").run_ms(5).reads(0x6060, 0).reads(0x6040, 0).shows(0xFFFF, S::BOOTED);
}

/// No manual has block transfers, and CiA 301 leaves them open.
pub fn a_block_transfer_is_refused_and_an_abort_in_its_place_is_ignored<S: BenchSubject>() {
    let mut bench = Bench::<S>::new();
    let device_type = bench.get(0x1000);
    let mut refused = head(0x80, 0x1000, 0);
    refused[4..].copy_from_slice(&UNKNOWN_COMMAND);
    bench.answers([0xA0, 0x00, 0x10, 0x00, 0x10, 0, 0, 0], refused);
    assert_eq!(bench.sdo(&[0x80, 0x00, 0x10, 0x00, 0x00, 0x00, 0x04, 0x05]), None, "a client's abort");
    bench.answers([0xC2, 0x00, 0x10, 0x00, 4, 0, 0, 0], refused).reads(0x1000, device_type);
}

/// Two frames of 0.25 ms at 500 kbit/s are on the wire for it.
pub fn an_answer_comes_within_about_a_millisecond<S: BenchSubject>() {
    let mut bench = Bench::<S>::new();
    let before = bench.world.now();
    bench.sdo(&head(0x40, 0x6041, 0));
    let taken = bench.world.now().nanos_since(before);
    assert_within("ms, the wire included", taken as f64 * 1e-6, 0.4, 1.7);
}

/// 7.2.4.3.3 and on: 1000 as two steps, a byte too many, a byte too few, the wrong toggle bit. 6083h is four bytes long in each drive.
pub fn a_segmented_download_carries_a_small_object_too<S: BenchSubject>() {
    let mut bench = Bench::<S>::new();
    let begin = [0x21, 0x83, 0x60, 0, 4, 0, 0, 0];
    bench.answers(begin, head(0x60, 0x6083, 0)).answers([0x07, 0xE8, 0x03, 0, 0, 0, 0, 0], [0x20, 0, 0, 0, 0, 0, 0, 0]);
    bench.reads(0x6083, 1000);
    bench.sdo(&[0x21, 0x83, 0x60, 0, 5, 0, 0, 0]);
    bench.sdo(&[0x05, 1, 2, 3, 4, 5, 0, 0]);
    bench.reads(0x6083, 1000).answers(begin, head(0x60, 0x6083, 0));
    let answer = bench.sdo(&[0x09, 0xD0, 0x07, 0, 0, 0, 0, 0]).expect("an abort");
    assert_eq!((answer[0], &answer[4..]), (0x80, &[0x10, 0x00, 0x07, 0x06][..]), "three of four bytes");
    bench.reads(0x6083, 1000).answers(begin, head(0x60, 0x6083, 0));
    let answer = bench.sdo(&[0x17, 0xD0, 0x07, 0, 0, 0, 0, 0]).expect("an abort");
    assert_eq!((answer[0], &answer[4..]), (0x80, &[0x00, 0x00, 0x03, 0x05][..]), "the toggle bit does not alternate");
    bench.reads(0x6083, 1000);
}

/// Bit 0 of the command is 0: no size is indicated.
pub fn an_expedited_download_without_a_size_takes_what_the_object_needs<S: BenchSubject>() {
    let mut bench = Bench::<S>::new();
    bench.answers([0x22, 0x83, 0x60, 0, 0xE8, 3, 0, 0], head(0x60, 0x6083, 0)).reads(0x6083, 1000);
}

/// Clients of these drives send 43h and 4Bh for 40h and rely on the answers. 27h: three bytes, which no object here has.
pub fn an_upload_ignores_its_low_five_bits_and_three_bytes_are_too_few<S: BenchSubject>() {
    let mut bench = Bench::<S>::new();
    let device_type = bench.sdo(&head(0x40, 0x1000, 0)).expect("an answer");
    assert_eq!(device_type[0], 0x43);
    for command in [0x43, 0x4B, 0x4F, 0x47] {
        bench.answers(head(command, 0x1000, 0), device_type);
    }
    let answer = bench.sdo(&[0x27, 0x83, 0x60, 0, 1, 0, 0, 0]).expect("an answer");
    assert_eq!((answer[0], &answer[4..]), (0x80, &[0x13, 0x00, 0x07, 0x06][..]));
}

/// An answer repeats the multiplexor of its request; the next request is sent without waiting for it here.
pub fn requests_sent_without_waiting_for_answers_are_all_answered_in_order<S: BenchSubject>() {
    let mut bench = Bench::<S>::new();
    let requests = ["60n#4000100000000000", "60n#4041600000000000", "60n#4064600000000000", "60n#4060600000000000"];
    let answers: Vec<String> =
        requests.iter().map(|request| bench.forget().send(request).heard_of("58n#")[0].clone()).collect();
    for ((answer, request), command) in answers.iter().zip(requests).zip(["43", "4B", "43", "4F"]) {
        assert_eq!(&answer[4..12], format!("{command}{}", &request[6..12]), "{request}");
    }
    bench.run_ms(20).forget();
    for _ in 0..20 {
        requests.iter().for_each(|request| _ = bench.offer(request));
        bench.run_ms(10);
        assert_eq!(bench.heard_of("58n#"), answers);
    }
}
