//! When TPDOs are sent: every transmission type, inhibit time and event timer, in virtual time.
//!
//! TPDO 1 maps the statusword 6041h.

use can::{Frame, Instant, Station};
use canopen::pdo::EventTrigger;
use canopen::{NmtState, NodeProfile};

use crate::node::bench::Bench;
use crate::node::device::{LOOSE, STANDARD, TABLE};

/// In pre-operational, with type, inhibit time and event timer of TPDO 1 written.
fn configured(profile: &'static NodeProfile, transmission_type: u8, inhibit_time: u16, event_timer: u16) -> Bench {
    let mut bench = Bench::new(profile);
    let [[t, _], [i, j], [e, f]] = [u16::from(transmission_type), inhibit_time, event_timer].map(u16::to_le_bytes);
    bench.talk(&format!(
        "> 604#2300180184010080
         < 584#6000180100000000
         > 604#2F001802{t:02X}000000
         < 584#6000180200000000
         > 604#2B001803{i:02X}{j:02X}0000
         < 584#6000180300000000
         > 604#2B001805{e:02X}{f:02X}0000
         < 584#6000180500000000
         > 604#2300180184010000
         < 584#6000180100000000",
    ));
    bench
}

#[test]
fn an_event_driven_tpdo_is_sent_once_on_entering_operational() {
    for transmission_type in [254, 255] {
        for profile in [&STANDARD, &LOOSE] {
            let mut bench = configured(profile, transmission_type, 0, 0);
            bench
                .talk("> 000#0104\n < 184#0000\n silence 1000ms\n > 000#8004\n silence 10ms\n > 000#0100\n < 184#0000");
        }
    }
}

#[test]
fn an_event_driven_tpdo_is_sent_on_change_only() {
    for transmission_type in [254, 255] {
        let mut bench = configured(&STANDARD, transmission_type, 0, 0);
        bench.talk("> 000#0104\n < 184#0000");
        bench.set(0x6041, 0x0237);
        bench.talk("< 184#3702");
        bench.set(0x6041, 0x0237);
        bench.set(0x6064, 5);
        bench.talk("silence 100ms\n > 080#\n silence 1ms");
    }
}

#[test]
fn the_inhibit_time_holds_changes_back_and_the_newest_value_is_sent() {
    // 10 ms in units of 100 us.
    let mut bench = configured(&STANDARD, 254, 100, 0);
    bench.talk("> 000#0104\n < 184#0000\n wait 2ms");
    bench.set(0x6041, 1);
    bench.talk("wait 3ms");
    bench.set(0x6041, 2);
    bench.talk("10ms < 184#0200\n silence 20ms");
    bench.set(0x6041, 3);
    bench.talk("30ms < 184#0300");
}

#[test]
fn the_inhibit_time_counts_in_the_devices_unit() {
    // 1000 counts of 0.5 ms (ZLAC8030L quick start guide V1.00, 6.1).
    let mut bench = configured(&LOOSE, 254, 1000, 0);
    bench.talk("> 000#0104\n < 184#0000");
    bench.set(0x6041, 1);
    bench.talk("500ms < 184#0100");
}

#[test]
fn the_inhibit_time_counts_from_when_the_wire_took_the_frame() {
    let mut bench = configured(&STANDARD, 254, 100, 0);
    let node = &mut bench.node;
    let at = Instant::from_millis;
    node.handle_frame(&"000#0104".parse().unwrap(), at(0));
    let first = node.poll_transmit().unwrap();
    // The bus is busy for 7 ms.
    node.handle_transmitted(&first, at(7));
    let statusword = TABLE.object::<u16>(0x6041, 0);
    node.dictionary_mut().set(statusword, 1);
    node.notice_changes(at(8));
    assert_eq!((node.poll_transmit(), node.poll_timeout()), (None, Some(at(17))));
    node.handle_timeout(at(10));
    assert_eq!((node.poll_transmit(), node.poll_timeout()), (None, Some(at(17))));
    node.handle_timeout(at(17));
    assert_eq!(node.poll_transmit(), Some("184#0100".parse().unwrap()));
    assert_eq!(node.poll_transmit(), None);
}

