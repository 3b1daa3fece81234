//! EMCY messages of a node.

use can::Station;
use canopen::{EmcyErrorCode, NodeProfile};

use crate::node::bench::Bench;
use crate::node::device::{STANDARD, TABLE};

impl Bench {
    fn raise(&mut self, code: u16, error_register: u8) {
        self.node.raise_emcy(EmcyErrorCode(code), error_register, [1, 2, 3, 4, 5], self.now);
        self.wait(std::time::Duration::ZERO);
    }
}

#[test]
fn a_message_has_code_error_register_and_five_bytes_of_the_manufacturer() {
    let mut bench = Bench::new(&STANDARD);
    bench.raise(0x3210, 0x05);
    bench.talk("< 084#1032050102030405\n > 604#4001100000000000\n < 584#4F01100005000000");
}

#[test]
fn the_inhibit_time_spaces_messages_and_keeps_their_order() {
    let mut bench = Bench::new(&STANDARD);
    // 10 ms in units of 100 us.
    bench.talk("> 604#2B15100064000000\n < 584#6015100000000000");
    bench.raise(0x3210, 5);
    bench.raise(0x2310, 7);
    bench.raise(0x0000, 0);
    bench.talk(
        "0ms < 084#1032050102030405
         10ms < 084#1023070102030405
         20ms < 084#0000000102030405
         silence 100ms",
    );
}

#[test]
fn the_identifier_is_that_of_1014h_and_bit_31_silences_it() {
    let mut bench = Bench::new(&STANDARD);
    bench.talk("> 604#2314100084000080\n < 584#6014100000000000");
    bench.raise(0x3210, 5);
    bench.talk("silence 10ms\n > 604#23141000A0000000\n < 584#6014100000000000");
    bench.raise(0x3210, 5);
    bench.talk("< 0A0#1032050102030405");
}

#[test]
fn no_message_while_stopped_but_afterwards() {
    let mut bench = Bench::new(&STANDARD);
    bench.talk("> 000#0204");
    bench.raise(0x3210, 5);
    bench.talk("silence 100ms\n > 000#8004\n < 084#1032050102030405");
}

#[test]
fn a_message_that_was_ready_is_held_back_by_stop_and_by_the_one_before_it() {
    let mut bench = Bench::new(&STANDARD);
    bench.talk("> 604#2B15100064000000\n < 584#6015100000000000");
    let (node, now) = (&mut bench.node, bench.now);
    node.raise_emcy(EmcyErrorCode(0x3210), 5, [0; 5], now);
    node.raise_emcy(EmcyErrorCode(0x2310), 7, [0; 5], now);
    node.handle_frame(&"000#0204".parse().unwrap(), now);
    assert_eq!(node.poll_transmit(), None);
    node.handle_frame(&"000#8004".parse().unwrap(), now);
    assert_eq!(node.poll_transmit(), Some("084#1032050000000000".parse().unwrap()));
    // The wire has not taken it yet.
    assert_eq!(node.poll_transmit(), None);
    assert_eq!(node.poll_timeout(), Some(can::Instant::from_millis(10)));
}

static WITHOUT_EMCY: NodeProfile = NodeProfile { emcy: false, ..NodeProfile::cia_301(&TABLE) };

#[test]
fn a_device_without_emcy_sets_the_error_register_only() {
    let mut bench = Bench::new(&WITHOUT_EMCY);
    bench.raise(0x3210, 5);
    bench.talk("silence 100ms");
    assert_eq!(bench.value(0x1001), 5);
}

#[test]
fn only_code_0_is_shown_as_the_end_of_an_error() {
    assert_eq!(EmcyErrorCode::NO_ERROR.to_string(), "0000h (error reset)");
    assert_eq!(EmcyErrorCode(0x0001).to_string(), "0001h (a code of the maker's)");
    assert_eq!(EmcyErrorCode(0x0080).class(), EmcyErrorCode::NO_ERROR.class());
}