#[test]
fn a_report_that_comes_late_holds_back_what_was_ready() {
    let mut bench = configured(&STANDARD, 254, 100, 0);
    let node = &mut bench.node;
    let at = Instant::from_millis;
    node.handle_frame(&"000#0104".parse().unwrap(), at(0));
    let first = node.poll_transmit().unwrap();
    node.dictionary_mut().set(TABLE.object::<u16>(0x6041, 0), 1);
    node.notice_changes(at(5));
    node.handle_timeout(at(10));
    node.handle_transmitted(&first, at(12));
    assert_eq!((node.poll_transmit(), node.poll_timeout()), (None, Some(at(22))));
}

#[test]
fn an_unsent_tpdo_is_overwritten_and_never_queued_twice() {
    let mut bench = configured(&STANDARD, 254, 0, 0);
    let node = &mut bench.node;
    node.handle_frame(&"000#0104".parse().unwrap(), Instant::ZERO);
    for value in 1..=5 {
        node.dictionary_mut().set(TABLE.object::<u16>(0x6041, 0), value);
        node.notice_changes(Instant::ZERO);
    }
    assert_eq!(node.poll_transmit(), Some("184#0500".parse().unwrap()));
    assert_eq!(node.poll_transmit(), None);
}

#[test]
fn a_ready_frame_that_is_not_pulled_makes_no_deadline_in_the_past() {
    let mut bench = configured(&STANDARD, 254, 100, 0);
    let node = &mut bench.node;
    node.handle_frame(&"000#0104".parse().unwrap(), Instant::ZERO);
    node.handle_timeout(Instant::from_millis(50));
    assert_eq!(node.poll_timeout(), None);
}

#[test]
fn the_event_timer_sends_unchanged_data_at_its_period() {
    for transmission_type in [254, 255] {
        let mut bench = configured(&STANDARD, transmission_type, 0, 20);
        bench.talk(
            "> 000#0104
             < 184#0000
             20ms < 184#0000
             40ms < 184#0000
             > 000#8004
             silence 100ms",
        );
    }
}

#[test]
fn the_event_timer_counts_from_the_last_change_that_was_sent() {
    let mut bench = configured(&STANDARD, 254, 0, 20);
    bench.talk("> 000#0104\n < 184#0000\n wait 15ms");
    bench.set(0x6041, 1);
    bench.talk("< 184#0100\n 35ms < 184#0100\n 55ms < 184#0100");
}

#[test]
fn the_event_timer_does_not_beat_the_inhibit_time() {
    // Inhibit 30 ms, event timer 20 ms.
    let mut bench = configured(&STANDARD, 254, 300, 20);
    bench.talk("> 000#0104\n < 184#0000\n 30ms < 184#0000\n 60ms < 184#0000");
}

#[test]
fn a_late_runner_does_not_shift_the_event_timer() {
    let mut bench = configured(&STANDARD, 254, 0, 20);
    bench.talk("> 000#0104\n < 184#0000");
    let node = &mut bench.node;
    node.handle_timeout(Instant::from_millis(47));
    assert_eq!(node.poll_transmit(), Some("184#0000".parse().unwrap()));
    assert_eq!(node.poll_transmit(), None);
    bench.now = Instant::from_millis(47);
    bench.talk("60ms < 184#0000\n 80ms < 184#0000");
}

#[test]
fn the_inhibit_time_is_not_for_synchronous_tpdos() {
    let mut bench = configured(&STANDARD, 1, 1000, 0);
    bench.talk("> 000#0104\n > 080#\n < 184#0000\n wait 1ms\n > 080#\n < 184#0000");
}

#[test]
fn type_255_with_an_event_timer_is_sent_by_it_alone_where_the_manual_says_so() {
    // 100 counts of 0.5 ms.
    let mut bench = configured(&LOOSE, 255, 0, 100);
    bench.talk("> 000#0104\n < 184#0000\n wait 10ms");
    bench.set(0x6041, 7);
    bench.talk("50ms < 184#0700\n 100ms < 184#0700");
    // 254 is sent on change as well.
    let mut bench = configured(&LOOSE, 254, 0, 100);
    bench.talk("> 000#0104\n < 184#0000\n wait 10ms");
    bench.set(0x6041, 7);
    bench.talk("< 184#0700\n 60ms < 184#0700");
}

#[test]
fn a_synchronous_acyclic_tpdo_is_sent_at_the_sync_after_a_change() {
    let mut bench = configured(&STANDARD, 0, 0, 0);
    bench.talk("> 000#0104\n silence 10ms\n > 080#\n < 184#0000\n > 080#\n silence 1ms");
    bench.set(0x6041, 0x33);
    bench.talk("silence 10ms\n > 080#\n < 184#3300\n > 080#\n silence 1ms");
}

#[test]
fn a_synchronous_cyclic_tpdo_is_sent_at_every_nth_sync() {
    for period in [1, 2, 3, 240] {
        let mut bench = configured(&STANDARD, period, 0, 0);
        bench.talk("> 000#0104\n silence 10ms");
        for sync in 1..=480_u32 {
            bench.send("080#");
            let sent = bench.sent.drain(..).count();
            assert_eq!(sent, usize::from(sync % u32::from(period) == 0), "SYNC {sync}, type {period}");
        }
    }
}

#[test]
fn a_sync_counter_in_the_frame_is_tolerated() {
    let mut bench = configured(&STANDARD, 1, 0, 0);
    bench.talk("> 000#0104\n > 080#07\n < 184#0000\n > 080#F0\n < 184#0000");
}

#[test]
fn synchronous_data_is_of_the_moment_of_sync() {
    let mut bench = configured(&STANDARD, 1, 0, 0);
    let node = &mut bench.node;
    node.handle_frame(&"000#0104".parse().unwrap(), Instant::ZERO);
    node.dictionary_mut().set(TABLE.object::<u16>(0x6041, 0), 1);
    node.handle_frame(&"080#".parse().unwrap(), Instant::ZERO);
    node.dictionary_mut().set(TABLE.object::<u16>(0x6041, 0), 2);
    assert_eq!(node.poll_transmit(), Some("184#0100".parse().unwrap()));
}

#[test]
fn syncs_are_counted_from_entering_operational() {
    let mut bench = configured(&STANDARD, 3, 0, 0);
    bench.talk(
        "> 080#
         > 080#
         > 000#0104
         > 080#
         > 080#
         > 000#8004
         > 000#0104
         > 080#
         > 080#
         > 080#
         < 184#0000",
    );
}

#[test]
fn the_sync_identifier_is_that_of_1005h() {
    let mut bench = configured(&STANDARD, 1, 0, 0);
    bench.talk(
        "> 604#2305100081000000
         < 584#6005100000000000
         > 000#0104
         > 080#
         silence 1ms
         > 081#
         < 184#0000",
    );
}

#[test]
fn no_tpdo_outside_operational() {
    let mut bench = configured(&STANDARD, 254, 0, 10);
    bench.set(0x6041, 1);
    bench.talk("silence 100ms\n > 080#\n > 000#0204\n silence 100ms");
}

#[test]
fn a_remote_frame_gets_the_tpdo_as_it_is_while_operational() {
    let mut bench = Bench::operational();
    bench.talk("> 184#R2\n < 184#0000\n > 184#R0\n < 184#0000\n > 284#R2\n silence 10ms");
    let slot = bench.slot(0x6041);
    bench.node.dictionary_mut().set_raw(slot, 0x1234);
    bench.talk("> 184#R8\n < 184#3412\n > 000#0204\n > 184#R2\n > 000#8004\n > 184#R2\n silence 10ms");
}

#[test]
fn bit_30_of_the_cob_id_says_that_no_remote_frame_is_answered() {
    let mut bench = Bench::operational();
    bench.talk("> 604#2300180184010040\n < 584#6000180100000000\n > 184#R2\n silence 10ms");
    bench.talk("> 604#2300180184010000\n < 584#6000180100000000\n > 184#R2\n < 184#0000");
    let mut bench = configured(&LOOSE, 254, 0, 0);
    bench.talk("> 000#0104\n < 184#0000\n > 184#R2\n silence 10ms");
}

/// CiA 301, table 77: 252 is sampled at SYNC and sent on request, 253 is sampled and sent on request.
#[test]
fn types_252_and_253_are_sent_on_request_only() {
    let mut bench = configured(&STANDARD, 252, 0, 10);
    bench.talk("> 000#0104\n silence 100ms\n > 184#R2\n silence 1ms");
    bench.set(0x6041, 1);
    bench.talk("> 080#\n silence 1ms");
    bench.set(0x6041, 2);
    bench.talk("> 184#R2\n < 184#0100\n > 184#R2\n < 184#0100\n > 080#\n > 184#R2\n < 184#0200");

    let mut bench = configured(&STANDARD, 253, 0, 10);
    bench.talk("> 000#0104\n silence 100ms\n > 080#\n silence 1ms");
    bench.set(0x6041, 3);
    bench.talk("silence 1ms\n > 184#R2\n < 184#0300");
}

#[test]
fn a_request_for_a_synchronous_tpdo_gets_the_data_of_the_last_sync() {
    let mut bench = configured(&STANDARD, 1, 0, 0);
    bench.talk("> 000#0104\n > 184#R2\n < 184#0000\n > 080#\n < 184#0000");
    bench.set(0x6041, 7);
    bench.talk("> 184#R2\n < 184#0000\n > 080#\n < 184#0700\n > 184#R2\n < 184#0700");
}

#[test]
fn the_inhibit_time_holds_back_what_a_remote_frame_asks_for() {
    // 100 times 100 us.
    let mut bench = configured(&STANDARD, 254, 100, 0);
    bench.talk("> 000#0104\n < 184#0000\n > 184#R2\n > 184#R2\n 10ms < 184#0000\n silence 20ms");
}

#[test]
fn an_invalid_tpdo_is_silent_and_is_sent_once_when_it_becomes_valid() {
    let mut bench = Bench::operational();
    bench.talk("> 604#2300180184010080\n < 584#6000180100000000");
    bench.set(0x6041, 9);
    bench.talk("silence 10ms\n > 604#2300180185010000\n < 185#0900\n < 584#6000180100000000");
}

#[test]
fn what_an_invalidated_tpdo_still_had_to_send_is_dropped() {
    let mut bench = configured(&LOOSE, 254, 20, 0);
    bench.talk("> 000#0104\n < 184#0000");
    bench.set(0x6041, 1);
    bench.talk(
        "> 604#2300180184010080
         < 584#6000180100000000
         silence 100ms
         > 604#4000100000000000
         < 584#4300100092010400",
    );
}

#[test]
fn what_a_changed_tpdo_still_has_to_send_is_sent() {
    let mut bench = configured(&LOOSE, 254, 20, 0);
    bench.talk("> 000#0104\n < 184#0000\n wait 1ms");
    bench.set(0x6041, 1);
    bench.talk("> 604#2F001802FF000000\n < 584#6000180200000000\n 10ms < 184#0100\n silence 100ms");
}

#[test]
fn changing_a_timer_of_an_active_tpdo_sends_nothing() {
    let mut bench = Bench::operational();
    bench.talk(
        "> 604#2B00180564000000
         < 584#6000180500000000
         silence 99ms
         100ms < 184#0000",
    );
}

static ANSWERING: NodeProfile = NodeProfile {
    start_state: NmtState::Operational,
    event_trigger: EventTrigger::AnswersRpdo,
    ..NodeProfile::cia_301(&TABLE)
};

#[test]
fn a_tpdo_may_answer_the_rpdo_of_its_number_and_nothing_else() {
    // M joint motor CANopen manual, 5.08.3.
    let mut bench = Bench::new(&ANSWERING);
    bench.set(0x6041, 0x37);
    bench.talk(
        "silence 100ms
         > 080#
         silence 1ms
         > 204#0F00
         < 184#3700
         > 204#0F00
         < 184#3700
         > 304#00000000
         silence 1ms
         > 204#0F
         silence 1ms",
    );
}

#[test]
fn frames_leave_in_the_order_of_their_identifiers() {
    let mut bench = configured(&STANDARD, 254, 0, 0);
    let node = &mut bench.node;
    let now = Instant::ZERO;
    node.handle_frame(&"604#2B171000E8030000".parse().unwrap(), now);
    node.handle_frame(&"000#0104".parse().unwrap(), now);
    node.raise_emcy(canopen::EmcyErrorCode::GENERIC, 1, [0; 5], now);
    let order: Vec<Frame> = std::iter::from_fn(|| node.poll_transmit()).collect();
    let expected = ["084#0010010000000000", "184#0000", "584#6017100000000000", "704#05"];
    assert_eq!(order, expected.map(|text| text.parse().unwrap()));
}
